#include "app/programs/master_program.h"

#include <fmt/format.h>

#include <memory>

#include "app/recordings/state_table.h"
#include "core/loop_table.h"
#include "core/mailbox.h"
#include "core/ring.h"
#include "machine/reason_text.h"
#include "master/master_state.h"

namespace knuckle::programs {
namespace {

constexpr int kStepsPerRow = 5;
constexpr Duration kSilence = 1s;
constexpr Duration kHomeAsked = master::MasterLoop::kHomeSteps * 1ms + 1s;  // by one line

/// What an event says, without its values and without what the far end may choose freely.
std::string kind_of(const MasterEvent& event) {
  if (event.about == MasterEvent::About::kDevice) return std::string("device ") + name(event.device.code);
  if (event.about == MasterEvent::About::kSameMachine) return std::string("other ") + name(event.other_machine.code);
  if (event.about == MasterEvent::About::kFelt) return std::string("felt ") + name(event.warning.code);
  if (!event.heard) return "not heard";
  return std::string(event.home_on_two ? "home " : "") + name(event.mode) + " " +
         name(event.fault ? event.fault.code : event.blocking.code);
}

struct MasterStatus {
  MasterEvent now;
  double round_trip_s = 0;
};

/// All that the loop's thread works on, and what crosses to the thread that tends it.
class MasterRunner {
 public:
  /// @param csv null: no table. @param recorder null: nothing is recorded.
  MasterRunner(const recording::OperatorSetup& setup, HidPort& port, Link& link, std::ostream* csv,
               recording::Recorder* recorder)
      : side_(setup, port, link), rows_(csv, kStepsPerRow) {
    if (recorder != nullptr) side_.record_to(*recorder);
    last_device_.device.code = ReasonCode::kCount;  // the device's state is reported at the start, too
  }

  // The loop's thread.
  void step(Time now) noexcept;

  // The tending thread.
  void ask_to_stop() noexcept { stop_asked_.store(true, std::memory_order_relaxed); }
  void ask_for_home() noexcept { home_asked_.store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool stopped() const noexcept { return stopped_.load(std::memory_order_acquire); }
  bool next(MasterEvent& event) noexcept { return events_.pop(event); }
  void write() { rows_.write(); }
  [[nodiscard]] const MasterStatus& status() noexcept {
    status_.take(shown_);
    return shown_;
  }

  // After the loop has ended.
  [[nodiscard]] const Histogram& round_trip() const noexcept { return round_trip_; }
  [[nodiscard]] const std::optional<MachineStatus>& machine_status() const noexcept {
    return side_.master.machine_status();
  }
  [[nodiscard]] MachineReadings readings() const noexcept {
    return side_.master.machine_readings().value_or(MachineReadings{});
  }
  [[nodiscard]] std::uint64_t lost() const noexcept { return events_.dropped() + rows_.lost(); }

 private:
  void observe(Time now) noexcept;

  recording::OperatorSide side_;
  MasterEvent last_machine_, last_device_, last_other_, last_felt_;
  Histogram round_trip_;
  Ring<MasterEvent, 256> events_;
  RowTable<master::MasterState> rows_;
  Mailbox<MasterStatus> status_;
  MasterStatus shown_;  // the tending thread's
  std::atomic<bool> stop_asked_{false}, stopped_{false}, home_asked_{false};
  Time home_asked_at_ = kNever;  // the loop's thread
};

void MasterRunner::step(Time now) noexcept {
  if (stop_asked_.load(std::memory_order_relaxed)) side_.master.let_go();
  // A line is as good as an act held: it is typed for nothing else.
  if (home_asked_.exchange(false, std::memory_order_relaxed)) home_asked_at_ = now;
  side_.master.set_home(now - home_asked_at_ < kHomeAsked);
  side_.step(now);
  if (side_.master.has_let_go()) stopped_.store(true, std::memory_order_release);
  observe(now);
  if (rows_.due()) rows_.push(master::state_of(now, side_.master));
}

void MasterRunner::observe(Time now) noexcept {
  MasterEvent event;
  event.at = now;
  event.device = side_.master.device().reason;
  const auto& told = side_.master.machine();
  event.heard = told && side_.master.silence_s() < to_seconds(kSilence);
  if (event.heard) {
    event.mode = told->mode;
    event.blocking = told->blocking;
    event.fault = told->fault;
    event.home_offered = told->home_offered;
    event.home_on_two = told->home_on_two;
    round_trip_.add(from_seconds(side_.master.round_trip_s()));
  }
  const bool machine_changed = event.heard != last_machine_.heard || event.mode != last_machine_.mode ||
                               event.home_on_two != last_machine_.home_on_two ||
                               !same_cause(event.fault, last_machine_.fault);
  if (machine_changed) {
    events_.push(event);
    last_machine_ = event;
  }
  if (!same_cause(event.device, last_device_.device)) {
    event.about = MasterEvent::About::kDevice;
    events_.push(event);
    last_device_ = event;
  }
  event.other_machine = side_.master.other_machine();
  event.here = side_.master.machine_name();
  if (side_.master.machine_status()) event.there = side_.master.machine_status()->machine;
  if (!same_cause(event.other_machine, last_other_.other_machine) || !(event.there == last_other_.there)) {
    event.about = MasterEvent::About::kSameMachine;
    if (event.other_machine || last_other_.other_machine) events_.push(event);
    last_other_ = event;
  }
  event.warning = side_.master.warning();
  if (!same_cause(event.warning, last_felt_.warning)) {
    event.about = MasterEvent::About::kFelt;
    const bool stopped = event.mode == Mode::kFault || event.mode == Mode::kEStop;  // then nothing is felt: no news
    if (event.warning || !stopped) events_.push(event);
    last_felt_ = event;
  }
  event.about = MasterEvent::About::kMachine;
  status_.put({event, side_.master.round_trip_s()});
}

/// Events as they come, what blocks or is wrong for long, and the status line.
class Teller {
 public:
  Teller(ProgramConsole& console, const BusDescription& bus, const std::function<std::string()>& device_problem,
         recording::Recorder* recorder)
      : console_(console), bus_(bus), recorder_(recorder), device_problem_(device_problem) {}

  void tell(Time now, MasterRunner& runner) {
    MasterEvent event;
    while (runner.next(event)) {
      events_.add(event, kind_of(event));
      say(event.at, event_text(event, bus_), kind_of(event));
      device_was_ready_ |= event.about == MasterEvent::About::kDevice && !event.device;
      machine_was_heard_ |= event.heard;
      if (event.about == MasterEvent::About::kMachine) standing_.told(event.fault ? event.fault : event.blocking);
    }
    const MasterStatus& status = runner.status();
    tell_standing(now, status.now);
    tell_problem(now);
    console_.status(now, status_parts(status));
  }
  /// After the run.
  void hand_over(MasterOutcome& outcome) const {
    outcome.events = events_.kept();
    outcome.device_was_ready = device_was_ready_;
    outcome.machine_was_heard = machine_was_heard_;
    outcome.records_lost += events_.left_out();
  }

 private:
  /// On the console and in the recording.
  void say(Time at, const std::string& what, const std::string& kind) {
    console_.event(at, what, kind);
    if (recorder_ != nullptr) recorder_->event({at, recording::Severity::kInfo, kind, what});
  }
  void tell_standing(Time now, const MasterEvent& event) {
    if (!standing_.is_news(now, event.blocking)) return;
    MasterEvent shown = event;
    shown.fault = {};
    say(now, event_text(shown, bus_), "standing " + kind_of(shown));
  }
  void tell_problem(Time now) {
    if (!device_problem_) return;
    const std::string problem = device_problem_();
    if (problem == problem_) return;
    problem_ = problem;
    if (!problem.empty()) say(now, problem, "device");
  }
  [[nodiscard]] std::vector<std::string> status_parts(const MasterStatus& status) const {
    std::vector<std::string> parts{status.now.heard ? "machine " + std::string(name(status.now.mode))
                                                    : "machine: no packets received"};
    for (const Reason& reason :
         {status.now.other_machine, status.now.blocking, status.now.device, status.now.warning}) {
      if (reason) parts.push_back(text(reason, bus_));
    }
    if (!status.now.heard) return parts;
    parts.push_back(fmt::format("round trip {:.0f} ms", 1e3 * status.round_trip_s));
    return parts;
  }

  ProgramConsole& console_;
  const BusDescription& bus_;
  recording::Recorder* recorder_;
  RunEvents<MasterEvent> events_;
  bool device_was_ready_ = false, machine_was_heard_ = false;
  const std::function<std::string()>& device_problem_;
  std::string problem_;
  StandingReason standing_;
};

std::string same_machine_text(const MasterEvent& event) {
  const std::string here(event.here.text()), there(event.there.text());
  if (!event.other_machine) return "machine is " + there + " on both sides";
  const std::string text = text_with_code(event.other_machine) + " (here " + here;
  return text + (event.other_machine.code == ReasonCode::kOtherMachine ? ", there " + there + ")" : ")");
}

}  // namespace

std::string event_text(const MasterEvent& event, const BusDescription& bus) {
  if (event.about == MasterEvent::About::kDevice)
    return event.device ? "device " + text_with_code(event.device) : "device is ready";
  if (event.about == MasterEvent::About::kSameMachine) return same_machine_text(event);
  if (event.about == MasterEvent::About::kFelt)
    return event.warning ? "felt force: " + text_with_code(event.warning) : "felt force is back in full";
  if (!event.heard) return "machine: no packets received";
  const std::string mode = std::string("machine ") + name(event.mode) + (event.home_on_two ? ", home on two" : "");
  if (event.fault) return mode + " " + text_with_code(event.fault, bus);
  return event.blocking ? mode + ", " + text_with_code(event.blocking, bus) : mode;
}

MasterOutcome run_master(const recording::OperatorSetup& setup, HidPort& port, Link& link, const ProgramRun& run,
                         const std::function<std::string()>& device_problem, std::ostream* csv,
                         recording::Recorder* recorder, HomeRequest* home) {
  const auto runner = std::make_unique<MasterRunner>(setup, port, link, csv, recorder);
  MasterOutcome outcome;
  Teller teller(run.console, setup.machine.bus, device_problem, recorder);
  const LoopRun ran = run_loop(
      run, {.thread = {.name = "master", .period = kTick, .fifo_priority = fifo_priority::kMaster, .lock_memory = true},
            .step = [&runner](Time now) { runner->step(now); },
            .tend =
                [&](Time now) {
                  teller.tell(now, *runner);
                  if (home != nullptr) {
                    home->offered = runner->status().now.home_offered;
                    if (home->asked.exchange(false)) runner->ask_for_home();
                  }
                  runner->write();
                },
            .ask_to_stop = [&runner] { runner->ask_to_stop(); },
            .stopped = [&runner] { return runner->stopped(); }});
  outcome.loop = ran.report;
  outcome.ran_s = to_seconds(ran.ended_at);
  outcome.round_trip = runner->round_trip();
  outcome.machine_status = runner->machine_status();
  outcome.readings = runner->readings();
  outcome.records_lost = runner->lost();
  teller.hand_over(outcome);
  run.console.event(ran.ended_at, "stopped: machine and device released");
  return outcome;
}

void Observer::tend(Time now) {
  (void)link_.send({});  // nothing is sent, but the link may say that somebody is here
  Datagram datagram;
  while (link_.receive(datagram)) {
    const auto message = decode_slave(datagram.view());
    if (!message) continue;
    ++messages_;
    if (newest_ && now - heard_at_ < kSilence && !newer(message->stamp.sequence, newest_->stamp.sequence)) continue;
    newest_ = message;
    heard_at_ = now;
  }
  tell(now);
}

void Observer::tell(Time now) {
  static const BusDescription kUnknown;  // its messages do not tell an observer which machine it is
  MasterEvent event;
  event.at = now;
  event.heard = newest_ && now - heard_at_ < kSilence;
  if (event.heard) {
    event.mode = newest_->mode;
    event.blocking = newest_->blocking;
    event.fault = newest_->fault;
  }
  if (event.heard != last_.heard || event.mode != last_.mode || !same_cause(event.fault, last_.fault)) {
    last_ = event;
    events_.add(event, kind_of(event));
    console_.event(now, event_text(event, kUnknown), kind_of(event));
  }
  console_.status(now, {event_text(event, kUnknown)});
}

ObserverOutcome Observer::outcome(double ran_s) const {
  return {events_.kept(), messages_, ran_s, events_.left_out()};
}

ObserverOutcome run_observer(Link& link, const ProgramRun& run) {
  Observer observer(link, run.console);
  const RealtimeClock clock;
  tend_until_over(run, clock, [&observer](Time now) { observer.tend(now); });
  return observer.outcome(to_seconds(clock.now()));
}

}  // namespace knuckle::programs
