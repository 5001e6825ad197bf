#include "app/session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "app/fault_injection.h"
#include "app/operator_path.h"
#include "core/error.h"
#include "machine/kinematics.h"
#include "sim/haptic_device.h"
#include "sim/operator.h"
#include "sim/simulated_machine.h"
#include "slave/slave_loop.h"
#include "transport/canopen.h"
#include "transport/hid_pair.h"
#include "transport/virtual_can.h"

namespace knuckle::app {
namespace {

constexpr Duration kTick = 1ms;
constexpr double kTail_s = 0.5;            // recorded after the operator has finished
constexpr double kFramesPerSecond = 3200;  // reserve: a full map at 200 Hz, heartbeats and start-up
constexpr std::size_t kControllerPort = 0, kMachinePort = 1;

}  // namespace

struct Session::Impl {
  /// The machine stopped with a fault, and when the operator let go of enable for the first time after it.
  struct Latched {
    Reason reason;
    Time at{};
    Time released_at = Time::max();
  };

  explicit Impl(const SessionSetup& s);
  void step() noexcept;
  void sample(const sim::OperatorIntent& intent) noexcept;
  void read_events() noexcept;
  void watch_enable(bool enable) noexcept;
  void note_master_hops() noexcept;
  void note_slave_hops() noexcept;
  void on_frame(Time at, const CanFrame& frame) noexcept;
  sim::OperatorView view() const noexcept;
  FaultRecord judge(const Latched& latch) const;
  SessionRecord take_record();

  SessionSetup setup;
  Kinematics kinematics;
  Time now{};
  Duration slave_period;
  FrameLog frames;
  SessionRecord record;
  HopHistograms hops;
  std::vector<sim::WorldEvent> world_events;
  std::vector<Latched> latched;
  bool was_latched = false;
  std::uint64_t events_read = 0;
  int breaks = 0;
  double felt_slew = 0;
  PlanarVector last_force_N = PlanarVector::Zero();
  Time finished_at = Time::max();
  std::uint32_t heard_by_master = 0, heard_by_slave = 0;
  std::optional<Time> set_point_report_at;  // device report behind the set-points now sent

  HidPair cable;
  ImpairedLink network;
  VirtualCanBus bus;
  FaultInjection faults;
  sim::Operator person;
  sim::HandAndDevice hand;
  master::MasterLoop master;
  slave::SlaveLoop slave;
  sim::SimulatedMachine machine;
};

Session::Impl::Impl(const SessionSetup& s)
    : setup(s),
      kinematics(s.machine),
      slave_period(from_seconds(1 / s.machine.bus.sync_Hz)),
      network(s.to_machine, s.to_operator, s.seed),
      bus(2, s.machine.bus.bit_rate),
      faults(s.scenario.faults, network, cable),
      person(s.machine, s.scenario.phases, s.path, kPathPeriod, s.scenario.hand_rad, s.scenario.reaction),
      hand(s.device, s.limb, cable.device(), s.seed, s.scenario.hand_rad),
      master(s.device, s.machine, cable.host(), faults.operator_end(), s.law),
      slave(s.machine, bus.port(kControllerPort), faults.machine_end()),
      machine(s.truth, s.scenario.world, s.scenario.start_rad, bus.port(kMachinePort), s.seed) {
  if (slave_period % kTick != Duration::zero()) {
    throw InputError(s.machine.source + ": key 'bus.sync_Hz' = " + std::to_string(s.machine.bus.sync_Hz) +
                     ": its period must be whole milliseconds");
  }
  frames.reserve(static_cast<std::size_t>(kFramesPerSecond * s.scenario.duration_s));
  record.samples.reserve(static_cast<std::size_t>((s.scenario.duration_s + 1) * s.machine.bus.sync_Hz));
  world_events.reserve(1024);
  latched.reserve(64);
  record.phases = s.scenario.phase_names;
  record.phases.emplace_back("hold");
  record.force_scale = s.device.feel.force_scale;
  record.link_delay_s = to_seconds(s.to_machine.delay);
  bus.set_tap({[](void* self, Time at, const CanFrame& f) { static_cast<Impl*>(self)->on_frame(at, f); }, this});
}

void Session::Impl::on_frame(Time at, const CanFrame& frame) noexcept {
  if (frames.size() < frames.capacity()) frames.push_back({at, frame});
  if (frame.id == canopen::rpdo1_id(setup.machine.bus.valves[kBucket].id) && set_point_report_at) {
    hops.hand_to_valve.add(at - *set_point_report_at);
    set_point_report_at.reset();
  }
}

sim::OperatorView Session::Impl::view() const noexcept {
  sim::OperatorView v;
  const auto& shown = master.machine();
  v.machine_rad = shown ? shown->position_rad : setup.scenario.start_rad;
  v.ghost_rad = master.set_point().unclamped_rad();
  v.hand_rad = hand.truth().joint_rad;
  v.felt_N = hand.truth().felt_N;
  v.mode = shown ? shown->mode : Mode::kOff;
  v.breaks = breaks;
  return v;
}

void Session::Impl::step() noexcept {
  now += kTick;
  cable.advance();
  network.advance(now);
  const sim::OperatorIntent intent = person.step(now, view());
  faults.step(now, person.phase(), person.in_phase(now), machine, hand);
  watch_enable(intent.enable);
  hand.step(now, intent);
  master.step(now);
  note_master_hops();
  bus.advance(now);
  if (now.time_since_epoch() % slave_period == Duration::zero()) {
    if (faults.slave_runs()) {
      slave.step(now);
      note_slave_hops();
    }
    sample(intent);
  }
  machine.step(now);
  read_events();
  if (person.finished() && finished_at == Time::max()) finished_at = now;
}

void Session::Impl::watch_enable(bool enable) noexcept {
  for (Latched& l : latched) {
    if (l.released_at == Time::max() && !enable) l.released_at = now;
  }
}

void Session::Impl::note_master_hops() noexcept {
  // How much the force asked for changed in this millisecond, for the slew bound.
  const PlanarVector force_N = master.sent_force_N();
  felt_slew = std::max(felt_slew, (force_N - last_force_N).norm());
  last_force_N = force_N;
  const auto& message = master.machine();
  if (!message || message->sequence == heard_by_master) return;
  heard_by_master = message->sequence;
  hops.slave_to_master.add(now - message->sent_at);
  if (message->sensor_at != kNever) hops.pressure_to_hand.add(now - message->sensor_at);
  hops.hand_to_master.add(now - master.device().measured_at);
}

void Session::Impl::note_slave_hops() noexcept {
  const MasterMessage& message = slave.master();
  if (message.sequence == heard_by_slave) return;
  heard_by_slave = message.sequence;
  hops.master_to_slave.add(now - message.sent_at);
  hops.pressure_to_slave.add(now - slave.sensors().newest_at());
  if (slave.mode() == Mode::kEngaged && !set_point_report_at) set_point_report_at = message.device_report_at;
}

void Session::Impl::read_events() noexcept {
  const auto& events = machine.plant().state().events;
  for (; events_read < events.count; ++events_read) {
    const sim::WorldEvent& event = events.at(events_read);
    if (event.kind == sim::WorldEventKind::kPieceBroke) ++breaks;
    if (world_events.size() < world_events.capacity()) world_events.push_back(event);
  }
}

void Session::Impl::sample(const sim::OperatorIntent& intent) noexcept {
  if (record.samples.size() == record.samples.capacity()) return;
  const sim::PlantState& plant = machine.plant().state();
  const estimation::ForceEstimate& force = slave.force();
  Sample s;
  s.t_s = to_seconds(now);
  s.mode = slave.mode();
  s.blocking = slave.blocking().code;
  s.fault = slave.fault().code;
  const SlaveMessage& told = slave.sent();
  s.joint_rad = told.position_rad;
  s.joint_radps = told.velocity_radps;
  s.setpoint_rad = slave.master().position_rad;
  s.setpoint_radps = slave.master().velocity_radps;
  s.valve_command = slave.commands();
  s.pressure_Pa = told.pressure_Pa;
  s.tip_force_N = force.tip_N;
  s.force_cov_N2 = {force.covariance_N2(0, 0), force.covariance_N2(0, 1), force.covariance_N2(1, 1)};
  s.confidence = force.confidence;
  s.confidence_reasons = force.confidence_reasons;
  s.contact = force.contact;
  s.limits = slave.limits();
  s.payload_kg = told.payload_kg;
  s.payload_sigma_kg = told.payload_sigma_kg;
  s.truth_joint_rad = plant.joint_rad;
  s.truth_joint_radps = plant.joint_radps;
  s.truth_spool = plant.spool;
  s.truth_tip_m = plant.tip_m;
  s.truth_tip_force_N = plant.tip_N;
  s.truth_payload_kg = plant.payload_kg;
  s.truth_pump_flow_share = plant.pump_share;
  s.truth_energy_to_machine_J = plant.valve_work_J;
  const sim::HandTruth& held = hand.truth();
  s.hand_rad = held.joint_rad;
  s.hand_radps = held.rate_radps;
  s.intent_rad = intent.joint_rad;
  s.hand_tip_m = held.tip_m;
  s.hand_setpoint_tip_m = kinematics.tip(master.set_point().position_rad());
  s.felt_N = held.felt_N;
  s.drag_N = master.sent_force_N();
  s.hand_energy_J = held.energy_to_hand_J;
  s.rtt_s = master.round_trip_s();
  const auto phase = static_cast<std::size_t>(person.phase());
  s.phase = static_cast<std::uint8_t>(person.holding() ? setup.scenario.phases.size()
                                                       : std::min(phase, setup.scenario.phases.size() - 1));
  s.felt_slew_N_per_ms = felt_slew;
  felt_slew = 0;
  const bool latched_now = s.mode == Mode::kFault || s.mode == Mode::kEStop;
  if (latched_now && !was_latched && latched.size() < latched.capacity()) latched.push_back({slave.fault(), now});
  was_latched = latched_now;
  record.samples.push_back(s);
}

FaultRecord Session::Impl::judge(const Latched& latch) const {
  // What was broken last before the machine stopped is taken as the cause; else the stop itself is the last good input.
  Time last_good = latch.at;
  for (const Injected& i : faults.injected()) {
    if (i.at <= latch.at && i.mended_at > latch.at) last_good = i.last_good_input;
  }
  const Time until = std::min(latch.released_at, now);
  const NeutralTimes neutral = neutral_times(frames, setup.machine, last_good, until);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto seconds = [](const std::optional<Time>& t) { return t ? to_seconds(*t) : kNone; };
  return {latch.reason, to_seconds(latch.at), to_seconds(last_good), seconds(neutral.command), seconds(neutral.spool)};
}

SessionRecord Session::Impl::take_record() {
  for (const Latched& latch : latched) {
    record.faults.push_back(judge(latch));
    const FaultRecord& fault = record.faults.back();
    if (!std::isfinite(fault.command_neutral_s)) continue;
    const Time neutral{from_seconds(fault.command_neutral_s)};
    if (commands_not_neutral(frames, setup.machine, neutral, latch.released_at) > 0) ++record.resumed_by_itself;
  }
  for (const sim::WorldEvent& event : world_events) record.events.push_back({event.t_s, sim::name(event.kind)});
  record.phases_timed_out = person.timed_out() >= 0 || !person.finished() ? 1 : 0;
  return std::move(record);
}

Session::Session(const SessionSetup& setup) : impl_(std::make_unique<Impl>(setup)) {}
Session::~Session() = default;
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
  return impl_->frames;
}
const HopHistograms& Session::hops() const noexcept {
  return impl_->hops;
}

}  // namespace knuckle::app
