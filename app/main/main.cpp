// The program: reads the command line, runs the command, turns errors into exit codes.
#include <iostream>

#include "app/interrupt.h"
#include "app/options.h"
#include "app/simulate.h"
#include "core/error.h"

int main(int argc, char** argv) {
  using namespace knuckle;
  constexpr int kBadInput = 2, kFailed = 1, kInterrupted = 130;
  try {
    const app::CommandLine line = app::parse_command_line({argv + 1, argv + argc});
    if (line.command == app::CommandLine::Command::kSimulate)
      return app::simulate_command(line.simulate, app::run_simulation);
    std::cout << line.text;
    return 0;
  } catch (const InputError& error) {
    std::cerr << "knuckle: " << error.what() << '\n';
    return kBadInput;
  } catch (const app::Interrupted&) {
    std::cerr << "knuckle: interrupted; nothing was written\n";
    return kInterrupted;
  } catch (const std::exception& error) {
    std::cerr << "knuckle: internal error: " << error.what() << '\n';
    return kFailed;
  }
}
