#include "app/bringup/commission_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <ostream>
#include <regex>
#include <sstream>

#include "app/bringup/commission_dialogue.h"
#include "app/cli/command.h"
#include "app/cli/output_file.h"
#include "app/motion/led_machine.h"
#include "app/recordings/recording_reader.h"
#include "core/error.h"
#include "core/units.h"
#include "estimation/identification/excitation.h"
#include "machine/file_text.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"

namespace knuckle::bringup {

namespace {

constexpr const char* kFirstLine = "# Written by knuckle commission.";
constexpr double kRampError = 0.03, kDeadBandStep = 1e-4;

std::string hex(std::uint32_t value) {
  return fmt::format("0x{:X}", value);
}

/// What was not measured has no key.
void put(std::ostream& out, const char* key, const std::optional<double>& value, double unit, double step) {
  if (value) out << key << " = " << number_text(std::round(*value / unit / step) * step) << '\n';
}

void write_axis(const AxisResult& axis, const char* name, std::ostream& out) {
  out << "\n[commissioning.axes." << name << "]\n";
  put(out, "stroke_mm", axis.stroke_m, 1e-3, 0.1);
  put(out, "encoder_offset_mm", axis.offset_m, 1e-3, 0.1);
  put(out, "zero_shift", axis.zero_shift, 1, 1e-6);
  out << "encoder_preset = " << (axis.preset ? "true" : "false") << '\n';
  put(out, "dead_band_extend", axis.dead_band_extend, 1, kDeadBandStep);
  put(out, "dead_band_retract", axis.dead_band_retract, 1, kDeadBandStep);
}

void write_record(const WizardResult& result, const BusDescription& bus, const ResultOrigin& origin,
                  std::ostream& out) {
  out << '\n'
      << kFirstLine << "\n[commissioning]\nversion = 2\nbus = " << toml_quoted(origin.bus)
      << "\ndate = " << toml_quoted(origin.date) << "\nprogram = " << toml_quoted(cli::program_version())
      << "\nmachine_sha256 = " << toml_quoted(origin.machine_sha256) << '\n';
  put(out, "tilt_error_deg", result.tilt_error_rad, kDegree, 0.01);
  out << "recordings = [";
  for (std::size_t i = 0; i < result.recordings.size(); ++i)
    out << (i > 0 ? ", " : "") << toml_quoted(result.recordings[i]);
  out << "]\n";
  for (std::size_t j = 0; j < kJoints; ++j) write_axis(result.axes[j], kJointNames[j], out);
  for (const GuardResult& guard : result.guards) {
    const bool node = !guard.node.empty();
    out << "\n[[commissioning.guards]]\n";
    if (node)
      out << "node = " << toml_quoted(guard.node) << "\nvendor = " << hex(guard.vendor)
          << "\nproduct = " << hex(guard.product) << '\n';
    else
      out << "frames = " << toml_quoted(commands_text(bus)) << '\n';
    if (guard.serial) out << "serial = " << hex(*guard.serial) << '\n';
    out << "proved = " << (guard.proved ? "true" : "false") << "\ndate = " << toml_quoted(origin.date)
        << "\nseen = " << toml_quoted(guard.seen) << '\n';
    if (node) out << "channels = " << toml_quoted(guard.channels) << '\n';
    out << fmt::format("valve_watchdog_ms = {:.9g}\n", 1e3 * bus.valve_watchdog_s);
    if (node) out << fmt::format("controller_timeout_ms = {:.9g}\n", 1e3 * bus.controller_timeout_s);
  }
  for (const NodeLine& node : result.nodes) {
    out << "\n[[commissioning.nodes]]\nid = " << hex(node.id) << "\nname = " << toml_quoted(node.name)
        << "\ndevice_type = " << hex(node.device_type.value_or(0)) << "\nvendor = " << hex(node.vendor.value_or(0))
        << "\nproduct = " << hex(node.product.value_or(0)) << '\n';
  }
  for (const Finding& one : result.findings) {
    out << "\n[[commissioning.findings]]\nlevel = " << toml_quoted(name(one.level))
        << "\nabout = " << toml_quoted(one.about) << "\ntext = " << toml_quoted(one.text) << '\n';
  }
}

/// The number of this key in an inline table on one line; nullopt where there is none.
std::optional<double> inline_number(const std::string& line, const std::string& key) {
  std::smatch found;
  if (!std::regex_search(line, found, std::regex("[{,]\\s*" + key + "\\s*=\\s*([-+0-9.eE_]+)"))) return std::nullopt;
  return std::strtod(found[1].str().c_str(), nullptr);
}

std::string with_inline_number(const std::string& line, const std::string& key, double value) {
  const std::string text = key + " = " + number_text(value);
  if (inline_number(line, key))
    return std::regex_replace(line, std::regex("([{,]\\s*)" + key + "\\s*=\\s*[-+0-9.eE_]+"), "$1" + text);
  const auto end = line.rfind('}', line.find('#'));
  if (end == std::string::npos) return line;
  const auto last = line.find_last_not_of(" \t", end - 1);
  return line.substr(0, last + 1) + ", " + text + ' ' + line.substr(end);
}

constexpr double kZeroStep = 1e-6;  // as it is written, in the file's unit

double in_unit(const std::string& line, const char* name, double si) {
  return std::regex_search(line, std::regex(std::string("unit\\s*=\\s*\"") + name + "\"")) ? si : 1;
}

/// What a number of the file in this line's unit is in m or rad.
double unit_of(const std::string& line) {
  return in_unit(line, "mm", 1e-3) * in_unit(line, "deg", kDegree);
}

std::string with_moved(const std::string& line, const char* key, double by) {
  const double moved = inline_number(line, key).value_or(0) + by;
  return with_inline_number(line, key, std::round(moved / kZeroStep) * kZeroStep);
}

/// A line of [bus.broadcast.signals] or [bus.node.inputs] with its zero moved.
std::string with_zero(const std::string& line, const BroadcastField& field, double shift) {
  if (field.analog) return with_moved(with_moved(line, "low", shift / unit_of(line)), "high", shift / unit_of(line));
  if (field.info().is_angle) return with_moved(line, "zero_rad", shift);
  return with_moved(line, "offset", shift / unit_of(line));
}

/// Whether this line of the file is that signal's.
bool is_line_of(const BroadcastField& field, const std::string& table, const std::string& key,
                const std::string& line) {
  if (!field.analog) return table == "[bus.broadcast.signals]" && key == field.info().name;
  return table == "[bus.node.inputs]" &&
         std::regex_search(line, std::regex(std::string("signal\\s*=\\s*\"") + field.info().name + "\""));
}

/// The text with the dead bands of `found` where they are not those of `machine`, and the zeros of its broadcasts,
/// without an earlier record.
std::string with_found(std::string_view text, const MachineDescription& machine, const MachineDescription& found,
                       const PerJoint<AxisResult>& axes) {
  const auto edit = [&](const std::string& table, const std::string& key, std::string& line) {
    const auto change = [&](const char* changed, double was, double is) {
      if (is != was && key == changed) line = with_toml_value(line, number_text(is));
    };
    for (std::size_t j = 0; j < kJoints; ++j) {
      const std::string axis = kJointNames[j];
      if (const auto sent = machine.bus.broadcast(NodeRole::kEncoder, static_cast<int>(j));
          axes[j].zero_shift && is_line_of(*sent.field, table, key, line))
        line = with_zero(line, *sent.field, *axes[j].zero_shift);
      if (table != "[cylinders." + axis + ".valve]" && table != "[calibration.valves." + axis + "]") continue;
      const ValveDescription &was = machine.cylinders[j].valve, &is = found.cylinders[j].valve;
      change("dead_band_extend", was.dead_band_extend, is.dead_band_extend);
      change("dead_band_retract", was.dead_band_retract, is.dead_band_retract);
    }
  };
  return edited_toml(without_toml_record(text, "commissioning", kFirstLine), edit);
}

/// Reads the text again, as every program will.
void check_found(const std::string& text, const MachineDescription& found) {
  constexpr double kSame = 2e-6;  // rad or m, as written
  const MachineDescription back = calibrated(parse_machine(text, found.source));
  for (std::size_t j = 0; j < kJoints; ++j) {
    const auto meant_zero = found.bus.broadcast(NodeRole::kEncoder, static_cast<int>(j)),
               zero = back.bus.broadcast(NodeRole::kEncoder, static_cast<int>(j));
    const bool same =
        meant_zero.field == nullptr || std::abs(zero.field->bits.offset - meant_zero.field->bits.offset) <= kSame;
    if (!same && meant_zero.field->analog)
      throw InputError(found.source + ": [bus.node.inputs] " + zero.field->info().name +
                       ": commissioning needs it on one line, with low and high as plain numbers");
    if (!same)
      throw InputError(found.source + ": [bus.broadcast.signals] " + zero.field->info().name +
                       ": commissioning needs it on one line, with its zero as a plain number");
    const ValveDescription &is = back.cylinders[j].valve, &meant = found.cylinders[j].valve;
    if (std::abs(is.dead_band_extend - meant.dead_band_extend) < kDeadBandStep / 2 &&
        std::abs(is.dead_band_retract - meant.dead_band_retract) < kDeadBandStep / 2) {
      continue;
    }
    throw InputError(found.source + ": [cylinders." + kJointNames[j] +
                     ".valve]: commissioning needs dead_band_extend and dead_band_retract on one line each");
  }
}

}  // namespace

MachineDescription with_zeros(const MachineDescription& machine, const PerJoint<AxisResult>& axes) {
  MachineDescription found = machine;
  for (BroadcastFrame& frame : found.bus.broadcasts) {
    for (BroadcastField& field : frame.fields) {
      if (field.info().role != NodeRole::kEncoder) continue;
      const double shift = axes[static_cast<std::size_t>(field.info().index)].zero_shift.value_or(0);
      field.bits.offset += shift;
      if (!field.analog) continue;
      field.analog->low += shift;
      field.analog->high += shift;
    }
  }
  return found;
}

double zero_shift(const MachineDescription& machine, int joint, double encoder, double length_m) {
  if (!machine.bus.measures_angle(joint)) return length_m - encoder;
  const auto angle_rad = Kinematics(as_drawn(machine)).joint_at(joint, length_m);
  if (!angle_rad)
    throw CommissionEnded(fmt::format("no angle of the {} gives its cylinder a length of {:.1f} mm",
                                      kJointNames[static_cast<std::size_t>(joint)], 1e3 * length_m));
  return std::remainder(*angle_rad - encoder, 2 * std::numbers::pi);
}

MachineDescription found_machine(const MachineDescription& machine, const PerJoint<AxisResult>& axes) {
  MachineDescription found = with_zeros(machine, axes);
  const auto take = [](double& file, const std::optional<double>& measured) {
    if (!measured || !dead_band_differs(*measured, file)) return;
    file = std::max(0.0, std::round(*measured / kDeadBandStep) * kDeadBandStep);
  };
  for (std::size_t j = 0; j < kJoints; ++j) {
    take(found.cylinders[j].valve.dead_band_extend, axes[j].dead_band_extend);
    take(found.cylinders[j].valve.dead_band_retract, axes[j].dead_band_retract);
  }
  return found;
}

std::string commissioned_text(std::string_view machine_file, const MachineDescription& machine,
                              const WizardResult& result, const ResultOrigin& origin) {
  const MachineDescription found = found_machine(machine, result.axes);
  std::ostringstream out;
  out << with_found(machine_file, machine, found, result.axes);
  write_record(result, machine.bus, origin, out);
  check_found(out.str(), found);
  return out.str();
}

void check_layout(std::string_view machine_file, const MachineDescription& machine) {
  constexpr double kAnyShift = 0.125;
  PerJoint<AxisResult> axes;
  const auto another = [](double file) { return file < 0.2 ? file + 2 * kRampError : file - 2 * kRampError; };
  for (std::size_t j = 0; j < kJoints; ++j) {
    const ValveDescription& valve = machine.cylinders[j].valve;
    axes[j].dead_band_extend = another(valve.dead_band_extend);
    axes[j].dead_band_retract = another(valve.dead_band_retract);
    if (machine.bus.broadcast(NodeRole::kEncoder, static_cast<int>(j)).field != nullptr) axes[j].zero_shift = kAnyShift;
  }
  const MachineDescription other = found_machine(machine, axes);
  check_found(with_found(machine_file, machine, other, axes), other);
}

namespace {

constexpr Duration kStill = 1500ms;

/// Gently to the path's first point, then along it; only that is recorded.
estimation::Recording follow(motion::LedMachine& led, const estimation::JointPath& path, const std::string& source) {
  led.go_to(path.joint_rad.front());
  led.rest(kStill);
  estimation::Recording made;
  made.source = source;
  made.step_s = to_seconds(led.period());
  led.lead(path);
  while (!led.done()) (void)led.record(made);
  return made;
}

}  // namespace

std::vector<std::string> record_motions(const MachineDescription& machine, BusAccess& access,
                                        const IdentifyMotions& motions, const std::string& folder,
                                        const std::function<bool()>& stopped) {
  using estimation::MotionSpeed;
  std::vector<std::string> files;
  motion::LedMachine led(machine, access, access.now());
  led.each_step = [&stopped] {
    if (stopped()) throw CommissionEnded("stopped from the keyboard");
  };
  const auto record = [&](const char* name, const estimation::JointPath& path) {
    const std::string file = recording_file(folder, name);
    cli::OutputFile out("--record", file);
    recordings::write_recording(follow(led, path, name), out.stream());
    out.commit();
    files.push_back(file);
  };
  try {
    led.engage();
    record(kMotionNames[0], estimation::slow_sweeps(machine, motions.slow_s));
    record(kMotionNames[1], estimation::fast_excitation(machine, motions.fast_s, motions.seed));
    record(kMotionNames[2],
           estimation::held_out_motion(machine, motions.seed + 1, MotionSpeed::kSlow, motions.validation_s));
    record(kMotionNames[3],
           estimation::held_out_motion(machine, motions.seed + 2, MotionSpeed::kDigging, motions.validation_s));
  } catch (const motion::NotLed& ended) {
    led.neutral();
    throw CommissionEnded(ended.what());
  } catch (...) {
    led.neutral();
    throw;
  }
  led.neutral();
  return files;
}

}  // namespace knuckle::bringup
