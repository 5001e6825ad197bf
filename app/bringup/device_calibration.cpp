#include "app/bringup/device_calibration.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <numbers>
#include <utility>
#include <vector>

#include "app/cli/output_file.h"
#include "core/error.h"
#include "core/realtime_thread.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/toml_reader.h"

namespace knuckle::bringup {

namespace {

constexpr double kStopTolerance = 0.05;  // of the range between the stops: soft stops; a wrong gear ratio exceeds it
constexpr Duration kStillTime = 200ms;
constexpr double kStill_rad = 0.02;
constexpr const char* kLayoutNeeded = ": calibration needs one key per line in each [joints.*] table";

struct Stops {
  const char *low, *high;
};
constexpr PerJoint<Stops> kDirections{{{"Lower the forearm", "Raise the forearm"},
                                       {"Fold the wrist in", "Stretch the wrist out"},
                                       {"Curl the finger in", "Stretch the finger out"}}};

double counts_per_rad(const DeviceIdentity& identity, std::size_t joint) {
  return double(identity.gear_ratio[joint]) * identity.counts_per_turn[joint] / (2 * std::numbers::pi);
}

std::string fixed(double value, int digits) {
  return fmt::format("{:.{}f}", value, digits);
}

/// Nine digits: all that was measured, none that only binary fractions have.
std::string digits(double value) {
  return fmt::format("{:.9g}", value);
}

/// A float of the wire as the decimal number it was made from.
double decimal(float value) {
  return std::stod(fmt::format("{:.7g}", double(value)));
}

/// Counts of one joint, held still; nullopt where no reports are received.
std::optional<std::int32_t> still_counts(DeviceProbe& probe, double per_rad, std::size_t joint,
                                         const CalibrationDialogue& person, const std::string& request) {
  for (;;) {
    if (!person.ask(request + " to its stop, hold it there, and press Enter.")) return std::nullopt;
    const DeviceListening heard = probe.listen(kStillTime);
    if (heard.reports == 0) {
      person.say("The device has stopped reporting: check its cable, then start again.");
      return std::nullopt;
    }
    const double moved_rad = (double(heard.highest[joint]) - heard.lowest[joint]) / per_rad;
    if (moved_rad <= kStill_rad) return heard.newest.counts[joint];
    person.say("It moved by " + fixed(moved_rad * 180 / std::numbers::pi, 1) + " deg while it was sampled, limit " +
               fixed(kStill_rad * 180 / std::numbers::pi, 1) + " deg: hold it still and repeat.");
  }
}

/// What stands in one [joints.*] table after calibration: key and value.
std::vector<std::pair<std::string, std::string>> joint_values(const DeviceDescription& device, std::size_t joint) {
  return {{"counts_per_turn", std::to_string(device.counts_per_turn[joint])},
          {"gear_ratio", digits(device.gear_ratio[joint])},
          {"torque_constant_mNm_per_A", digits(1e3 * device.torque_constant_Nm_per_A[joint])},
          {"rated_current_A", digits(device.rated_current_A[joint])},
          {"counts_rise", device.joint_sign[joint] > 0 ? "\"counter-clockwise\"" : "\"clockwise\""},
          {"zero_counts", std::to_string(device.zero_counts[joint])}};
}

}  // namespace

std::optional<DeviceDescription> calibrated_device(const DeviceDescription& file, const DeviceIdentity& identity,
                                                   const StopCounts& stops, std::string& problem) {
  DeviceDescription device = file;
  device.serial = identity.serial;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double per_rad = counts_per_rad(identity, i);
    const double moved = double(stops.high[i]) - double(stops.low[i]);
    const double moved_rad = std::abs(moved) / per_rad, range_rad = file.max_rad[i] - file.min_rad[i];
    if (std::abs(moved_rad - range_rad) > kStopTolerance * range_rad) {
      problem = std::string(kDeviceJointNames[i]) + ": measured " + fixed(moved_rad, 3) +
                " rad between its stops, file " + fixed(range_rad, 3) +
                " rad (min_rad to max_rad), tolerance 5 %: move it to both stops, or correct gear_ratio or "
                "counts_per_turn of the device";
      return std::nullopt;
    }
    const int sign = moved > 0 ? 1 : -1;
    const double middle_counts = 0.5 * (double(stops.low[i]) + double(stops.high[i]));
    const double middle_rad = 0.5 * (file.min_rad[i] + file.max_rad[i]);
    device.joint_sign[i] = sign;
    device.zero_counts[i] = std::int32_t(std::lround(middle_counts - sign * per_rad * middle_rad));
    device.counts_per_turn[i] = identity.counts_per_turn[i];
    device.gear_ratio[i] = decimal(identity.gear_ratio[i]);
    device.torque_constant_Nm_per_A[i] = 1e-3 * decimal(1e3F * identity.torque_constant_Nm_per_A[i]);
    device.rated_current_A[i] = identity.rated_current_mA[i] / 1e3;
  }
  return device;
}

std::optional<StopCounts> find_stops(DeviceProbe& probe, const DeviceIdentity& identity,
                                     const CalibrationDialogue& person) {
  StopCounts stops;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const double per_rad = counts_per_rad(identity, i);
    const auto low = still_counts(probe, per_rad, i, person, kDirections[i].low);
    if (!low) return std::nullopt;
    const auto high = still_counts(probe, per_rad, i, person, kDirections[i].high);
    if (!high) return std::nullopt;
    stops.low[i] = *low;
    stops.high[i] = *high;
  }
  return stops;
}

std::string calibrated_device_text(std::string_view file_text, const DeviceDescription& device) {
  const std::string serial = std::to_string(device.serial);
  const std::string text = edited_toml(file_text, [&](const auto& table, const auto& key, std::string& line) {
    if (table.empty() && key == "serial") {
      line = with_toml_value(line, serial);
    } else if (table.empty() && key == "name" && parse_device(file_text, device.source).serial == 0) {
      line += "\nserial = " + serial + "  # signs and zeros below were measured on this device";
    }
    for (std::size_t i = 0; i < kJoints; ++i) {
      if (table != "[joints." + std::string(kDeviceJointNames[i]) + "]") continue;
      for (const auto& [name, value] : joint_values(device, i)) {
        if (key != name) continue;
        if (name == "counts_rise" && line.find(value) == std::string::npos) line = line.substr(0, line.find('#'));
        line = with_toml_value(line, value);
      }
    }
  });
  const DeviceDescription back = parse_device(text, device.source);
  const bool same = back.serial == device.serial && back.joint_sign == device.joint_sign &&
                    back.zero_counts == device.zero_counts && back.counts_per_turn == device.counts_per_turn;
  if (!same) throw InputError(device.source + kLayoutNeeded);
  return text;
}

namespace {

struct Options {
  std::string back_end, file = "knuckle1", out;
  HidChoice choice;
};

CalibrationDialogue on_terminal() {
  return {[](const std::string& line) { std::cout << line << std::endl; },
          [](const std::string& line) {
            std::cout << line << std::endl;
            std::string answer;
            return bool(std::getline(std::cin, answer));
          }};
}

void print_result(const DeviceDescription& device, const DeviceIdentity& identity, const CalibrationDialogue& person) {
  for (std::size_t i = 0; i < kJoints; ++i) {
    const char* rise = device.joint_sign[i] > 0 ? "counter-clockwise" : "clockwise";
    person.say(std::string(kDeviceJointNames[i]) + ": counts rise " + rise + ", zero at " +
               std::to_string(device.zero_counts[i]) + " (the device reports " +
               std::to_string(identity.zero_counts[i]) + ")");
    if (device.joint_sign[i] == identity.joint_sign[i]) continue;
    person.say(std::string(kDeviceJointNames[i]) + ": the device reports the opposite sign: correct its firmware, too");
  }
}

int run(const Options& options) {
  cli::Places places;
  places.configuration("--device-file", options.file);
  places.configuration_output("--out", options.out);
  const DeviceDescription file = load_device(find_config("device", options.file));
  const auto port = open_device_port("--device", options.back_end, {.choice = options.choice});
  const RealtimeClock clock;
  DeviceProbe probe(*port, [&clock](Duration time) { clock.sleep_until(clock.now() + time); });
  const CalibrationDialogue person = on_terminal();
  const auto identity = probe.identity(3s);
  if (!identity) {
    const std::string problem = port->status().problem;
    std::cerr << "knuckle calibrate-device: " << (problem.empty() ? "the device does not describe itself" : problem)
              << ": see knuckle doctor --device " << options.back_end << '\n';
    return 1;
  }
  person.say("Haptic device " + std::to_string(identity->serial) +
             ": its motors stay off. Move each of the three joints to both of its stops.");
  const auto stops = find_stops(probe, *identity, person);
  if (!stops) {
    std::cerr << "knuckle calibrate-device: cancelled; nothing was written\n";
    return 1;
  }
  std::string problem;
  const auto device = calibrated_device(file, *identity, *stops, problem);
  if (!device) {
    std::cerr << "knuckle calibrate-device: " << problem << "; nothing was written\n";
    return 1;
  }
  print_result(*device, *identity, person);
  cli::OutputFile out("--out", options.out);
  out.stream() << calibrated_device_text(whole_file(file.source, kLargestToml_MB), *device);
  out.commit();
  return 0;
}

}  // namespace

cli::Command calibrate_device_entry() {
  return cli::command<Options>(
      "calibrate-device", "Measure signs and zeros of a haptic device by moving its joints to their stops",
      [](const cli::OptionList& c, Options& o) {
        c.add_option("--device", o.back_end, "Back end: hid (hidraw) or usb (libusb)").required();
        c.add_option("--device-file", o.file, "Device name or .toml file to start from").show_default();
        add_device_choice(c, o.choice);
        c.add_option("--out", o.out, "Write the calibrated device file (- = standard output)").required();
      },
      run);
}

}  // namespace knuckle::bringup
