// A made-up session with the shape of a real one: approach, press, hold, break, scoop, weigh. For outputs, not physics.
#pragma once

#include <cmath>
#include <string>

#include "app/session/session_result.h"
#include "machine/kinematics.h"
#include "machine/load.h"

namespace knuckle::session {

inline constexpr double kRow_s = 0.005;

/// Engaged rows from 0 s at the slave's rate, everything else zero.
inline SessionRecord engaged_record(double seconds) {
  SessionRecord record;
  record.phases = {"approach", "press", "hold", "release", "scoop", "weigh"};
  for (int i = 0; i * kRow_s < seconds; ++i) {
    Sample s;
    s.t_s = i * kRow_s;
    s.machine.mode = Mode::kEngaged;
    record.samples.push_back(s);
  }
  return record;
}

inline double blend(double t, double from, double to) {
  const double u = std::min(1.0, std::max(0.0, (t - from) / (to - from)));
  return u * u * (3 - 2 * u);
}

/// Tip of the made-up dismantling session over time, frame M.
inline PlanarVector made_up_tip(double t) {
  const PlanarVector home(1.35, 0.35), wall(2.05, 0.45), ground(1.75, -0.72), lifted(1.45, 0.3);
  return home + blend(t, 2, 8) * (wall - home) + blend(t, 18, 23) * (ground - wall) +
         blend(t, 26, 30) * (lifted - ground);
}

inline SessionResult synthetic_session() {
  SessionResult session;
  session.scenario = "dismantle";
  session.machine_name = "solar015";
  session.device_name = "knuckle1";
  session.operator_name = "normal";
  session.control = "echo";
  session.seed = 1;
  session.delay_ms = 10;
  session.digest.whole = std::string(64, '0');
  session.simulated_s = 36;
  session.wall_s = 0.5;
  session.machine = load_machine(find_config("machine", "solar015"));
  const Kinematics kinematics(session.machine);
  SessionRecord& record = session.record;
  record = engaged_record(36);
  record.link_delay_s = 0.01;
  for (Sample& s : record.samples) {
    const double t = s.t_s;
    if (t < 0.3)
      s.machine.mode = Mode::kSelfTest;
    else if (t < 1)
      s.machine.mode = Mode::kAligning;
    s.phase = t < 8 ? 0 : t < 10 ? 1 : t < 18 ? 2 : t < 23 ? 3 : t < 27 ? 4 : 5;
    s.truth.tip_m = made_up_tip(t - 0.05);
    s.hand_setpoint_tip_m = made_up_tip(t);
    const double bucket_rad = -1.9 - 0.8 * blend(t, 23, 26);
    s.truth.joint_rad = kinematics.inverse(s.truth.tip_m, bucket_rad).value_or(JointVector(0.3, -1.5, -1));
    s.machine.joint_rad = s.truth.joint_rad + JointVector::Constant(0.002 * std::sin(3 * t));
    s.machine.setpoint_rad = kinematics.inverse(s.hand_setpoint_tip_m, bucket_rad).value_or(s.machine.joint_rad);
    const double noise = std::sin(41 * t) + std::sin(67 * t + 1);
    if (t >= 8 && t < 18) s.truth.tip_force_N = PlanarVector(-2000, 300) * blend(t, 8, 9);
    if (t >= 23 && t < 26) s.truth.tip_force_N = PlanarVector(-600, 900) * blend(t, 23, 24);
    s.machine.tip_force_N = s.truth.tip_force_N + PlanarVector(40 * noise, 30 * std::sin(53 * t));
    s.machine.covariance_N2 = {50 * 50, 0, 60 * 60};
    s.machine.contact = s.truth.tip_force_N.norm() > 150;
    s.hand.felt_N = 1e-3 * s.truth.tip_force_N * 0.95;
    s.master.sent_force_N = s.hand.felt_N;
    s.machine.confidence = 0.9;
    for (std::size_t i = 0; i < 6; ++i)
      s.machine.pressure_Pa[i] =
          1e5 * (30 + 12 * static_cast<double>(i) + 5 * std::sin(t + static_cast<double>(i)) + noise);
    s.hand.energy_J = -0.02 * t;
    s.truth.energy_to_machine_J = 300 * std::sin(0.3 * t) + 60 * t;
    if (t > 25) s.truth.payload_kg = 52;
    s.machine.payload_kg = 51 + noise;
    s.machine.payload_sigma_kg = 1.5;
    s.machine.limits = t > 3 && t < 4 ? 2 : 0;
  }
  record.events = {{8.05, "contact"}, {18.0, "piece broke"}, {26.0, "scooped 52 kg"}};
  session.criteria = {
      {"tip_rms_m", {}, 0.05}, {"no_load_rms_N", {}, 150}, {"hold_error_N", {}, 0.05}, {"pieces_broken", 1, {}}};
  session.hops = {{"hand_to_valve", 7000, {14000, 19000, 21000}}};
  session.notes = {"made up for tests"};
  const double ground = -0.75, wall = 2.05;
  session.scene = {
      {"ground", SceneLine::Kind::kGround, {{-6, ground}, {8, ground}}, false},
      {"wall",
       SceneLine::Kind::kWall,
       {{wall, ground},
        {wall + 0.4, ground},
        {wall + 0.4, 1.4},
        {wall, 1.4},
        {wall, 0.65},
        {wall + 0.25, 0.6},
        {wall + 0.25, 0.3},
        {wall, 0.25}},
       true},
      {"loose piece",
       SceneLine::Kind::kPiece,
       {{wall, 0.65}, {wall + 0.25, 0.6}, {wall + 0.25, 0.3}, {wall, 0.25}},
       true,
       0,
       18},
      {"loose piece",
       SceneLine::Kind::kPiece,
       {{1.75, ground}, {2.05, ground}, {2.03, ground + 0.3}, {1.73, ground + 0.28}},
       true,
       18,
       26},
  };
  return session;
}

}  // namespace knuckle::session
