// A session in real-time threads.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/session/loop_views.h"
#include "app/session/session.h"
#include "app/session/session_logs.h"
#include "core/error.h"
#include "core/loop_table.h"
#include "core/mailbox.h"
#include "core/realtime_thread.h"
#include "recording/sides.h"
#include "sim/machine_on_bus.h"
#include "transport/canopen.h"
#include "transport/thread_wires.h"
#include "transport/udp_link.h"

namespace knuckle::session {
namespace {

constexpr double kGrace_s = 1.0;  // until all threads have ended, at most

/// Largest of the values of the last slave period.
class RecentPeak {
 public:
  explicit RecentPeak(double sync_Hz)
      : values_(static_cast<std::size_t>(std::ceil(1 / (to_seconds(kTick) * sync_Hz)))) {}
  double step(double value) noexcept {
    values_[next_++ % values_.size()] = value;
    return *std::max_element(values_.begin(), values_.end());
  }

 private:
  std::vector<double> values_;
  std::size_t next_ = 0;
};

LoopTiming timing(const char* loop, const RealtimeReport& report) {
  return {loop, report.policy, percentiles_us(report.wake_lateness), percentiles_us(report.execution), report.overruns};
}

/// All that the four threads work on. Each member belongs to one of them; between them go only wires, mailboxes and
/// atomics. Vectors are reserved before they start and read after they ended.
class Loops {
 public:
  /// @param recorder null: nothing is recorded.
  Loops(const SessionSetup& setup, UdpLink& operator_end, UdpLink& machine_end, recording::Recorder* recorder);

  void step_hand(Time now) noexcept;
  void step_master(Time now) noexcept;
  void step_slave(Time now) noexcept;
  void step_machine(Time now) noexcept;

  [[nodiscard]] double done_fraction() const noexcept {
    return static_cast<double>(phase_) / static_cast<double>(setup_.scenario.phases.size());
  }
  [[nodiscard]] bool finished() const noexcept { return finished_; }
  /// After the threads have ended.
  [[nodiscard]] SessionOutcome hand_over(Time end) {
    return logs_.hand_over(setup_.machine, person_, end, [this](Time latched_at) {
      return Cause{latched_at, {}, first_frame_from(logs_.machine.frames, latched_at)};
    });
  }

 private:
  const SessionSetup& setup_;
  SessionLogs logs_{setup_, kGrace_s};  // each of its logs belongs to a thread; the record, to the slave's
  // wires and what crosses threads
  ThreadHid cable_;
  sim::ThreadedMachine machine_;
  Mailbox<MasterView> master_to_hand_, master_to_record_;
  Mailbox<HandView> hand_to_record_;
  Mailbox<sim::PlantState> plant_to_record_;
  std::atomic<int> breaks_{0}, phase_{0};
  std::atomic<bool> finished_{false};
  // hand
  sim::Operator person_;
  sim::HandAndDevice hand_;
  MasterView seen_;
  // master
  recording::OperatorSide near_;
  PlanarVector last_force_N_ = PlanarVector::Zero();
  RecentPeak slew_{setup_.machine.bus.sync_Hz};
  // slave
  recording::MachineSide far_;
  Kinematics kinematics_;
  MasterView master_seen_;
  HandView hand_seen_;
  sim::PlantState plant_seen_;
};

Loops::Loops(const SessionSetup& setup, UdpLink& operator_end, UdpLink& machine_end, recording::Recorder* recorder)
    : setup_(setup),
      machine_(setup.truth, setup.scenario.world, setup.scenario.start_rad, setup.seed),
      person_(operator_of(setup)),
      hand_(setup.device_truth(), setup.limb, cable_.device(), setup.seed, setup.scenario.hand_rad),
      near_(operator_setup(setup), cable_.host(), operator_end),
      far_(setup.machine, machine_.controller(), machine_end, setup.starts().machine_end),
      kinematics_(setup.machine) {
  if (recorder != nullptr) {
    near_.record_to(*recorder);
    far_.record_to(*recorder);
  }
  machine_.set_tap(
      {[](void* log, Time at, const CanFrame& f) { static_cast<MachineLog*>(log)->note(at, f); }, &logs_.machine});
}

void Loops::step_hand(Time now) noexcept {
  master_to_hand_.take(seen_);
  const sim::OperatorIntent intent =
      person_.step(now, person_view(seen_, setup_.scenario.start_rad, hand_.truth(), breaks_));
  hand_.step(now, intent);
  hand_to_record_.put(view_of(hand_, person_, intent, setup_.scenario.phases.size()));
  phase_ = person_.phase();
  finished_ = person_.finished();
}

void Loops::step_master(Time now) noexcept {
  near_.step(now);
  MasterView view = view_of(now, near_.master);
  view.slew_N_per_ms = slew_.step((view.state.sent_force_N - last_force_N_).norm());
  last_force_N_ = view.state.sent_force_N;
  master_to_hand_.put(view);
  master_to_record_.put(view);
  logs_.master.note(now, near_.master);
}

void Loops::step_slave(Time now) noexcept {
  far_.step(now);
  hand_to_record_.take(hand_seen_);
  master_to_record_.take(master_seen_);
  plant_to_record_.take(plant_seen_);
  logs_.note_faults(now, far_.slave, hand_seen_.intent.enable);
  logs_.note(sample_of(now, far_.slave, plant_seen_, hand_seen_, master_seen_, kinematics_));
  logs_.slave.note(now, far_.slave);
}

void Loops::step_machine(Time now) noexcept {
  machine_.step(now);
  const sim::PlantState& plant = machine_.plant();
  logs_.machine.note(plant.events);
  breaks_ = logs_.machine.breaks;
  plant_to_record_.put(plant);
}

/// Until the operator has finished and a little longer, or the scenario's time is over.
void wait_for_the_end(const RealtimeClock& clock, const Loops& loops, double longest_s,
                      const std::function<void(double)>& progress) {
  Time finished_at = Time::max();
  for (;;) {
    const Time now = clock.now();
    if (loops.finished() && finished_at == Time::max()) finished_at = now;
    if (to_seconds(now) >= longest_s) return;
    if (finished_at != Time::max() && to_seconds(now - finished_at) > kTail_s) return;
    if (progress) progress(std::max(loops.done_fraction(), to_seconds(now) / longest_s));
    clock.sleep_until(now + 250ms);
  }
}

}  // namespace

SessionOutcome run_realtime(const SessionSetup& setup, recording::Recorder* recorder,
                            const std::function<void(double)>& progress) {
  refuse_faults(setup.scenario, ", without --realtime");
  UdpLink machine_end = UdpLink::listen(setup.listen);
  UdpLink operator_end =
      UdpLink::connect(setup.connect.empty() ? "127.0.0.1:" + std::to_string(machine_end.port()) : setup.connect);
  Loops loops(setup, operator_end, machine_end, recorder);
  std::optional<recording::RecorderThread> recording;
  if (recorder != nullptr) recording.emplace(*recorder);
  std::vector<LoopTiming> timings;
  const RealtimeClock clock;
  {
    const Duration slave_period = from_seconds(1 / setup.machine.bus.sync_Hz);
    RealtimeThread machine({.name = "machine",
                            .period = kTick,
                            .phase = sim::ThreadedMachine::kPhase,
                            .fifo_priority = fifo_priority::kMachine},
                           clock, [&loops](Time now) { loops.step_machine(now); });
    RealtimeThread slave(
        {.name = "slave", .period = slave_period, .fifo_priority = fifo_priority::kSlave, .lock_memory = true}, clock,
        [&loops](Time now) { loops.step_slave(now); });
    RealtimeThread master({.name = "master", .period = kTick, .fifo_priority = fifo_priority::kMaster}, clock,
                          [&loops](Time now) { loops.step_master(now); });
    RealtimeThread hand({.name = "hand", .period = kTick, .fifo_priority = fifo_priority::kHand}, clock,
                        [&loops](Time now) { loops.step_hand(now); });
    wait_for_the_end(clock, loops, setup.scenario.duration_s, progress);
    for (RealtimeThread* thread : {&hand, &master, &slave, &machine}) thread->stop();
    timings = {timing("master", master.report()), timing("slave", slave.report()), timing("machine", machine.report()),
               timing("hand", hand.report())};
  }
  SessionOutcome outcome = loops.hand_over(clock.now());
  outcome.loops = std::move(timings);
  return outcome;
}

}  // namespace knuckle::session
