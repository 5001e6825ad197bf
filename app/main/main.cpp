// The program: reads the command line, runs the command, turns errors into exit codes.
#include <iostream>
#include <string>
#include <vector>

#include "app/command.h"
#include "app/commissioning/identify.h"
#include "app/commissioning/real_recordings.h"
#include "app/commissioning/sweep.h"
#include "app/hardware/commission_command.h"
#include "app/hardware/device_calibration.h"
#include "app/hardware/device_command.h"
#include "app/hardware/doctor_command.h"
#include "app/hardware/master_command.h"
#include "app/hardware/node_command.h"
#include "app/hardware/slave_command.h"
#include "app/interrupt.h"
#include "app/programs/simulate_command.h"
#include "app/window/console_command.h"
#include "core/error.h"

namespace knuckle::app {
namespace {

/// Everything that Knuckle can be told to do.
std::vector<Command> commands() {
  return {
      simulate_entry([](const SimulateOptions& options) { return simulate_command(options, run_simulation); }),
      identify_entry(identify_command),
      real_recordings_entry(),
      sweep_entry(),
      console_entry(),
      slave_entry(),
      master_entry(),
      node_entry(),
      device_entry(),
      calibrate_device_entry(),
      doctor_entry(),
      commission_entry(),
  };
}

/// @return the exit code.
int run(const std::vector<std::string>& arguments) {
  constexpr int kBadInput = 2, kFailed = 1, kInterrupted = 130;
  try {
    const CommandLine line = parse_command_line(commands(), arguments);
    if (line.run) return line.run();
    std::cout << line.text;
    return 0;
  } catch (const InputError& error) {
    std::cerr << "knuckle: " << error.what() << '\n';
    return kBadInput;
  } catch (const Interrupted&) {
    std::cerr << "knuckle: interrupted; nothing was written\n";
    return kInterrupted;
  } catch (const std::exception& error) {
    std::cerr << "knuckle: internal error: " << error.what() << '\n';
    return kFailed;
  }
}

}  // namespace
}  // namespace knuckle::app

int main(int argc, char** argv) {
  return knuckle::app::run({argv + 1, argv + argc});
}
