#include "app/session/session.h"

#include <algorithm>
#include <utility>

#include "app/session/asked_force.h"
#include "app/session/fault_injection.h"
#include "app/session/fault_watch.h"
#include "app/session/loop_views.h"
#include "app/session/operator_path.h"
#include "app/session/session_books.h"
#include "app/session/session_sides.h"
#include "machine/kinematics.h"
#include "recording/sides.h"
#include "slave/bus_map.h"

namespace knuckle::session {
namespace {

using sim::FaultKind;

constexpr double kTail_s = 0.5;            // recorded after the operator has finished
constexpr Duration kDueToMending = 300ms;  // a fault that latches so soon after something was mended is due to it

}  // namespace

recording::OperatorSetup operator_setup(const SessionSetup& setup) {
  return {.device = setup.device,
          .machine = setup.machine,
          .law = setup.law,
          .start = setup.starts().operator_end,
          .assist = setup.scenario.assist,
          .far_end = master::FarEnd::kIsThisMachine};
}

sim::Operator operator_of(const SessionSetup& setup) {
  const Scenario& scenario = setup.scenario;
  return {setup.machine,
          scenario.phases,
          setup.path,
          kPathPeriod,
          scenario.hand_rad,
          scenario.reaction,
          sim::push_stiffness(setup.limb, setup.device.feel),
          sim::Unsteadiness(setup.person, setup.limb, setup.seed),
          setup.seed};
}

struct Session::Impl {
  explicit Impl(const SessionSetup& s);
  void step() noexcept;
  void sample(const sim::OperatorIntent& intent) noexcept;
  void note_slew() noexcept;
  Time last_good_input(const Injected& broken, Time latched_at) const;
  SessionRecord take_record();

  SessionSetup setup;
  Kinematics kinematics;
  Time now{};
  SessionRecord record;
  MasterBook master_book;
  SlaveBook slave_book;
  MachineBook machine_book;
  HopHistograms hops;  // once the record was taken
  FaultWatch latched;
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
      record(start_record(s)),
      master_book(record.samples.capacity(), s.starts().machine_end.origin),
      slave_book(record.samples.capacity(), s.starts().operator_end.origin),
      machine_book(most_frames(s.machine.bus, s.scenario.duration_s)),
      person(operator_of(s)),
      hand(s.device_truth(), s.limb, s.seed, s.scenario.hand_rad),
      network(s.to_machine, s.to_operator, s.seed),
      faults(s.scenario.faults, network, s.machine.bus),
      near(operator_setup(s), hand.cable.host(), faults.operator_end()),
      far(s.machine, s.truth, s.scenario, s.seed, faults.machine_end()) {
  far.simulated.bus().set_tap(
      {[](void* book, Time at, const CanFrame& f) { static_cast<MachineBook*>(book)->note(at, f); }, &machine_book});
}

void Session::Impl::step() noexcept {
  now += kTick;
  network.advance(now);
  const sim::OperatorIntent intent = person.step(
      now, person_view(view_of(now, near.master), setup.scenario.start_rad, hand.device.truth(), machine_book.breaks));
  faults.step(now, person.phase(), person.in_phase(now), far, hand);
  hand.step(now, intent);
  const Time operator_now = now + faults.operator_clock();
  near.step(operator_now);
  note_slew();
  master_book.note(now, near.master);
  far.step(now, [&] {
    if (faults.slave_runs()) {
      far.side.step(now);
      slave_book.note(now, far.side.slave);
    }
    sample(intent);
  });
  machine_book.note(far.simulated.plant().events);
  if (person.finished() && finished_at == Time::max()) finished_at = now;
}

/// How much the felt force changed in this millisecond, for the slew bound.
void Session::Impl::note_slew() noexcept {
  const PlanarVector force_N = hand.device.truth().felt_N;
  felt_slew = std::max(felt_slew, (force_N - last_force_N).norm());
  last_force_N = force_N;
}

void Session::Impl::sample(const sim::OperatorIntent& intent) noexcept {
  latched.step(now, far.side.slave.mode(), far.side.slave.fault(), intent.enable);
  const HandView held = view_of(hand.device, person, intent, setup.scenario.phases.size());
  MasterView asked = view_of(now, near.master);
  asked.slew_N_per_ms = std::exchange(felt_slew, 0.0);
  keep(record.samples, sample_of(now, far.side.slave, far.simulated.plant(), held, asked, kinematics),
       record.records_lost);
}

Time Session::Impl::last_good_input(const Injected& broken, Time latched_at) const {
  const BusDescription& wire = setup.machine.bus;
  const auto last_from = [&](const NodeDescription& node) {
    return last_frame_before(machine_book.frames, node.tpdo_id(), broken.at).value_or(broken.at);
  };
  switch (broken.fault.kind) {
    case FaultKind::kValveStuck:  // It is sound for as long as nobody asks it to move: docs/scenarios.md.
      for (int joint = 0; joint < kJoints; ++joint) {
        if (wire.valves[static_cast<std::size_t>(joint)].id != broken.fault.subject) continue;
        return last_following(machine_book.frames, setup.machine, joint, latched_at).value_or(broken.at);
      }
      return broken.at;
    case FaultKind::kNodeSilent:
      for (const NodeDescription& node : slave::nodes_of(wire)) {
        if (node.id == broken.fault.subject) return last_from(node);
      }
      return broken.at;
    case FaultKind::kSyncDropped:  // all sensors at once
      return last_from(wire.pressures[0]);
    default:
      return broken.last_good_input;
  }
}

SessionRecord Session::Impl::take_record() {
  // What was broken last before the machine stopped is taken as the cause, also when it has just been mended; else the
  // stop itself is the last good input.
  const auto cause_of = [this](Time latched_at) {
    Cause cause{latched_at, {}};
    for (const Injected& i : faults.injected()) {
      if (i.at > latched_at || latched_at - i.mended_at > kDueToMending) continue;
      cause = {last_good_input(i, latched_at), i.at};
    }
    return cause;
  };
  for (const Injected& i : faults.injected()) record.injected_s.push_back(to_seconds(i.at.time_since_epoch()));
  latched.judge(machine_book.frames, setup.machine, now, cause_of, record);
  machine_book.hand_over(record);
  master_book.hand_over(record);
  record.plan_finished = person.finished();
  record.phases_timed_out = person.timed_out() >= 0 || !person.finished() ? 1 : 0;
  hops = hops_of(master_book, slave_book, machine_book, setup.machine.bus);
  return std::move(record);
}

std::size_t most_frames(const BusDescription& bus, double duration_s) noexcept {
  constexpr double kSensors = 1 + 6 + 3 + 1, kValves = 3, kNodes = 6 + 3 + 3 + 2;  // the first with their SYNC
  constexpr double kSpare = 1.5, kSetUp = 4000;
  const double slow_Hz = 2 / bus.controller_heartbeat_s + 2 * kNodes / bus.node_heartbeat_s;
  const double frames_Hz =
      bus.sync_Hz * (kSensors + kValves / bus.set_point_every_nth_sync + kValves / bus.valve_status_every_nth_sync) +
      slow_Hz;
  return static_cast<std::size_t>(kSetUp + kSpare * frames_Hz * duration_s);
}

SessionRecord start_record(const SessionSetup& setup) {
  SessionRecord record;
  record.samples.reserve(static_cast<std::size_t>((setup.scenario.duration_s + 1) * setup.machine.bus.sync_Hz));
  record.phases = setup.scenario.phase_names;
  record.phases.emplace_back("hold");
  record.force_scale = setup.device.feel.force_scale;
  record.device_limit_N = setup.device.feel.force_limit_N;
  record.asked_N = asked_forces_N(setup.machine, setup.scenario, record.force_scale);
  record.link_delay_s = to_seconds(setup.to_machine.delay);
  for (Eigen::Index i = 0; i < kJoints; ++i) {
    const LinkDescription& link = setup.machine.links[static_cast<std::size_t>(i)];
    record.joint_end_low_rad[i] = link.min_rad + setup.machine.limits.joint_soft_margin_rad;
    record.joint_end_high_rad[i] = link.max_rad - setup.machine.limits.joint_soft_margin_rad;
  }
  return record;
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
SessionRecord Session::take_record() {
  return impl_->take_record();
}
const FrameLog& Session::frames() const noexcept {
  return impl_->machine_book.frames;
}
const HopHistograms& Session::hops() const noexcept {
  return impl_->hops;
}

}  // namespace knuckle::session
