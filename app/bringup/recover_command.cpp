#include "app/bringup/recover_command.h"

#include <unistd.h>

#include <algorithm>
#include <memory>

#include "app/bringup/dialogue_log.h"
#include "app/bringup/recover.h"
#include "app/cli/background_writer.h"
#include "app/cli/interrupt.h"
#include "core/text.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/toml_reader.h"
#include "slave/bus_listen.h"

namespace knuckle::bringup {
namespace {

struct RecoverOptions {
  std::string can, machine, axis;
  recordings::LogOptions log;
};

int run_recover(const RecoverOptions& options) {
  if (isatty(STDIN_FILENO) != 1)
    cli::refuse_option("recover", "", "needs a person at a terminal: pressing Enter is what stops it");
  recordings::check_log(options.log);
  const cli::InterruptGuard interrupt;
  const std::string file = find_config("machine", options.machine), text = whole_file(file, kLargestToml_MB);
  const MachineDescription machine = calibrated(load_machine(file));
  const auto* axis = std::find(kJointNames.begin(), kJointNames.end(), options.axis);
  BusAccess bus = real_access(options.can);
  slave::refuse_other_controller(machine.bus, bus);
  const std::string command = "knuckle recover --can " + options.can + " --machine " + file + " --axis " + options.axis;
  DialogueLog log(options.log, dialogue_head(command, text, false, bus.now()), machine, "recover");
  BusAccess access = log.taped(bus);
  LineInput input(STDIN_FILENO);
  cli::BackgroundWriter dialogue(STDOUT_FILENO);  // nobody who does not read it holds up the machine's loop, or a stop
  for (const std::string& line : log.notes()) dialogue.stream() << line << '\n';
  const Partner person = log.noted(terminal(
      dialogue.stream(), [&] { return input.poll(); }, true));
  try {
    log.run(dialogue.stream(), [&] {
      recover(machine, static_cast<int>(axis - kJointNames.begin()), access, person,
              [&] { neutral_where_interrupted(interrupt); });
    });
    return 0;
  } catch (const CommissionEnded& ended) {
    dialogue.finish();
    cli::BackgroundWriter(STDERR_FILENO).stream()
        << "knuckle: ended, machine neutral: " << printable(ended.what()) << '\n';
    return 1;
  }
}

}  // namespace

cli::Command recover_entry() {
  return {"recover", "Bring a joint that stands beyond its working range back into it, slowly and inward only",
          [](const cli::OptionList& command) {
            const auto o = std::make_shared<RecoverOptions>();
            command.add_option("--can", o->can, "CAN interface of the machine bus (can0)").required();
            command.add_option("--machine", o->machine, "Machine name or .toml file").required();
            command.add_option("--axis", o->axis, "Which joint: boom, arm or bucket")
                .required()
                .one_of({"boom", "arm", "bucket"});
            recordings::add_log_options(command, o->log, "Record nothing");
            command.add_note("Answers are typed at the terminal; pressing Enter stops a motion.");
            return [o] { return run_recover(*o); };
          }};
}

}  // namespace knuckle::bringup
