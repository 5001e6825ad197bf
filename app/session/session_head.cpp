#include "app/session/session_head.h"

#include <chrono>

#include "app/cli/command.h"

namespace knuckle::session {

recording::Head session_head(const SessionSetup& setup, const SimulateOptions& options) {
  recording::Head head;
  head.program = "knuckle simulate --scenario " + options.scenario + " --seed " + std::to_string(setup.seed);
  head.version = cli::program_version();
  head.virtual_time = !options.realtime;
  if (options.realtime) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    head.started_unix_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
  }
  head.simulated = head.has_operator = head.has_machine = true;
  head.operator_start = setup.starts().operator_end;
  head.machine_start = setup.starts().machine_end;
  head.law = name(setup.law);
  head.far_end_is_this_machine = true;
  head.machine_file = setup.machine.text;
  head.device_file = setup.device.text;
  head.scenario_file = setup.scenario.text;
  return head;
}

recording::Head operator_head(const std::string& program, std::int64_t started_unix_ns,
                              const MachineDescription& machine, const DeviceDescription& device, ControlLaw law,
                              const LinkStart& start) {
  recording::Head head;
  head.program = program;
  head.version = cli::program_version();
  head.started_unix_ns = started_unix_ns;
  head.has_operator = true;
  head.operator_start = start;
  head.law = name(law);
  head.machine_file = machine.text;
  head.device_file = device.text;
  return head;
}

}  // namespace knuckle::session
