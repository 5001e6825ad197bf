#include "app/bringup/commission_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <ostream>
#include <sstream>

#include "app/cli/command.h"
#include "core/error.h"
#include "machine/load.h"
#include "machine/toml_lines.h"
#include "machine/toml_reader.h"

namespace knuckle::bringup {
namespace {

constexpr const char* kOpening = "# Written by knuckle commission.";
constexpr double kRampError = 0.03, kDeadBandStep = 1e-4;

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + '"';
}

bool is_record(const std::string& table) {
  const std::string name = table.substr(std::min(table.find_first_not_of('['), table.size()));
  return name == "commissioning]" || name.starts_with("commissioning.");
}

/// What was not measured has no key.
void put(std::ostream& out, const char* key, const std::optional<double>& value, double unit, double step) {
  if (value) out << key << " = " << number_text(std::round(*value / unit / step) * step) << '\n';
}

void write_axis(const AxisResult& axis, const char* name, std::ostream& out) {
  out << "\n[commissioning.axes." << name << "]\n";
  put(out, "stroke_mm", axis.stroke_m, 1e-3, 0.1);
  put(out, "encoder_offset_mm", axis.offset_m, 1e-3, 0.1);
  out << "encoder_preset = " << (axis.preset ? "true" : "false") << '\n';
  put(out, "dead_band_extend", axis.dead_band_extend, 1, kDeadBandStep);
  put(out, "dead_band_retract", axis.dead_band_retract, 1, kDeadBandStep);
}

void write_record(const WizardResult& result, const ResultOrigin& origin, std::ostream& out) {
  out << '\n'
      << kOpening << "\n[commissioning]\nversion = 2\nbus = " << quoted(origin.bus)
      << "\ndate = " << quoted(origin.date) << "\nprogram = " << quoted(cli::program_version())
      << "\nmachine_sha256 = " << quoted(origin.machine_sha256) << '\n';
  put(out, "tilt_error_deg", result.tilt_error_rad, std::numbers::pi / 180, 0.01);
  out << "recordings = [";
  for (std::size_t i = 0; i < result.recordings.size(); ++i) out << (i > 0 ? ", " : "") << quoted(result.recordings[i]);
  out << "]\n";
  for (std::size_t j = 0; j < kJoints; ++j) write_axis(result.axes[j], kJointNames[j], out);
  for (const NodeLine& node : result.nodes) {
    out << "\n[[commissioning.nodes]]\nid = " << fmt::format("0x{:X}", node.id) << "\nname = " << quoted(node.name)
        << "\ndevice_type = " << fmt::format("0x{:X}", node.device_type.value_or(0))
        << "\nvendor = " << fmt::format("0x{:X}", node.vendor.value_or(0))
        << "\nproduct = " << fmt::format("0x{:X}", node.product.value_or(0)) << '\n';
  }
  for (const Finding& one : result.findings) {
    out << "\n[[commissioning.findings]]\nlevel = " << quoted(name(one.level)) << "\nabout = " << quoted(one.about)
        << "\ntext = " << quoted(one.text) << '\n';
  }
}

/// The text with the dead bands of `found` where they are not those of `machine`, without an earlier record.
std::string with_dead_bands(std::string_view text, const MachineDescription& machine, const MachineDescription& found) {
  std::istringstream lines{std::string(text)};
  std::string kept, table;
  const auto change = [&](std::string& line, const char* key, std::size_t joint, double was, double is) {
    const std::string axis = kJointNames[joint];
    const bool its_table = table == "[cylinders." + axis + ".valve]" || table == "[calibration.valves." + axis + "]";
    if (its_table && is != was && toml_key(line) == key) line = with_toml_value(line, number_text(is));
  };
  for (std::string line; std::getline(lines, line);) {
    if (const std::string key = toml_key(line); key.starts_with('[')) table = key;
    if (is_record(table) || line == kOpening) continue;
    for (std::size_t j = 0; j < kJoints; ++j) {
      const ValveDescription &was = machine.cylinders[j].valve, &is = found.cylinders[j].valve;
      change(line, "dead_band_extend", j, was.dead_band_extend, is.dead_band_extend);
      change(line, "dead_band_retract", j, was.dead_band_retract, is.dead_band_retract);
    }
    kept += line + '\n';
  }
  kept.erase(kept.find_last_not_of("\n\r \t") + 1);
  return kept + '\n';
}

/// Reads the text again, as every program will.
void check_dead_bands(const std::string& text, const MachineDescription& found) {
  const MachineDescription back = calibrated(parse_machine(text, found.source));
  for (std::size_t j = 0; j < kJoints; ++j) {
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

bool dead_band_differs(double found, double file) noexcept {
  return std::abs(found - file) > kRampError;
}

MachineDescription found_machine(const MachineDescription& machine, const PerJoint<AxisResult>& axes) {
  MachineDescription found = machine;
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
  out << with_dead_bands(machine_file, machine, found);
  write_record(result, origin, out);
  check_dead_bands(out.str(), found);
  return out.str();
}

void check_layout(std::string_view machine_file, const MachineDescription& machine) {
  PerJoint<AxisResult> axes;
  const auto another = [](double file) { return file < 0.2 ? file + 2 * kRampError : file - 2 * kRampError; };
  for (std::size_t j = 0; j < kJoints; ++j) {
    const ValveDescription& valve = machine.cylinders[j].valve;
    axes[j].dead_band_extend = another(valve.dead_band_extend);
    axes[j].dead_band_retract = another(valve.dead_band_retract);
  }
  const MachineDescription other = found_machine(machine, axes);
  check_dead_bands(with_dead_bands(machine_file, machine, other), other);
}

}  // namespace knuckle::bringup
