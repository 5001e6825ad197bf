#include "app/programs/slave_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bitset>
#include <memory>
#include <variant>

#include "app/programs/service_watch.h"
#include "app/recordings/state_table.h"
#include "core/loop_table.h"
#include "core/mailbox.h"
#include "core/ring.h"
#include "machine/bus_frames.h"
#include "machine/reason_text.h"
#include "recording/sides.h"
#include "slave/loss_policy.h"
#include "slave/orderly_stop.h"
#include "slave/slave_state.h"

namespace knuckle::programs {
namespace {

constexpr Duration kReadsApart = 10s;  // reads with less between them are one event

struct SlaveStatus {
  Mode mode = Mode::kOff;
  Reason blocking, fault;
  Time heard_at = kNever;  ///< Newest message of the operator's side.
  Duration round_trip{};
  bool silent = false;  ///< Nothing new for longer than the limit.
  AssistSettings assist;
};

/// What an event says, without its measured values.
std::string kind_of(const ModeEvent& event) {
  const Reason& reason = event.fault ? event.fault : event.blocking;
  return std::string(event.home_on_two ? "home " : "") + name(event.mode) + (event.fault ? " fault " : " ") +
         name(reason.code) + " " + std::to_string(reason.subject);
}
std::string kind_of(const SetupFailureEvent& event) {
  const canopen::Object& object = event.failure.step.object;
  return "set-up " + std::to_string(event.failure.node) + " " + std::to_string(object.index) + " " +
         std::to_string(object.subindex);
}
/// Somebody else reads a node's objects over SDO.
struct ForeignRead {
  Time at{};
  std::uint8_t node = 0;
};
std::string kind_of(const ForeignRead& read) {
  return "foreign read " + std::to_string(read.node);
}
std::string kind_of(const slave::J1939News& news) {
  return fmt::format("j1939 {} {} {:02X} {:02X}", static_cast<int>(news.what), news.broadcast, news.address,
                     news.other);
}
/// All nodes work for the first time.
struct NodesUp {
  Time at{};
  std::bitset<128> other_device;  ///< Node ids: not the device whose guard was proved.
};
std::string kind_of(const slave::EmergencyRecord& record) {
  return "emergency " + std::to_string(record.node) + " " + std::to_string(record.emergency.code);
}
/// What the loop's thread tells.
using SlaveNews =
    std::variant<ModeEvent, SetupFailureEvent, slave::EmergencyRecord, ForeignRead, slave::J1939News, NodesUp>;

/// All that the loop's thread works on, and what crosses to the thread that tends it.
class SlaveRunner {
 public:
  /// @param health of the loop's thread.
  SlaveRunner(const MachineDescription& machine, CanBus& bus, Link& link, const LinkStart& start,
              const SlaveRecords& records, Mailbox<LoopHealth>& health)
      : machine_(machine), side_(machine, bus, link, start), stop_(machine, side_.can), rows_(records.csv) {
    side_.report_status(machine, records.simulated, &health);
    if (records.candump != nullptr) side_.can.keep_copies();
    if (records.recorder != nullptr) side_.record_to(*records.recorder);
  }

  // The loop's thread.
  void step(Time now) noexcept;

  // The tending thread.
  void ask_to_stop() noexcept { stop_asked_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] std::uint64_t steps() const noexcept { return steps_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool stopped() const noexcept { return stopped_.load(std::memory_order_acquire); }
  bool next(SlaveNews& news) noexcept {
    if (news_.pop(news)) return true;
    slave::EmergencyRecord emergency;
    if (!emergencies_.pop(emergency)) return false;
    news = emergency;
    return true;
  }
  [[nodiscard]] const MachineDescription& machine() const noexcept { return machine_; }
  [[nodiscard]] const BusDescription& bus() const noexcept { return machine_.bus; }
  [[nodiscard]] const SlaveStatus& status() noexcept {
    status_.take(shown_);
    return shown_;
  }
  void write(const SlaveRecords& records);

  // After the loop has ended.
  void hand_over(SlaveOutcome& outcome) const;

 private:
  void observe(Time now) noexcept;
  void observe_nodes(Time now) noexcept;
  void observe_reads(Time now) noexcept;
  void step_stop(Time now) noexcept;

  const MachineDescription& machine_;
  recording::MachineSide side_;
  slave::OrderlyStop stop_;
  SlaveMessage farewell_;
  bool said_off_ = false;
  ModeEvent last_;
  bool setup_failed_ = false, were_up_ = false;
  std::uint64_t emergencies_seen_ = 0, emergencies_lost_ = 0;
  std::uint64_t reads_seen_ = 0;
  Time read_at_ = kNever;
  std::uint64_t j1939_seen_ = 0;
  Ring<SlaveNews, 512> news_;
  Ring<slave::EmergencyRecord, 1024> emergencies_;  // of their own: a node that floods keeps no fault out
  RowTable<slave::SlaveState> rows_;
  Mailbox<SlaveStatus> status_;
  SlaveStatus shown_;  // the tending thread's
  std::atomic<bool> stop_asked_{false}, stopped_{false};
  std::atomic<std::uint64_t> steps_{0};
};

void SlaveRunner::step(Time now) noexcept {
  steps_.fetch_add(1, std::memory_order_relaxed);
  if (stop_asked_.load(std::memory_order_relaxed)) return step_stop(now);
  side_.step(now);
  observe(now);
  observe_nodes(now);
  observe_reads(now);
  for (; j1939_seen_ < side_.slave.j1939().news_count(); ++j1939_seen_)
    news_.push(side_.slave.j1939().news(j1939_seen_));
}

void SlaveRunner::observe(Time now) noexcept {
  const ModeEvent event{now, side_.slave.mode(), side_.slave.blocking(), side_.slave.fault(),
                        side_.slave.home().chosen()};
  const bool chosen = event.home_on_two != last_.home_on_two;
  if (event.mode != last_.mode || !same_cause(event.fault, last_.fault) || chosen) news_.push(event);
  last_ = event;
  status_.put({event.mode, event.blocking, event.fault, side_.slave.operator_input().message_at(),
               side_.slave.operator_input().round_trip(),
               now - side_.slave.operator_input().message_at() > slave::kLossLimits.neutral,
               side_.slave.operator_input().message().assist});
  if (side_.slave.sensors().measurement() && rows_.due()) rows_.push(slave::state_of(now, side_.slave));
}

void SlaveRunner::observe_nodes(Time now) noexcept {
  const slave::SetupFailure& failure = side_.slave.client().setup_failure();
  const bool failed = failure.what != slave::SetupFailure::What::kNone;
  if (failed && !setup_failed_) news_.push(SetupFailureEvent{now, failure});
  setup_failed_ = failed;
  if (!were_up_ && side_.slave.client().operational()) {
    NodesUp up{now, {}};
    for (const NodeDescription& node : machine_.bus.nodes)
      up.other_device[node.id] = !side_.slave.client().same_device(node.id);
    were_up_ = news_.push(up);
  }
  const slave::EmergencyLog& log = side_.slave.client().emergencies();
  const std::uint64_t fresh = log.count() - emergencies_seen_;
  emergencies_seen_ = log.count();
  for (auto age = static_cast<std::size_t>(std::min<std::uint64_t>(fresh, log.kept())); age > 0; --age) {
    emergencies_.push(log.newest(age - 1));
  }
  if (fresh > log.kept()) emergencies_lost_ += fresh - log.kept();
}

void SlaveRunner::observe_reads(Time now) noexcept {
  const slave::BusWatch& watch = side_.slave.client().watch();
  if (watch.foreign_reads() == reads_seen_) return;
  reads_seen_ = watch.foreign_reads();
  if (now - read_at_ > kReadsApart) news_.push(ForeignRead{now, watch.last_read_node()});
  read_at_ = now;
}

/// Every step reports to the operator that the machine is off: a single datagram may be lost.
void SlaveRunner::step_stop(Time now) noexcept {
  if (stopped()) return;
  side_.can.stamp(now);
  const bool commanded = side_.slave.client().commanded();
  if (!said_off_) {
    said_off_ = true;
    stop_.go_on_from(side_.slave.client().command_frames());
    farewell_ = side_.slave.message(now);
    farewell_.mode = Mode::kOff;
    farewell_.blocking = farewell_.fault = {};
    news_.push(ModeEvent{now, Mode::kOff, {}, {}});
    status_.put({});
  }
  if (commanded) stop_.step(now, side_.slave.j1939().may_command());
  farewell_.stamp = side_.slave.operator_input().session().stamp(farewell_.stamp.sequence + 1, now);
  side_.link.send(encode(farewell_).view());
  side_.tap.end_step(now, ReasonCode::kNone);
  if (!commanded || stop_.done()) stopped_.store(true, std::memory_order_release);
}

void SlaveRunner::write(const SlaveRecords& records) {
  if (records.candump != nullptr) side_.can.write(*records.candump, records.interface, records.second_interface);
  rows_.write();
}

void SlaveRunner::hand_over(SlaveOutcome& outcome) const {
  outcome.malformed_datagrams = side_.slave.operator_input().malformed();
  outcome.records_lost +=
      side_.can.lost() + rows_.lost() + news_.dropped() + emergencies_.dropped() + emergencies_lost_;
  outcome.readings = side_.slave.sensors().readings(last_.at);
  outcome.commanded = side_.slave.client().commanded();
  if (!outcome.commanded) return;
  const BusDescription& bus = machine_.bus;
  outcome.by_frames = bus.by_frames();
  if (const BroadcastFrame* const sent = bus.broadcast(NodeRole::kEnable, kPilotOnIndex).frame;
      sent != nullptr && stop_.unconfirmed_pilot())
    outcome.unconfirmed.emplace_back(sent->name);
  const auto valves = stop_.unconfirmed_valves();
  for (std::size_t joint = 0; outcome.by_frames && joint < kJoints; ++joint)
    if (valves[joint]) outcome.unconfirmed.push_back(std::string("pilot pressures of ") + kJointNames[joint]);
  for (const NodeDescription& node : machine_.bus.nodes) {
    const bool valve = node.role == NodeRole::kValve &&
                       std::any_of(node.channels.begin(), node.channels.end(), [&](const NodeChannel& axis) {
                         return valves[static_cast<std::size_t>(axis.info().index)];
                       });
    const bool pilot = node.role == NodeRole::kEnable && stop_.unconfirmed_pilot();
    if (valve || pilot) outcome.unconfirmed.push_back(node.name);
  }
}

std::string stop_text(const SlaveOutcome& outcome) {
  if (!outcome.commanded) return "stopped: nothing was commanded, so nothing was sent";
  if (outcome.unconfirmed.empty() && outcome.by_frames)
    return "stopped: neutral was told until every valve had time to close, and no command frame is sent any more";
  if (outcome.unconfirmed.empty()) return "stopped: valves disabled, pilot pressure off";
  return fmt::format("stopped, but not confirmed by {}: left to their own watchdogs",
                     fmt::join(outcome.unconfirmed, ", "));
}

/// Events as they come, what blocks for long, and the status line.
class Teller {
 public:
  Teller(ProgramConsole& console, SlaveOutcome& outcome, const SlaveRecords& records)
      : console_(console), outcome_(outcome), records_(records) {}

  void tell(Time now, SlaveRunner& runner) {
    SlaveNews news;
    while (runner.next(news)) std::visit([&](const auto& one) { tell(one, runner.machine()); }, news);
    const SlaveStatus& status = runner.status();
    tell_assist(status);
    if (status.heard_at != kNever && records_.on_link)
      records_.on_link(now, status.heard_at, status.round_trip, status.silent);
    if (standing_.is_news(now, status.blocking)) {
      const ModeEvent standing{now, status.mode, status.blocking, {}};
      say(now, event_text(standing, runner.bus()), "standing " + kind_of(standing), Severity::kInfo);
    }
    console_.status(now, status_parts(status, runner.bus()));
  }
  /// How things stand: "engaged", "fault link_lost: ...".
  [[nodiscard]] const std::string& mode_text() const noexcept { return mode_text_; }
  /// After the run.
  void hand_over() {
    outcome_.events = events_.kept();
    outcome_.faults = faults_.kept();
    outcome_.setup_failures = failures_.kept();
    outcome_.records_lost += events_.left_out() + failures_.left_out();  // what faults_ left out is among the events
  }

 private:
  using Severity = recording::Severity;
  /// On the console and in the recording.
  void say(Time at, const std::string& what, const std::string& kind, Severity severity) {
    console_.event(at, what, kind);
    if (records_.recorder != nullptr) records_.recorder->event({at, severity, kind, what});
  }
  void tell_assist(const SlaveStatus& status) {
    const bool same =
        status.assist.force_limit_N == assist_.force_limit_N && status.assist.stop_on_object == assist_.stop_on_object;
    if (status.heard_at == kNever || same) return;
    assist_ = status.assist;
    if (records_.on_assist) records_.on_assist(assist_);
  }
  void tell(const ModeEvent& event, const MachineDescription& machine) {
    const std::string kind = kind_of(event);
    events_.add(event, kind);
    if (event.fault && !same_cause(event.fault, standing_fault_)) faults_.add(event, kind);
    standing_fault_ = event.fault;
    mode_text_ = event_text(event, machine.bus);
    say(event.at, mode_text_, kind, event.fault ? Severity::kError : Severity::kInfo);
    if (records_.on_mode) records_.on_mode(event);
    standing_.told(event.fault ? event.fault : event.blocking);
  }
  void tell(const NodesUp& up, const MachineDescription& machine) {
    for (const std::string& line :
         slave::guard_lines(machine.bus, [&up](std::uint8_t id) { return !up.other_device[id]; }))
      say(up.at, "guards: " + line, "guards " + line, Severity::kWarning);
    for (const NodeDescription& node : machine.bus.nodes)
      if (const std::string lacks = missing_status_text(node, machine); !lacks.empty())
        say(up.at, "sensors: " + node.name + " " + lacks, "status " + node.name, Severity::kInfo);
  }
  void tell(const SetupFailureEvent& failed, const MachineDescription& machine) {
    failures_.add(failed, kind_of(failed));
    say(failed.at, "set-up: " + slave::text(failed.failure, machine.bus), kind_of(failed), Severity::kWarning);
  }
  void tell(const slave::EmergencyRecord& record, const MachineDescription& machine) {
    if (outcome_.add(record))
      say(record.at, "emergency: " + slave::text(record, machine.bus), kind_of(record), Severity::kWarning);
  }
  void tell(const slave::J1939News& news, const MachineDescription& machine) {
    say(news.at, "J1939: " + slave::text(news, machine.bus), kind_of(news), Severity::kWarning);
  }
  void tell(const ForeignRead& read, const MachineDescription& machine) {
    say(read.at,
        fmt::format(
            "another program reads objects of the nodes over SDO, just now of {}: knuckle doctor, or a service tool",
            node_text(read.node, machine.bus)),
        kind_of(read), Severity::kInfo);
  }
  static std::vector<std::string> status_parts(const SlaveStatus& status, const BusDescription& bus) {
    std::vector<std::string> parts{name(status.mode)};
    if (status.blocking) parts.push_back(text(status.blocking, bus));
    if (status.heard_at == kNever) {
      parts.emplace_back("operator: no packets received yet");
    } else if (status.round_trip < 10s) {
      parts.push_back(fmt::format("round trip {:.0f} ms", 1e3 * to_seconds(status.round_trip)));
    }
    return parts;
  }

  ProgramConsole& console_;
  SlaveOutcome& outcome_;
  const SlaveRecords& records_;
  AssistSettings assist_;
  RunEvents<ModeEvent> events_, faults_;
  RunEvents<SetupFailureEvent> failures_;
  StandingReason standing_;
  Reason standing_fault_;
  std::string mode_text_;
};

}  // namespace

std::string event_text(const ModeEvent& event, const BusDescription& bus) {
  const std::string mode = std::string(name(event.mode)) + (event.home_on_two ? ", home on two" : "");
  if (event.fault) return mode + " " + text_with_code(event.fault, bus);
  return event.blocking ? mode + ", " + text_with_code(event.blocking, bus) : mode;
}

bool SlaveOutcome::add(const slave::EmergencyRecord& record) {
  const auto known = std::find_if(emergencies.begin(), emergencies.end(), [&record](const Emergency& e) {
    return e.first.node == record.node && e.first.emergency.code == record.emergency.code;
  });
  if (known != emergencies.end()) {
    ++known->times;
    known->last_at = record.at;
    return false;
  }
  if (emergencies.size() == kMostEmergencies) {
    ++records_lost;
    return false;
  }
  emergencies.push_back({record, 1, record.at});
  return true;
}

SlaveOutcome run_slave(const MachineDescription& machine, CanBus& bus, Link& link, const LinkStart& start,
                       const ProgramRun& run, const SlaveRecords& records) {
  Mailbox<LoopHealth> health;
  const auto runner = std::make_unique<SlaveRunner>(machine, bus, link, start, records, health);
  SlaveOutcome outcome;
  Teller teller(run.console, outcome, records);
  ServiceWatch service;
  const LoopRun ran = run_loop(run, {.thread = {.name = "slave",
                                                .period = from_seconds(1 / machine.bus.sync_Hz),
                                                .fifo_priority = fifo_priority::kSlave,
                                                .lock_memory = true,
                                                .health = &health},
                                     .step = [&runner](Time now) { runner->step(now); },
                                     .tend =
                                         [&](Time now) {
                                           teller.tell(now, *runner);
                                           runner->write(records);
                                           service.tell(now, runner->steps(), teller.mode_text());
                                         },
                                     .ask_to_stop =
                                         [&] {
                                           service.stopping();
                                           runner->ask_to_stop();
                                         },
                                     .stopped = [&runner] { return runner->stopped(); }});
  teller.hand_over();
  outcome.loop = ran.report;
  outcome.ran_s = to_seconds(ran.ended_at);
  runner->hand_over(outcome);
  run.console.event(ran.ended_at, stop_text(outcome));
  return outcome;
}

}  // namespace knuckle::programs
