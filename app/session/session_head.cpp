#include "app/session/session_head.h"

#include <chrono>
#include <filesystem>

#include "app/cli/command.h"
#include "core/error.h"
#include "machine/toml_reader.h"
#include "machine/whole_file.h"

namespace knuckle::session {

std::string file_text(const std::string& source) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(source, ignored)) return "";
  try {
    return whole_file(source, kLargestToml_MB);
  } catch (const InputError&) {
    return "";  // it could be read when the session was made of it; the replay says that it is missing
  }
}

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
  head.law = setup.law;
  head.far_end_is_this_machine = true;
  head.machine_file = file_text(setup.machine.source);
  head.device_file = file_text(setup.device.source);
  head.scenario_file = options.scenario_text.empty() ? file_text(setup.scenario.source) : options.scenario_text;
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
  head.law = law;
  head.machine_file = file_text(machine.source);
  head.device_file = file_text(device.source);
  return head;
}

}  // namespace knuckle::session
