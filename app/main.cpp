// The program: reads the command line, runs the command, turns errors into exit codes.
#include <iostream>
#include <string>
#include <vector>

#include "app/bringup/commission_command.h"
#include "app/bringup/device_calibration.h"
#include "app/bringup/doctor_command.h"
#include "app/cli/command.h"
#include "app/cli/interrupt.h"
#include "app/console/window/console_command.h"
#include "app/identify/identify.h"
#include "app/programs/device_command.h"
#include "app/programs/master_command.h"
#include "app/programs/node_command.h"
#include "app/programs/simulate_command.h"
#include "app/programs/slave_command.h"
#include "app/studies/real_recordings.h"
#include "app/studies/sweep.h"
#include "core/error.h"

namespace knuckle {
namespace {

/// Everything that Knuckle can be told to do.
std::vector<cli::Command> commands() {
  return {
      programs::simulate_entry([](const session::SimulateOptions& options) {
        return programs::simulate_command(options, session::run_simulation);
      }),
      identify::identify_entry(identify::identify_command),
      studies::real_recordings_entry(),
      studies::sweep_entry(),
      console::window::console_entry(),
      programs::slave_entry(),
      programs::master_entry(),
      programs::node_entry(),
      programs::device_entry(),
      bringup::calibrate_device_entry(),
      bringup::doctor_entry(),
      bringup::commission_entry(),
  };
}

/// @return the exit code.
int run(const std::vector<std::string>& arguments) {
  constexpr int kBadInput = 2, kFailed = 1, kInterrupted = 130;
  try {
    const cli::CommandLine line = cli::parse_command_line(commands(), arguments);
    if (line.run) return line.run();
    std::cout << line.text;
    return 0;
  } catch (const InputError& error) {
    std::cerr << "knuckle: " << error.what() << '\n';
    return kBadInput;
  } catch (const cli::Interrupted&) {
    std::cerr << "knuckle: interrupted; nothing was written\n";
    return kInterrupted;
  } catch (const std::exception& error) {
    std::cerr << "knuckle: internal error: " << error.what() << '\n';
    return kFailed;
  }
}

}  // namespace
}  // namespace knuckle

int main(int argc, char** argv) {
  return knuckle::run({argv + 1, argv + argc});
}
