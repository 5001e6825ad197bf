#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/bringup/can_interfaces.h"
#include "app/cli/interrupt.h"
#include "app/cli/json.h"
#include "app/pairing/chosen_link.h"
#include "app/programs/program_frame.h"
#include "app/programs/programs.h"
#include "app/programs/service_watch.h"
#include "app/programs/slave_audit.h"
#include "app/programs/slave_cameras.h"
#include "app/programs/slave_program.h"
#include "app/recordings/program_log.h"
#include "app/session/scenario.h"
#include "app/session/scene.h"
#include "core/loop_table.h"
#include "machine/load.h"
#include "machine/room.h"
#include "sim/machine_on_bus.h"
#include "sim/truth.h"
#include "slave/bus_listen.h"
#include "slave/bus_map.h"
#include "slave/loss_policy.h"

namespace knuckle::programs {
namespace {

using cli::Json;
constexpr const char* kSchema = "knuckle-slave/1";
constexpr const char* kSimulatedBus = "simulated";
// After control has changed hands the machine has latched a lost link, and has to be aligned anew.
static_assert(secure::kHandOverGap > slave::kLossLimits.neutral);

struct Options {
  std::string machine, contact_model;
  std::vector<std::string> can;
  pairing::LinkOptions link;
  bool simulate = false, wait_for_can = false;
  std::string scenario;
  std::optional<std::uint64_t> seed;
  std::optional<int> observers;
  RunOptions run;
  std::string candump, audit;
  recordings::LogOptions log;
  CameraOptions cameras;
};

void add_options(const cli::OptionList& c, Options& o) {
  c.add_option("--machine", o.machine, "Machine name or .toml file (default with --simulate: solar015)");
  c.add_option("--contact-model", o.contact_model,
               "Contact model by name, in place of the machine file's (docs/theory.md)");
  c.add_option("--can", o.can, "CAN interface of the machine's bus, such as can0; of two buses NAME=INTERFACE for each")
      .one_value_each();
  c.add_flag("--wait-for-can", o.wait_for_can,
             "With --can: wait for an interface that is not there or not up yet, instead of ending (for a service)");
  c.add_flag("--simulate", o.simulate, "Drive a simulated machine inside this program instead");
  c.add_option(
      "--scenario", o.scenario,
      "With --simulate: scenario that gives its start and surroundings, name or .toml file (default: free_motion)");
  c.add_option("--seed", o.seed, "With --simulate: random seed of the machine's true parameters (default: 1)")
      .check(cli::seed_error);
  c.add_option("--listen", o.link.address,
               "Address and port for the operator's side, such as 0.0.0.0:5683 or [::]:5683");
  pairing::add_link_options(c, o.link);
  pairing::add_dial_options(c, o.link.dial, secure::Role::kMachine);
  c.add_option("--observers", o.observers, "Paired ends that may observe at a time (default: 4)")
      .check(cli::count_within(0, 16));
  c.add_option(
      "--audit", o.audit,
      "Folder of the audit trail (knuckle audit; default: audit beside the keys; without one with --insecure)");
  c.add_option("--candump", o.candump, "Write every CAN frame in candump log format (- = standard output)");
  o.run.add(c, "Write sensors, commands and estimates, a row each step; `knuckle identify` reads it",
            "Write counters and events as JSON (described in docs/programs.md)");
  recordings::add_log_options(c, o.log);
  add_camera_options(c, o.cameras);
}

/// On a CAN interface, or simulated: one of the two, and nothing that only the other takes.
void check_bus(const Options& o) {
  if (o.simulate && !o.can.empty())
    cli::refuse_option("--can", bringup::can_text(o.can), "give --can or --simulate, not both");
  if (o.simulate && o.wait_for_can) cli::refuse_option("--wait-for-can", "", "only goes with --can");
  if (o.simulate) return;
  if (o.can.empty()) cli::refuse_option("slave", "", "needs --can, or --simulate");
  if (o.machine.empty()) cli::refuse_option("--machine", "", "is required with --can");
  if (!o.scenario.empty()) cli::refuse_option("--scenario", o.scenario, "only goes with --simulate");
  if (o.seed) cli::refuse_option("--seed", std::to_string(*o.seed), "only goes with --simulate");
}

void check(const Options& o) {
  check_bus(o);
  if (!o.contact_model.empty() && !contact_model_named(o.contact_model))
    cli::refuse_option("--contact-model", o.contact_model, kContactModelChoice);
  recordings::check_log(o.log);
  o.run.check();
  if (o.observers && o.link.insecure > 0)
    cli::refuse_option("--observers", std::to_string(*o.observers), "goes with a paired link, not with --insecure");
  cli::Places places;
  places.configuration("--machine", o.machine);
  places.configuration("--scenario", o.scenario);
  places.output("--candump", o.candump);
  o.run.take(places);
}

/// What is simulated of the machine, if it is.
struct Simulation {
  session::Scenario scenario;
  std::uint64_t seed = 1;
  sim::MachineTruth truth;
};

struct Setup {
  std::string file;            ///< Of the machine.
  MachineDescription machine;  ///< As calibrated.
  std::optional<Simulation> simulation;
};

Setup set_up(const Options& o) {
  const std::string file = find_config("machine", o.machine.empty() ? "solar015" : o.machine);
  MachineDescription read = load_machine(file);
  if (!o.contact_model.empty()) read = with_contact_model(read, o.contact_model);
  Setup setup{file, calibrated(read), {}};
  if (!o.simulate) {
    slave::refuse_unidentified(read);
    return setup;
  }
  const std::uint64_t seed = o.seed.value_or(1);
  setup.simulation = {
      session::load_scenario(find_config("scenario", o.scenario.empty() ? "free_motion" : o.scenario), read), seed,
      sim::sample_truth(read, seed)};
  session::refuse_faults(setup.simulation->scenario);
  return setup;
}

/// The machine's bus: an interface of this computer, or one in this program with a simulated machine in a thread of its
/// own.
class MachineBus {
 public:
  /// @param interfaces nullptr: the machine is simulated. @param cameras of the simulated machine; outlive this.
  MachineBus(std::unique_ptr<bringup::OpenInterfaces> interfaces, const Setup& setup, const SlaveCameras& cameras)
      : interfaces_(std::move(interfaces)) {
    if (interfaces_) return;
    const Simulation& simulation = *setup.simulation;
    machine_.emplace(simulation.truth, simulation.scenario.world, simulation.scenario.start_rad, simulation.seed);
    const RealtimeClock clock;
    thread_.emplace(RealtimeOptions{.name = "machine",
                                    .period = kTick,
                                    .phase = sim::ThreadedMachine::kPhase,
                                    .fifo_priority = fifo_priority::kMachine},
                    clock, [this, &cameras, zero = video::now() - (clock.now() - Time{})](Time now) {
                      machine_->step(now);
                      cameras.show(session::sight_of(machine_->plant(), zero + (now - Time{})));
                      count(machine_->plant().events);
                    });
  }
  MachineBus(const MachineBus&) = delete;
  MachineBus& operator=(const MachineBus&) = delete;

  [[nodiscard]] CanBus& bus() noexcept { return interfaces_ ? interfaces_->bus() : machine_->controller(); }
  /// nullptr where the machine is simulated, and the other way round.
  [[nodiscard]] const bringup::OpenInterfaces* interfaces() const noexcept { return interfaces_.get(); }
  [[nodiscard]] RealtimeThread* machine_thread() noexcept { return thread_ ? &*thread_ : nullptr; }
  /// What has happened in the simulated world: names of events and how often. After the thread has ended.
  [[nodiscard]] Json happened() const {
    Json json = Json::object();
    for (std::size_t i = 0; i < happened_.size(); ++i)
      if (happened_[i] > 0) json[name(static_cast<sim::WorldEventKind>(i))] = happened_[i];
    return json;
  }

 private:
  void count(const sim::WorldEventRing& events) noexcept {
    for (; counted_ < events.count; ++counted_) ++happened_[static_cast<std::size_t>(events.at(counted_).kind)];
  }

  static constexpr std::size_t kKinds = static_cast<std::size_t>(sim::WorldEventKind::kWeightOff) + 1;
  std::array<std::uint64_t, kKinds> happened_{};
  std::uint64_t counted_ = 0;
  std::unique_ptr<bringup::OpenInterfaces> interfaces_;
  std::optional<sim::ThreadedMachine> machine_;
  std::optional<RealtimeThread> thread_;
};

/// Before the loop's first frame. @throws InputError where there is another controller.
void refuse_other_controller(CanBus& bus, const BusDescription& description, const std::string& name) {
  const RealtimeClock clock;
  BusAccess access(name, {std::shared_ptr<void>(), &bus}, [&clock](Time due) {
    clock.sleep_until(due);
    return clock.now();
  });
  slave::refuse_other_controller(description, access);
}

Json nodes_json(const SlaveOutcome& outcome, const BusDescription& bus) {
  Json failures = Json::array(), emergencies = Json::array();
  for (const SetupFailureEvent& event : outcome.setup_failures) {
    failures.push_back(
        {{"at_s", to_seconds(event.at)}, {"node", event.failure.node}, {"text", slave::text(event.failure, bus)}});
  }
  for (const auto& [first, times, last_at] : outcome.emergencies) {
    emergencies.push_back({{"at_s", to_seconds(first.at)},
                           {"node", first.node},
                           {"code", first.emergency.code},
                           {"text", slave::text(first, bus)},
                           {"times", times},
                           {"last_at_s", to_seconds(last_at)}});
  }
  return {{"setup_failures", std::move(failures)}, {"emergencies", std::move(emergencies)}};
}

Json simulation_json(const std::optional<Simulation>& simulation) {
  if (!simulation) return nullptr;
  return {{"scenario", simulation->scenario.name}, {"seed", simulation->seed}};
}

Json result_json(const Options& o, const Setup& setup, const SlaveOutcome& outcome) {
  const BusDescription& bus = setup.machine.bus;
  Json json{{"machine", o.machine.empty() ? setup.machine.name : o.machine},
            {"can", o.can.empty() ? Json() : Json(bringup::can_text(o.can))},
            {"simulated", simulation_json(setup.simulation)},
            {"listen", o.link.address.empty() ? Json() : Json(o.link.address)}};
  json["modes"] = Json::array();
  json["faults"] = Json::array();
  for (const ModeEvent& event : outcome.events) {
    json["modes"].push_back(
        {{"mode", name(event.mode)}, {"at_s", to_seconds(event.at)}, {"blocking", reason_json(event.blocking, bus)}});
  }
  for (const ModeEvent& event : outcome.faults) {
    Json fault = reason_json(event.fault, bus);
    fault["at_s"] = to_seconds(event.at);
    json["faults"].push_back(std::move(fault));
  }
  json.update(nodes_json(outcome, bus));
  json["stop"] = {
      {"commanded", outcome.commanded}, {"confirmed", outcome.stop_confirmed()}, {"unconfirmed", outcome.unconfirmed}};
  json["readings"] = readings_json(outcome.readings);
  json["malformed_datagrams"] = outcome.malformed_datagrams;
  json["realtime"] = {{"slave", loop_json(outcome.loop)}};
  return json;
}

/// Simulated and real must not be confused.
std::string machine_note(const Options& o, const Setup& setup, const std::string& where) {
  const std::string listening = o.link.address.empty() ? "" : ", listening on " + where;
  if (!setup.simulation) return "machine " + setup.machine.name + " on " + bringup::can_text(o.can) + listening;
  return "SIMULATED machine " + setup.machine.name + " (scenario " + setup.simulation->scenario.name + ", seed " +
         std::to_string(setup.simulation->seed) + "), nothing real moves" + listening;
}

recording::Head head_of(const Options& o, const Setup& setup, const LinkStart& start) {
  recording::Head head;
  head.program =
      "knuckle slave --machine " + setup.file + (o.can.empty() ? " --simulate" : "") + bringup::can_arguments(o.can);
  head.version = cli::program_version();
  head.started_unix_ns = static_cast<std::int64_t>(1e9 * unix_time_s());
  head.simulated = setup.simulation.has_value();
  head.has_machine = true;
  head.machine_start = start;
  head.machine_file = setup.machine.text;
  if (setup.simulation) head.scenario_file = setup.simulation->scenario.text;
  return head;
}

/// As messages and the candump log name them.
std::array<std::string, 2> interface_names(const Options& o, const Setup& setup) {
  if (setup.simulation) return {kSimulatedBus, std::string(kSimulatedBus) + "2"};
  const std::vector<std::string> names = bringup::can_interfaces(o.can, setup.machine.bus);
  return {names.front(), names.back()};
}

/// Empty: none is written.
std::string audit_folder(const Options& o) {
  if (!o.audit.empty() || o.link.insecure > 0) return o.audit;
  return pairing::KeyFolder(o.link.keys).path() + "/audit";
}

/// nullptr where somebody ended the waiting for them.
std::unique_ptr<bringup::OpenInterfaces> open_interfaces(const Options& o, const MachineDescription& machine,
                                                         const cli::InterruptGuard& interrupt,
                                                         ProgramConsole& console) {
  const std::vector<std::string> names = bringup::can_interfaces(o.can, machine.bus);
  std::vector<std::unique_ptr<SocketCanBus>> opened;
  for (std::size_t on = 0; on < names.size(); ++on) {
    const std::vector<CanFilter> hear = slave::heard_by_controller(machine.bus.alone(on));
    opened.push_back(!o.wait_for_can ? std::make_unique<SocketCanBus>(names[on], hear)
                                     : open_when_up(
                                           names[on], hear, [&console](const std::string& what) { console.note(what); },
                                           [&interrupt] { return !interrupt.pending(); }));
    if (!opened.back()) return nullptr;
  }
  return std::make_unique<bringup::OpenInterfaces>(std::move(opened));
}

/// Of two buses by their names.
Json counters_json(const bringup::OpenInterfaces& interfaces, const BusDescription& bus) {
  if (!bus.second) return programs::counters_json(interfaces.each().front()->counters());
  Json json = Json::object();
  for (std::size_t on = 0; on < bus.lines(); ++on)
    json[bus.line(on).name] = programs::counters_json(interfaces.each()[on]->counters());
  return json;
}

int run(const Options& o, const DrawCamera& draw) {
  check(o);
  const cli::InterruptGuard interrupt;
  const Setup setup = set_up(o);
  const std::vector<video::SenderSetup> camera_setups =
      check_cameras(o.cameras, o.link.insecure, o.link.address, setup.simulation ? &setup.machine : nullptr);
  AskedOutput candump("--candump", o.candump);
  ProgramFrame program("knuckle slave", o.run, interrupt);
  ProgramConsole& console = program.console;
  program.run.outputs.insert(program.run.outputs.begin(), &candump);
  std::unique_ptr<bringup::OpenInterfaces> interfaces;
  if (!setup.simulation) {
    interfaces = open_interfaces(o, setup.machine, interrupt, console);
    if (!interfaces) {
      Json waited = result_json(o, setup, {});
      waited["path"] = waited["recording"] = nullptr;
      program.finish(kSchema, waited, 0, 0);
      return 0;
    }
  }
  SlaveCameras cameras(camera_setups, setup.machine,
                       setup.simulation ? setup.simulation->scenario.world : sim::WorldDescription{}, draw);
  MachineBus machine(std::move(interfaces), setup, cameras);
  refuse_other_controller(machine.bus(), setup.machine.bus,
                          setup.simulation ? kSimulatedBus : bringup::can_text(o.can));
  pairing::LinkOptions link_options = o.link;
  link_options.observers = o.observers.value_or(link_options.observers);
  pairing::ChosenLink link = pairing::ChosenLink::listen(link_options);

  std::optional<SlaveAudit> audit;
  if (const std::string folder = audit_folder(o); !folder.empty()) audit.emplace(folder, setup.machine.bus);

  const LinkStart start = random_start();
  recordings::ProgramLog log(o.log, !setup.simulation, head_of(o, setup, start), setup.machine);
  log.begin();
  console.notes(link.notes());
  console.notes(machine_notes(setup.machine));
  console.notes(log.notes());
  if (audit && !audit->damage().empty()) console.note(audit->damage());
  console.note(machine_note(o, setup, link.where()));
  const std::array<std::string, 2> names = interface_names(o, setup);
  SlaveRecords records{candump.stream(),     names[0],       names[1],
                       program.csv.stream(), log.recorder(), setup.simulation.has_value()};
  records.on_link = [&cameras](Time now, Time heard_at, Duration round_trip, bool silent) {
    cameras.follow_link(now, heard_at, round_trip, silent);
  };
  pairing::ChosenLink::Watch watch;
  if (audit) {
    audit->started(setup.file, o.can.empty() ? kSimulatedBus : bringup::can_text(o.can),
                   o.link.address.empty() ? "" : link.where(), link.notes());
    records.on_mode = [&audit](const ModeEvent& event) { audit->mode(event); };
    records.on_assist = [&audit](const AssistSettings& assist) { audit->assist(assist); };
    watch.on_event = [&audit](const secure::LinkEvent& event) { audit->link(event); };
    watch.on_changed_pairings = [&audit](const std::string& what) { audit->pairings_changed(what); };
    watch.on_lost = [&audit](std::uint64_t count) { audit->link_events_lost(count); };
  }
  program.run.news = [&] {
    if (std::optional<secure::VideoSecret> secret; link.take(secret)) cameras.seal_with(secret);
    std::vector<cli::News> news = link.news(audit ? &watch : nullptr);
    if (std::string refused = audit ? audit->news() : ""; !refused.empty()) news.push_back({refused, "audit trail"});
    for (cli::News& recorded : log.news()) news.push_back(std::move(recorded));
    for (cli::News& seen : cameras.news()) news.push_back(std::move(seen));
    for (std::size_t on = 0; machine.interfaces() != nullptr && on < o.can.size(); ++on)
      if (machine.interfaces()->each()[on]->find_again())
        news.push_back({"CAN interface " + names[on] + " is there again, and used again", "interface"});
    return news;
  };
  const SlaveOutcome outcome = run_slave(setup.machine, machine.bus(), link.link(), start, program.start(), records);
  link.close();
  log.close();
  for (const cli::News& news : program.run.news()) console.note(news.what);
  if (audit) audit->ended(outcome.stop_confirmed());

  Json result = result_json(o, setup, outcome);
  result["path"] = path_json(link, program.started());
  result["recording"] = log.json();
  if (const bringup::OpenInterfaces* interfaces_used = machine.interfaces()) {
    console.notes(interfaces_used->diagnoses());
    result["can_counters"] = counters_json(*interfaces_used, setup.machine.bus);
  } else {
    machine.machine_thread()->stop();
    result["simulated"]["happened"] = machine.happened();
    result["realtime"]["machine"] = loop_json(machine.machine_thread()->report());
  }
  program.finish(kSchema, result, outcome.ran_s, outcome.records_lost);
  return 0;
}

}  // namespace

cli::Command slave_entry(DrawCamera draw) {
  return cli::command<Options>(
      "slave", "Machine's side: drive a machine on a CAN interface for an operator's side over the link", add_options,
      [draw = std::move(draw)](const Options& o) { return run(o, draw); });
}

}  // namespace knuckle::programs
