// `knuckle calibrate-device`: the dialogue on a terminal around app/bringup/device_calibration.h.
#include <iostream>
#include <memory>

#include "app/bringup/device_calibration.h"
#include "app/cli/output_file.h"
#include "core/realtime_thread.h"
#include "machine/device_description.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/toml_reader.h"

namespace knuckle::bringup {
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
  return {"calibrate-device", "Measure signs and zeros of a haptic device by moving its joints to their stops",
          [](const cli::OptionList& c) {
            const auto o = std::make_shared<Options>();
            c.add_option("--device", o->back_end, "Back end: hid (hidraw) or usb (libusb)").required();
            c.add_option("--device-file", o->file, "Device name or .toml file to start from").show_default();
            add_device_choice(c, o->choice);
            c.add_option("--out", o->out, "Write the calibrated device file (- = standard output)").required();
            return [o] { return run(*o); };
          }};
}

}  // namespace knuckle::bringup
