#include "app/session/session.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "app/session/fault_injection.h"
#include "app/session/loop_views.h"
#include "app/session/session_logs.h"
#include "app/session/session_sides.h"
#include "machine/bus_frames.h"
#include "machine/kinematics.h"
#include "recording/sides.h"

namespace knuckle::session {
namespace {

using sim::FaultKind;

constexpr Duration kDueToMending = 300ms;  // a fault that latches so soon after something was mended is due to it

}  // namespace

struct Session::Impl {
  explicit Impl(const SessionSetup& s);
  void step() noexcept;
  void sample(const sim::OperatorIntent& intent) noexcept;
  void note_slew() noexcept;
  Time last_good_input(const Injected& broken, Time latched_at) const;
  Cause cause_of(Time latched_at) const;

  SessionSetup setup;
  Kinematics kinematics;
  Time now{};
  SessionLogs logs;
  double felt_slew = 0;
  PlanarVector last_force_N = PlanarVector::Zero();
  Time finished_at = Time::max();

  sim::Operator person;
  HandSide hand;
  ImpairedLink network;
  FaultInjection faults;
  recording::OperatorSide near;
  SimulatedMachineSide far;
};

Session::Impl::Impl(const SessionSetup& s)
    : setup(s),
      kinematics(s.machine),
      logs(s),
      person(operator_of(s)),
      hand(s.device_truth(), s.limb, s.seed, s.scenario.hand_rad),
      network(s.to_machine, s.to_operator, s.seed),
      faults(s.scenario.faults, network, s.machine.bus),
      near(operator_setup(s), hand.cable.host(), faults.operator_end()),
      far(s.machine, s.truth, s.scenario, s.seed, faults.machine_end()) {
  far.simulated.set_tap(
      {[](void* log, Time at, const CanFrame& f) { static_cast<MachineLog*>(log)->note(at, f); }, &logs.machine});
}

void Session::Impl::step() noexcept {
  now += kTick;
  network.advance(now);
  const sim::OperatorIntent intent = person.step(
      now, person_view(view_of(now, near.master), setup.scenario.start_rad, hand.device.truth(), logs.machine.breaks));
  faults.step(now, person.phase(), person.in_phase(now), far, hand);
  hand.step(now, intent);
  const Time operator_now = now + faults.operator_clock();
  near.step(operator_now);
  note_slew();
  logs.master.note(now, near.master);
  far.step(now, [&] {
    if (faults.slave_runs()) {
      far.side.step(now);
      logs.slave.note(now, far.side.slave);
    }
    sample(intent);
  });
  logs.machine.note(far.simulated.plant().events);
  if (person.finished() && finished_at == Time::max()) finished_at = now;
}

/// How much the felt force changed in this millisecond, for the slew bound.
void Session::Impl::note_slew() noexcept {
  const PlanarVector force_N = hand.device.truth().felt_N;
  felt_slew = std::max(felt_slew, (force_N - last_force_N).norm());
  last_force_N = force_N;
}

void Session::Impl::sample(const sim::OperatorIntent& intent) noexcept {
  logs.note_faults(now, far.side.slave, intent.enable);
  const HandView held = view_of(hand.device, person, intent, setup.scenario.phases.size());
  MasterView asked = view_of(now, near.master);
  asked.slew_N_per_ms = std::exchange(felt_slew, 0.0);
  logs.note(sample_of(now, far.side.slave, far.simulated.plant(), held, asked, kinematics));
}

Time Session::Impl::last_good_input(const Injected& broken, Time latched_at) const {
  const BusDescription& wire = setup.machine.bus;
  // Of its frame with what it measures; a sensor may send others before it.
  const auto last_from = [&](const NodeDescription& node) {
    using Part = FrameField::Part;
    const Part part = node.role == NodeRole::kEnable ? Part::kStatus : Part::kValue;
    for (const BusFrame& frame : bus_frames(wire)) {
      const bool measures = std::any_of(frame.fields.begin(), frame.fields.end(),
                                        [part](const FrameField& field) { return field.part == part; });
      if (!frame.to_node && measures && wire.nodes[frame.node].id == node.id)
        return last_frame_before(logs.machine.frames, frame.id, broken.at).value_or(broken.at);
    }
    for (const BroadcastFrame& inputs : wire.broadcasts)
      if (inputs.module == node.id)
        return last_frame_before(logs.machine.frames, inputs.id, broken.at).value_or(broken.at);
    return broken.at;
  };
  // Of several axes that which stood first.
  const auto last_following_of = [&](const NodeDescription& valve) {
    std::optional<Time> first;
    for (const NodeChannel& axis : valve.channels) {
      const auto last = last_following(logs.machine.frames, setup.machine, axis.info().index, latched_at);
      if (last && (!first || *last < *first)) first = last;
    }
    return first;
  };
  const NodeDescription* const node = wire.find(static_cast<std::uint8_t>(broken.fault.subject));
  switch (broken.fault.kind) {
    case FaultKind::kValveStuck:  // It is sound for as long as nobody asks it to move: docs/scenarios.md.
      return node != nullptr ? last_following_of(*node).value_or(broken.at) : broken.at;
    case FaultKind::kNodeSilent:
      return node != nullptr ? last_from(*node) : broken.at;
    case FaultKind::kSyncDropped:  // all sensors at once
      return last_from(wire.pressure((setup.machine.sensors.without_pressures + 1) % kJoints * 2));
    default:
      return broken.last_good_input;
  }
}

/// What was broken last before the machine stopped is taken as the cause, also when it has just been mended; else the
/// stop itself is the last good input.
Cause Session::Impl::cause_of(Time latched_at) const {
  Cause cause{latched_at, {}};
  for (const Injected& i : faults.injected()) {
    if (i.at > latched_at || latched_at - i.mended_at > kDueToMending) continue;
    cause = {last_good_input(i, latched_at), i.at};
  }
  return cause;
}

Session::Session(const SessionSetup& setup) : impl_(std::make_unique<Impl>(setup)) {}
Session::~Session() = default;
void Session::record_to(recording::Recorder& recorder) {
  impl_->near.record_to(recorder);
  impl_->far.side.record_to(recorder);
}
void Session::step() noexcept {
  impl_->step();
}
double Session::elapsed_s() const noexcept {
  return to_seconds(impl_->now);
}
bool Session::done() const noexcept {
  const Impl& i = *impl_;
  return to_seconds(i.now) >= i.setup.scenario.duration_s ||
         (i.finished_at != Time::max() && to_seconds(i.now - i.finished_at) > kTail_s);
}
double Session::done_fraction() const noexcept {
  const auto phases = static_cast<double>(impl_->setup.scenario.phases.size());
  return std::max(static_cast<double>(impl_->person.phase()) / phases, elapsed_s() / impl_->setup.scenario.duration_s);
}
SessionOutcome Session::take_outcome() {
  Impl& i = *impl_;
  for (const Injected& broken : i.faults.injected())
    i.logs.record.injected_s.push_back(to_seconds(broken.at.time_since_epoch()));
  return i.logs.hand_over(i.setup.machine, i.person, i.now, [&i](Time latched_at) { return i.cause_of(latched_at); });
}

}  // namespace knuckle::session
