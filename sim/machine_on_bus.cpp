#include "sim/machine_on_bus.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/error.h"

namespace knuckle::sim {
namespace {

SensorErrors errors_of(const MachineTruth& truth) {
  SensorErrors errors;
  for (std::size_t i = 0; i < truth.pressure.size(); ++i) {
    errors.pressure_gain[i] = truth.pressure[i].gain;
    errors.pressure_offset_Pa[i] = truth.pressure[i].offset_Pa;
    errors.pressure_noise_Pa[i] = truth.pressure[i].noise_Pa;
  }
  errors.encoder_offset_m = truth.encoder_offset_m;
  errors.encoder_noise_m = truth.encoder_noise_m;
  errors.rotary_lever_m = MachineTruth::kRotaryLever_m;
  errors.tilt_offset_rad = truth.tilt_offset_rad;
  errors.tilt_noise_rad = truth.tilt_noise_rad;
  return errors;
}

}  // namespace

SimulatedMachine::SimulatedMachine(const MachineTruth& truth, const WorldDescription& world,
                                   const JointVector& start_rad, CanBus& port, std::uint64_t seed)
    : plant_(truth, world, start_rad),
      nodes_(truth.machine, errors_of(truth), port, seed),
      felt_Pa_(plant_.state().transmitter_Pa),
      wire_m_(plant_.state().cylinder_m),
      shaft_rad_(plant_.state().joint_rad) {
  nodes_.measured(truth.valve);
  draw_wires();
}

/// A short hole is a late thread, whose controller went on: it is made up for in one longer step. A long one is a
/// program that stalled, controller and all: its nodes' watchdogs run out in it, tick by tick, as they do on a machine
/// whose controller stalls; what comes after them is left out, as nothing moves any more.
void SimulatedMachine::step(Time now) noexcept {
  constexpr Duration kLate = 200ms, kMadeUpFor = 2s;
  if (last_ != kNever && now - last_ > kLate) {
    for (const Time end = std::min(now, last_ + kMadeUpFor); last_ + kTick < end;) step_once(last_ + kTick);
    last_ = now - kTick;
  }
  step_once(now);
}

void SimulatedMachine::step_once(Time now) noexcept {
  if (last_ != kNever && now > last_) {
    const NodeOutputs asked = nodes_.outputs();
    for (int j = 0; j < kJoints; ++j) plant_.set_valve_demand(j, asked.spool_demand[j]);
    plant_.set_pilot(asked.pilot);
    plant_.step(now - last_);
    feel(now - last_);
    draw_wires();
  }
  last_ = now;
  nodes_.step(now, signals());
}

void SimulatedMachine::feel(Duration time) noexcept {
  if (time != felt_for_) {
    felt_for_ = time;
    for (std::size_t i = 0; i < felt_Pa_.size(); ++i) {
      const double lag_s = plant_.truth().pressure[i].lag_s;
      share_[i] = lag_s > 0 ? 1 - std::exp(-to_seconds(time) / lag_s) : 1;
    }
  }
  const auto& true_Pa = plant_.state().transmitter_Pa;
  for (std::size_t i = 0; i < felt_Pa_.size(); ++i) {
    felt_Pa_[i] = share_[i] < 1 ? felt_Pa_[i] + share_[i] * (true_Pa[i] - felt_Pa_[i]) : true_Pa[i];
  }
}

void SimulatedMachine::draw_wires() noexcept {
  const MachineTruth& truth = plant_.truth();
  for (int j = 0; j < kJoints; ++j) {
    const double shortest_m = truth.machine.cylinders[static_cast<std::size_t>(j)].min_length_m;
    const double length_m = plant_.state().cylinder_m[j];
    const double drawn_m = length_m + truth.encoder_scale[j] * (length_m - shortest_m);
    const double half = 0.5 * truth.encoder_slack_m[j], before_m = wire_m_[j];
    wire_m_[j] = std::clamp(wire_m_[j], drawn_m - half, drawn_m + half);
    const bool follows = half == 0 || wire_m_[j] != before_m;
    wire_mps_[j] = follows ? (1 + truth.encoder_scale[j]) * plant_.state().cylinder_mps[j] : 0;
    const double slack = half / MachineTruth::kRotaryLever_m, joint_rad = plant_.state().joint_rad[j];
    shaft_rad_[j] = std::clamp(shaft_rad_[j], joint_rad - slack, joint_rad + slack);
  }
}

/// What of the pump's ripple a transmitter shows: sampled at the bus's rate it is any slow motion.
double SimulatedMachine::ripple_Pa(std::size_t channel) const noexcept {
  constexpr double kClosed = 0.1, kTurn = 2 * std::numbers::pi;
  constexpr double kEngine_Hz = 0.13, kEngineSwing = 0.01;  // its speed is not quite constant
  const PumpTruth& pump = plant_.truth().pump;
  const double t = plant_.state().t_s, opening = plant_.state().opening[static_cast<Eigen::Index>(channel / 2)];
  const bool fed = channel % 2 == 0 ? opening > 0 : opening < 0;
  const double turns = pump.ripple_Hz * (t - kEngineSwing * std::cos(kTurn * kEngine_Hz * t) / (kTurn * kEngine_Hz));
  const double lag = kTurn * pump.ripple_Hz * plant_.truth().pressure[channel].lag_s;
  return (fed ? 1 : kClosed) * pump.ripple_Pa * std::sin(kTurn * std::fmod(turns, 1.0)) / std::sqrt(1 + lag * lag);
}

MachineSignals SimulatedMachine::signals() const noexcept {
  const PlantState& state = plant_.state();
  MachineSignals signals{state.spool, felt_Pa_, wire_m_, wire_mps_, state.tilt_hull_rad, shaft_rad_, state.lever_m};
  for (std::size_t i = 0; i < felt_Pa_.size(); ++i) {
    signals.pressure_Pa[i] += plant_.truth().pressure[i].drift_Pa_per_K * state.warmth_K;
  }
  if (plant_.truth().pump.ripple_Pa > 0) {
    for (std::size_t i = 0; i < felt_Pa_.size(); ++i) signals.pressure_Pa[i] += ripple_Pa(i);
  }
  const SensorDescription& sensors = plant_.truth().machine.sensors;
  if (sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom) signals.slope_rad = state.tilt_boom_rad;
  return signals;
}

MachineOnBus::MachineOnBus(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad,
                           std::uint64_t seed, CanBus* wire)
    : nodes_end_(wire != nullptr ? *wire : make_buses(truth.machine.bus)),
      machine_(truth, world, start_rad, nodes_end_, seed) {}

CanBus& MachineOnBus::make_buses(const BusDescription& bus) {
  bus_.emplace(2, bus.bit_rate);
  if (bus.second) second_.emplace(2, bus.second->bit_rate);
  const auto ends = [this](std::size_t port, std::optional<CanBuses>& both) {
    both.emplace(bus_->port(port), second_ ? &second_->port(port) : nullptr);
  };
  ends(kControllerPort, controllers_end_);
  ends(kMachinePort, nodes_ends_);
  return *nodes_ends_;
}

void MachineOnBus::set_tap(CanTap tap) noexcept {
  tap_ = tap;
  bus_->set_tap(tap);
  if (!second_) return;
  const auto of_second = [](void* self, Time at, const CanFrame& frame) {
    const CanTap& own = static_cast<MachineOnBus*>(self)->tap_;
    CanFrame marked = frame;
    marked.id |= kSecondBus;
    if (own.on_frame != nullptr) own.on_frame(own.context, at, marked);
  };
  second_->set_tap({of_second, this});
}

Time MachineOnBus::advance(Time due) {
  if (now_ == kNever) step(Time{});
  while (now_ < due) {
    step(now_ + kTick);
    if (each_tick) each_tick(*this);
  }
  return now_;
}

Duration period_in_ticks(const MachineDescription& machine) {
  const Duration period = from_seconds(1 / machine.bus.sync_Hz);
  if (period % kTick == Duration::zero()) return period;
  throw InputError(machine.source + ": key 'bus.sync_Hz' = " + std::to_string(machine.bus.sync_Hz) +
                   ": its period must be whole milliseconds");
}

namespace {

BusAccess access_through(CanBus& end, const std::shared_ptr<MachineOnBus>& machine) {
  std::shared_ptr<CanBus> port(machine, &end);
  BusAccess access("simulated bus", std::move(port), [machine](Time due) { return machine->advance(due); });
  access.press_e_stop = [machine](bool pressed) { machine->machine().set_estop(pressed); };
  access.tape_m = [machine](int joint) {
    constexpr double kTape_m = 1e-3;
    return std::round(machine->plant().cylinder_m[joint] / kTape_m) * kTape_m;
  };
  return access;
}

}  // namespace

BusAccess access_to(std::shared_ptr<MachineOnBus> machine) {
  return access_through(machine->controllers_end(), machine);
}

BusAccess access_to(std::shared_ptr<MachineOnBus> machine, std::size_t which) {
  return access_through(machine->bus(which).port(MachineOnBus::kControllerPort), machine);
}

}  // namespace knuckle::sim
