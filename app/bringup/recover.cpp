#include "app/bringup/recover.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "app/bringup/can_interfaces.h"
#include "app/bringup/commission_bus.h"
#include "app/bringup/commission_jog.h"
#include "app/bringup/dialogue_log.h"
#include "app/cli/background_writer.h"
#include "app/cli/interrupt.h"
#include "core/text.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/toml_reader.h"
#include "slave/bus_listen.h"
#include "slave/safety_gate.h"

namespace knuckle::bringup {

namespace {

constexpr double kInside_m = 0.005;  // so that noise does not leave it outside
constexpr double kStep_m = 0.05;     // at most, for each word of the person
constexpr double kOpening = 0.1;     // behind the dead band: a few centimetres a second
constexpr double kLeastProgress_m = 1e-3, kMostOutward_m = 3e-3;

double shortfall_m(const LengthRange& range, double length_m) {
  if (length_m < range.shortest_m) return range.shortest_m - length_m;
  return length_m > range.longest_m ? range.longest_m - length_m : 0;
}

void bring_in(const MachineDescription& machine, int joint, JogBench& bench, Dialogue& dialogue) {
  const char* name = kJointNames[static_cast<std::size_t>(joint)];
  const LengthRange range = working_lengths(machine, joint);
  bool proven = false;
  const auto length_m = [&] { return bench.sensors().length_m[joint] - machine.sensors.encoder_offset_m[joint]; };
  for (;;) {
    const double left_m = shortfall_m(range, length_m());
    dialogue.say(fmt::format("the {} cylinder is {:.0f} mm long; its working range is {:.0f} to {:.0f} mm", name,
                             1e3 * length_m(), 1e3 * range.shortest_m, 1e3 * range.longest_m));
    if (left_m == 0) return;
    if (!std::exchange(proven, true)) bench.prove_closed();
    const bool extends = left_m > 0;
    const double way_m = std::min(std::abs(left_m) + kInside_m, kStep_m);
    dialogue.ask(
        fmt::format("After your answer it {} slowly by {:.0f} mm, and nothing else moves: watch it, {} stops it.",
                    extends ? "extends" : "retracts", 1e3 * way_m, dialogue.stop_gesture()),
        {"go"});
    const ValveDescription& valve = machine.cylinders[static_cast<std::size_t>(joint)].valve;
    const double peak = std::min(valve.dead_band(extends) + kOpening, slave::kJogTable.command);
    const double before_m = length_m();
    const JogRun run =
        bench.run({.joint = joint, .peak = extends ? peak : -peak, .travel_m = way_m, .back_m = kMostOutward_m});
    const double gained_m = (extends ? 1 : -1) * (length_m() - before_m);
    if (run.end == slave::JogEnd::kWrongWay || gained_m < kLeastProgress_m)
      throw CommissionEnded(
          fmt::format("the {} cylinder {} by {:.0f} mm instead: check its valve's sign, its load and its "
                      "hoses",
                      name, gained_m < -kLeastProgress_m ? "moved outward" : "moved", 1e3 * std::abs(gained_m)));
  }
}

}  // namespace

LengthRange working_lengths(const MachineDescription& machine, int joint) {
  const Kinematics kinematics(machine);
  const LinkDescription& link = machine.links[static_cast<std::size_t>(joint)];
  // A working range beyond a toggle is refused with the file.
  const double a = kinematics.cylinder_at(joint, link.min_rad).value().length_m;
  const double b = kinematics.cylinder_at(joint, link.max_rad).value().length_m;
  return {std::min(a, b), std::max(a, b)};
}

void recover(const MachineDescription& machine, int joint, BusAccess& access, Partner partner,
             const std::function<void()>& check) {
  std::optional<JogBench> bench;
  Dialogue dialogue(std::move(partner), [&] {
    check();
    if (bench)
      bench->idle();
    else
      access.wait_until(access.now() + 5ms);
  });
  (void)sound_bus(machine, access, dialogue, check);
  dialogue.ask(
      "Bucket free of ground and load, engine at low speed, no person in reach, a hand on the machine's own E-stop? "
      "Then "
      "the nodes are configured and started, and pilot pressure is on for two seconds with all valves closed.",
      {"ready"});
  alone_on_bus(machine, access);
  bench.emplace(machine, access, [&] {
    check();
    return dialogue.interrupted();
  });
  try {
    bench->start();
    bench->idle(500ms);
    bring_in(machine, joint, *bench, dialogue);
  } catch (...) {
    if (bench->client().commanded()) dialogue.say(take_out_of_service(machine, access, bench->may_command()));
    throw;
  }
  dialogue.say(take_out_of_service(machine, access, bench->may_command()));
}

namespace {

struct RecoverOptions {
  std::vector<std::string> can;
  std::string machine, axis;
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
  BusAccess bus = machine_access(options.can, machine.bus);
  slave::refuse_other_controller(machine.bus, bus);
  const std::string command =
      "knuckle recover --machine " + file + " --axis " + options.axis + can_arguments(options.can);
  DialogueLog log(options.log, dialogue_head(command, text, false, bus.now()), machine, "recover");
  BusAccess access = log.tapped(bus);
  LineInput input(STDIN_FILENO);
  cli::BackgroundWriter dialogue(STDOUT_FILENO);  // nobody who does not read it holds up the machine's loop, or a stop
  for (const std::string& line : log.notes()) dialogue.stream() << line << '\n';
  const Partner person = log.noted(terminal(
      dialogue.stream(), [&] { return input.poll(); }, true));
  dialogue.stream() << std::flush;
  check_told(dialogue, kToldPatience);
  try {
    log.run(dialogue.stream(), [&] {
      recover(machine, static_cast<int>(axis - kJointNames.begin()), access, person, [&] {
        neutral_where_interrupted(interrupt);
        check_told(dialogue);
      });
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
  return cli::command<RecoverOptions>(
      "recover", "Bring a joint that stands beyond its working range back into it, slowly and inward only",
      [](const cli::OptionList& command, RecoverOptions& o) {
        command.add_option("--can", o.can, "CAN interface of the machine bus (can0); of two NAME=INTERFACE for each")
            .one_value_each()
            .required();
        command.add_option("--machine", o.machine, "Machine name or .toml file").required();
        command.add_option("--axis", o.axis, "Which joint: boom, arm or bucket")
            .required()
            .one_of({"boom", "arm", "bucket"});
        recordings::add_log_options(command, o.log, "Record nothing");
        command.add_note("Answers are typed at the terminal; pressing Enter stops a motion.");
      },
      run_recover);
}

}  // namespace knuckle::bringup
