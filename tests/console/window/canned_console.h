// A console's data out of a can: the same picture on every computer, whatever loops and simulator do.
#pragma once

#include <cmath>
#include <random>

#include "app/console/window/console_window.h"
#include "estimation/force_estimator.h"
#include "machine/kinematics.h"
#include "machine/load.h"

namespace knuckle::console::window {

inline screens::ConsoleFacts canned_facts() {
  screens::ConsoleFacts facts;
  facts.machine = load_machine(find_config("machine", "solar015"));
  facts.device = load_device(find_config("device", "knuckle1"));
  facts.peer = "simulated";
  facts.scenarios = {"dismantle", "wall_contact", "free_motion"};
  return facts;
}

/// Of a machine that was identified, and surveyed.
inline screens::ConsoleFacts calibrated_facts() {
  screens::ConsoleFacts facts = canned_facts();
  facts.machine.source = "solar015_calibrated.toml";
  DynamicsCalibration& dynamics = facts.machine.dynamics_calibration.emplace();
  dynamics.residual_rms_Nm = {212, 96, 31};
  for (int joint = 0; joint < kJoints; ++joint) {
    dynamics.parameters[friction_index(joint, kCoulombExtend)] = 900 - 200 * joint;
    dynamics.parameters[friction_index(joint, kCoulombRetract)] = 840 - 190 * joint;
    dynamics.covariance(friction_index(joint, kCoulombExtend), friction_index(joint, kCoulombExtend)) = 25 * 25;
    dynamics.covariance(friction_index(joint, kCoulombRetract), friction_index(joint, kCoulombRetract)) = 30 * 30;
  }
  facts.machine.geometry_calibration.emplace().tip_rms_m = 0.0042;
  facts.machine.valve_calibration[kBoom] = ValveCalibration{0.123, 0.131, 0.046, 1e-3};
  facts.machine.calibration_provenance = {"full", "2026-11-20T09:12:44Z", "9f86d081884c7d659a2feaa0c55ad015",
                                          "slow.csv, fast.csv", "knuckle 0.1.0"};
  return facts;
}

inline RecordingLight canned_recording() {
  RecordingLight light;
  light.state = RecordingLight::State::kOn;
  light.free_bytes = 78'200'000'000;
  return light;
}

/// Pressing on a wall, 12.5 s into a session.
inline ConsoleView canned_view() {
  ConsoleView v;
  v.now = Time(12'500ms);
  v.simulated = true;
  v.simulated_s = 12.5;
  v.hand.presence = v.hand.enable = true;
  v.hand.position_scale = 10;
  v.hand.force_scale = 1e-3;
  v.hand.sent_force_N = {-1.43, 0.35};
  v.hand.hand_energy_J = -0.042;
  v.link.heard = true;
  v.link.silence_s = 0.004;
  v.link.neutral_after_s = 0.2;
  v.link.round_trip_s = 0.0241;
  v.link.loss = 0.0123;
  std::mt19937 random(7);
  std::lognormal_distribution<double> spread(0, 0.25);
  for (int i = 0; i < 2000; ++i) {
    v.link.round_trip.add(from_seconds(0.024 * spread(random)));
    v.link.arrival_jitter.add(from_seconds(0.0012 * spread(random)));
    v.link.hand_to_valve.add(from_seconds(0.019 * spread(random)));
  }
  SlaveMessage& m = v.machine;
  m.mode = Mode::kEngaged;
  m.position_rad = {0.5, -0.9, -0.5};
  m.velocity_radps = {0.021, -0.08, 0.002};
  m.tip_force_N = {-1410, 380};
  m.covariance_N2 = {8100, 900, 14400};
  m.confidence = 0.82;
  m.contact = true;
  m.limits = kLimitPumpFlow | kLimitJointRange;
  m.pressure_Pa = {118e5, 22e5, 64e5, 91e5, 40e5, 12e5};
  m.payload_kg = 21.4;
  m.payload_sigma_kg = 2.3;
  v.hand.ghost_rad = {0.52, -0.82, -0.5};
  v.hand.set_point_rad = {0.51, -0.87, -0.5};
  v.truth.pump_Pa = 142e5;
  v.status_heard = true;
  v.status_age_s = 0.02;
  MachineStatus& s = v.status;
  s.valve_command = {0.31, -0.62, 0.04};
  s.spool = {0.29, -0.58, 0.03};
  s.pilot_on = true;
  s.calibrated = true;
  s.oil_flow_m3ps = 5.1e-4;
  s.hydraulic_power_W = 6100;
  s.wake_lateness = {61us, 180us, 2100us};
  s.execution = {240us, 410us, 1300us};
  s.period = 5ms;
  s.steps = 2500;
  s.overruns = 1;
  s.fifo_priority = 80;
  s.buses[0].load = 0.41;
  s.force_doubts = estimation::kStuckFriction | estimation::kBiasNotLearned;
  return v;
}

/// A wall at the tip.
inline sim::WorldDescription canned_world() {
  const PlanarVector tip = Kinematics(canned_facts().machine).tip(canned_view().machine.position_rad);
  sim::WallDescription wall;
  wall.point_m = tip;
  wall.from_m = -1;
  wall.to_m = 1;
  sim::WorldDescription world;
  world.walls.push_back(wall);
  return world;
}

inline LoopHealth canned_loop() {
  LoopHealth loop;
  loop.policy = {"SCHED_FIFO 80"};
  loop.period = 1ms;
  loop.steps = 12'500;
  loop.overruns = 3;
  std::mt19937 random(9);
  std::lognormal_distribution<double> spread(0, 0.4);
  for (int i = 0; i < 10'000; ++i) {
    loop.wake_lateness.add(from_seconds(58e-6 * spread(random)));
    loop.execution.add(from_seconds(85e-6 * spread(random)));
  }
  return loop;
}

/// A session's story.
inline void fill(EventBook& events, const BusDescription& bus) {
  const auto add = [&](ConsoleEventKind kind, Duration at, Mode mode, Reason reason = {}, double value = 0) {
    ConsoleEvent event;
    event.kind = kind;
    event.at = Time(at);
    event.on = true;
    event.mode = mode;
    event.reason = reason;
    event.value = value;
    events.add(event, bus);
  };
  using Kind = ConsoleEventKind;
  add(Kind::kLink, 5ms, Mode::kOff);
  add(Kind::kMachine, 40ms, Mode::kSelfTest);
  add(Kind::kMachine, 840ms, Mode::kReady);
  add(Kind::kMachine, 2100ms, Mode::kAligning);
  add(Kind::kMachine, 2400ms, Mode::kEngaged);
  add(Kind::kContact, 5350ms, Mode::kEngaged, {}, 820);
  add(Kind::kMachine, 6200ms, Mode::kFault, {ReasonCode::kSensorStale, 0x11, 41, 25});
  add(Kind::kMachine, 8000ms, Mode::kReady);
  add(Kind::kMachine, 9100ms, Mode::kEngaged);
  add(Kind::kBlocked, 10200ms, Mode::kEngaged, {ReasonCode::kPowerLimit, 0, 9.1F, 9});
  add(Kind::kContact, 11800ms, Mode::kEngaged, {}, 1440);
}

/// Ten seconds before the view, so that histories are full; then the view. What is silent in the view was heard until
/// then.
template <typename Show>
void with_history(const ConsoleView& view, const Show& show) {
  for (int i = 200; i >= 0; --i) {
    ConsoleView v = view;
    v.now -= i * 50ms;
    const double t = to_seconds(v.now);
    v.simulated_s = t;
    if (i > 0) {
      const double since_s = view.link.silence_s - 0.05 * i;
      v.link.silence_s = v.status_age_s = std::max(0.004, since_s);
      v.status.valve_command = {0.5 * std::sin(t), 0.7 * std::sin(0.7 * t + 1), 0.3 * std::sin(1.9 * t)};
      v.status.spool = 0.93 * v.status.valve_command;
      v.machine.velocity_radps = 0.3 * v.status.valve_command;
      v.hand.hand_energy_J = 0.05 * std::sin(0.4 * t);
    }
    show(v);
  }
}

}  // namespace knuckle::console::window
