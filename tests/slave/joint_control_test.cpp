#include "slave/joint_control.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "sim/plant.h"
#include "tests/slave/reasons.h"
#include "tests/slave/standing.h"
#include "tests/support/solar.h"
#include "transport/link_messages.h"

namespace knuckle::slave {
namespace {

constexpr double kStep_s = 0.005;

/// The controller on the simulated hydraulics without wires: exact angles and pressures, rates behind a low-pass.
class Rig {
 public:
  Rig(const sim::MachineTruth& truth, const sim::WorldDescription& world, const JointVector& start)
      : kinematics_(test::solar()), plant_(truth, world, start), control_(test::solar(), kStep_s) {
    plant_.set_pilot(true);
  }

  [[nodiscard]] estimation::JointState state() const {
    const sim::PlantState& p = plant_.state();
    estimation::JointState state = standing_at(p.joint_rad, kinematics_);
    state.rate_radps = p.joint_radps;
    state.pressure_Pa = p.transmitter_Pa;
    for (int i = 0; i < kJoints; ++i) {
      const auto k = static_cast<std::size_t>(i);
      state.cylinder_mps[i] = p.cylinder_mps[i];
      state.cylinder_N[i] = p.transmitter_Pa[2 * k] * test::solar().cylinders[k].head_area_m2() -
                            p.transmitter_Pa[2 * k + 1] * test::solar().cylinders[k].rod_side_area_m2();
    }
    return state;
  }

  /// The hand is shown all that the tip feels.
  JointControl::Output step(JointCommand command) {
    const sim::PlantState& p = plant_.state();
    command.rendered_N = p.contact_N;
    estimation::ForceEstimate force;
    force.tip_N = p.contact_N;
    force.confidence = 1;
    force.fast_torque_Nm = kinematics_.tip_jacobian(p.joint_rad).transpose() * p.contact_N;
    const auto output = control_.step(state(), force, command, sent_);
    sent_ = output.valve;
    for (int i = 0; i < kJoints; ++i) plant_.set_valve_demand(i, sent_[i]);
    for (int i = 0; i < 5; ++i) plant_.step(1ms);
    return output;
  }
  [[nodiscard]] const sim::PlantState& plant() const { return plant_.state(); }
  [[nodiscard]] PlanarVector tip(const JointVector& q) const { return kinematics_.tip(q); }
  [[nodiscard]] const JointControl& control() const { return control_; }

 private:
  Kinematics kinematics_;
  sim::Plant plant_;
  JointControl control_;
  JointVector sent_ = JointVector::Zero();
};

const JointVector kStart(0.6, -1.3, -0.6);

const Kinematics& kinematics() {
  static const Kinematics of_solar(test::solar());
  return of_solar;
}

sim::MachineTruth sampled(std::uint64_t seed) {
  return sim::sample_truth(test::solar(), seed);
}

TEST(JointControl, TracksSinesWithinFourCentimetresAtTheTipForDrawnMachines) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Rig rig(sampled(seed), {}, kStart);
    const JointVector amplitude(0.25, 0.35, 0.35),
        omega(2 * std::numbers::pi / 6.5, 2 * std::numbers::pi / 5.5, 2 * std::numbers::pi / 4.5);
    double sum = 0;
    int count = 0;
    for (int k = 0; k < 4000; ++k) {
      const double t = k * kStep_s, fade = std::min(1.0, t / 2);
      JointCommand command{kStart, JointVector::Zero(), true};
      for (int i = 0; i < kJoints; ++i) {
        command.position_rad[i] += fade * amplitude[i] * std::sin(omega[i] * t);
        command.velocity_radps[i] = fade * amplitude[i] * omega[i] * std::cos(omega[i] * t);
      }
      rig.step(command);
      if (t < 3) continue;
      sum += (rig.plant().tip_m - rig.tip(command.position_rad)).squaredNorm();
      ++count;
    }
    EXPECT_LT(std::sqrt(sum / count), 0.04) << "seed " << seed;
  }
}

TEST(JointControl, HoldsAPoseWithinACentimetreWithoutALimitCycle) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Rig rig(sampled(seed), {}, kStart);
    const JointCommand command{kStart + JointVector(0.02, -0.02, 0.02), JointVector::Zero(), true};
    double low = 1e9, high = -1e9;
    for (int k = 0; k < 4000; ++k) {
      rig.step(command);
      if (k < 2000) continue;
      low = std::min(low, rig.plant().tip_m.y());
      high = std::max(high, rig.plant().tip_m.y());
    }
    EXPECT_LT((rig.plant().tip_m - rig.tip(command.position_rad)).norm(), 0.01) << "seed " << seed;
    EXPECT_LT(high - low, 0.004) << "seed " << seed;
  }
}

TEST(JointControl, ScalesAllAxesTogetherWhenThePumpIsShort) {
  Rig rig(sampled(1), {}, kStart);
  JointCommand command{kStart, JointVector(0.55, -0.65, -1.2), true};
  const auto output = rig.step(command);
  EXPECT_NE(output.limits & kLimitPumpFlow, 0);
  EXPECT_NEAR(output.rate_radps[1] / output.rate_radps[0], -0.65 / 0.55, 1e-6);
  EXPECT_NEAR(output.rate_radps[2] / output.rate_radps[0], -1.2 / 0.55, 1e-6);
}

/// Joint rates asked of a machine held at its set-point, for an external torque as the estimator claims it.
JointVector given_way(const JointVector& torque_Nm, double confidence) {
  JointControl control(test::solar(), kStep_s);
  estimation::ForceEstimate force;
  force.fast_torque_Nm = torque_Nm;
  force.confidence = confidence;
  return control
      .step(standing_at(kStart, kinematics()), force, {kStart, JointVector::Zero(), true}, JointVector::Zero())
      .rate_radps;
}

TEST(JointControl, GivesWayOnlyToAForceThatIsTrustedAndNeverWithoutBound) {
  const MachineDescription& machine = test::solar();
  // A boom transmitter that jumps by 150 bar: more than 50 kN on the rod.
  const double jump_Nm =
      150e5 * machine.cylinders[kBoom].head_area_m2() * kinematics().cylinder_at(kBoom, kStart[kBoom])->lever_m;
  for (const double sign : {-1.0, 1.0}) {
    const JointVector jump(sign * jump_Nm, 0, 0);
    EXPECT_TRUE(given_way(jump, 0.1).isZero(0)) << "nobody trusts it";
    const JointVector rate = given_way(jump, 1);
    const double gain = std::max(machine.control.position_gain_1ps, machine.control.bucket_position_gain_1ps);
    EXPECT_GT(rate.norm(), 0);
    EXPECT_LE((kinematics().tip_jacobian(kStart) * rate).norm(), gain * 5e3 / machine.control.tip_stiffness_N_per_m);
    EXPECT_LT((given_way(2 * jump, 1) - rate).norm(), 1e-9) << "no more for twice the nonsense";
    // An honest press: in full, and in proportion.
    const JointVector press = kinematics().tip_jacobian(kStart).transpose() * PlanarVector(sign * 2000, 0);
    EXPECT_LT((given_way(press, 0.4) - 2 * given_way(press / 2, 1)).norm(), 1e-9);
    EXPECT_LT((given_way(press, 0.25) - 0.5 * given_way(press, 1)).norm(), 1e-9);
  }
}

/// A bucket that stands against something it is asked to press: the force, the trust in it, the limit and what the hand
/// is shown of it may change.
class PressedMachine {
 public:
  JointControl::Output step(const PlanarVector& tip_N, double limit_N, double confidence = 1, double shown = 100) {
    estimation::ForceEstimate force;
    force.fast_torque_Nm = kinematics().tip_jacobian(kStart).transpose() * tip_N;
    force.measurement_variance_Nm2 = JointVector::Constant(2500);
    force.tip_N = tip_N;
    force.confidence = confidence;
    const JointVector ahead = kinematics().tip_jacobian(kStart).transpose() * PlanarVector(0.2, 0);
    const JointCommand command{kStart + ahead, JointVector::Zero(), true, shown * tip_N, limit_N};
    return control_.step(standing_at(kStart, kinematics()), force, command, JointVector::Zero());
  }
  void let_go() { control_.step({}, {}, {kStart, JointVector::Zero(), false}, JointVector::Zero()); }
  [[nodiscard]] double forward_mps(const JointControl::Output& output) const {
    return (kinematics().tip_jacobian(kStart) * output.rate_radps).x();
  }

 private:
  JointControl control_{test::solar(), kStep_s};
};

/// Rate of the tip along x with a set-point that moves at `speed_mps` from a machine that stands where it is asked to,
/// pushed back by force_N.
double answered_mps(double speed_mps, double force_N, double machine_mps = 0) {
  JointControl control(test::solar(), kStep_s);
  const auto jacobian = kinematics().tip_jacobian(kStart);
  const JointVector along = jacobian.transpose() * (jacobian * jacobian.transpose()).inverse() * PlanarVector(1, 0);
  estimation::ForceEstimate force;
  force.tip_N = {-force_N, 0};
  double rate = 0;
  for (int i = 0; i < 200; ++i) {
    estimation::JointState state = standing_at(kStart + along * (machine_mps * i * kStep_s), kinematics());
    state.rate_radps = along * machine_mps;
    const JointCommand command{state.angle_rad, along * speed_mps, true};
    const auto output = control.step(state, force, command, JointVector::Zero());
    rate = (kinematics().tip_jacobian(state.angle_rad) * output.rate_radps).x();
  }
  return rate;
}

TEST(JointControl, FeedsSpeedForwardInAirAndAwayFromAWallButNotIntoIt) {
  EXPECT_NEAR(answered_mps(0.1, 0), 0.1, 0.005);
  EXPECT_NEAR(answered_mps(0.1, 1000), 0, 1e-6);
  EXPECT_LT(answered_mps(-0.1, 1000), -0.08);
  EXPECT_GT(answered_mps(0.1, 1000, 0.1), 0.08) << "the force stays while the tip moves on: soil, or a load";
}

TEST(JointControl, ForceLimitSwitchedOnInContactTakesTheForceForNoRise) {
  const PlanarVector pressed(-1000, 0);
  PressedMachine always, again;
  const double steady_mps = always.forward_mps(always.step(pressed, 4000));
  ASSERT_GT(steady_mps, 0.01);
  again.step({0, 0}, 4000);
  for (int k = 0; k < 10; ++k) again.step(pressed, 0);
  EXPECT_NEAR(again.forward_mps(again.step(pressed, 4000)), steady_mps, 1e-9);
}

TEST(JointControl, SetPointLimitOfACertainContactStaysForAWhileAsLongAsItIsTouched) {
  const PlanarVector pressed(-3000, 0), light(-800, 0);
  const auto next_mps = [](PressedMachine& machine, const PlanarVector& tip_N) {
    return machine.forward_mps(machine.step(tip_N, 0, 1, 0));
  };
  PressedMachine fresh;
  const double free_mps = next_mps(fresh, light);
  PressedMachine machine;
  next_mps(machine, pressed);
  EXPECT_LT(next_mps(machine, light), 0.3 * free_mps);
  EXPECT_NEAR(next_mps(machine, {0, 0}), next_mps(fresh, {0, 0}), 1e-9) << "nothing is touched";
  for (double t_s = 0; t_s < 3; t_s += kStep_s) next_mps(machine, light);
  EXPECT_NEAR(next_mps(machine, light), free_mps, 1e-9);
  next_mps(machine, pressed);
  machine.let_go();
  EXPECT_NEAR(next_mps(machine, light), free_mps, 1e-9) << "another contact";
}

TEST(JointControl, ForceLimitHoldsWhateverTheForceIsTrusted) {
  for (const double confidence : {1.0, 0.2, 0.1, 0.0}) {
    PressedMachine machine;
    const auto output = machine.step({-3000, 0}, 1500, confidence);
    EXPECT_LE(machine.forward_mps(output), 1e-9) << confidence;
    EXPECT_NE(output.limits & kLimitAssistForce, 0);
    EXPECT_TRUE(test::is(output.assist, ReasonCode::kAssistForce));
  }
}

TEST(JointControl, ForceLimitWithAnUnknownForceHoldsStillAndLetsGoWhenItIsKnownAgain) {
  PressedMachine machine;
  const auto held = machine.step({std::numeric_limits<double>::quiet_NaN(), 0}, 1500);
  EXPECT_EQ(held.rate_radps, JointVector(0, 0, 0));
  EXPECT_NE(held.limits & kLimitAssistForce, 0);
  EXPECT_TRUE(test::is(held.assist, ReasonCode::kAssistForceUnknown));
  EXPECT_TRUE(held.valve.allFinite());
  EXPECT_EQ(held.contact_compliance, 0);
  EXPECT_GT(machine.forward_mps(machine.step({-100, 0}, 1500)), 0.01);
  // Forces that a contact is judged from, too.
  for (int i = 0; i < 10; ++i) {
    const auto known = machine.step({-400, 0}, 1500);
    EXPECT_TRUE(std::isfinite(known.contact_compliance));
    EXPECT_TRUE(known.valve.allFinite());
  }
}

TEST(JointControl, PressesOnToTheMachinesCeilingAndNotBeyondWhateverTheForceIsTrusted) {
  for (const double confidence : {1.0, 0.0}) {
    PressedMachine machine;
    const auto output = machine.step({-11e3, 0}, 0, confidence);
    EXPECT_LE(machine.forward_mps(output), 1e-9) << confidence;
    EXPECT_NE(output.limits & kLimitForceCeiling, 0);
    EXPECT_TRUE(test::is(output.assist, ReasonCode::kForceCeiling));
  }
  PressedMachine machine;
  EXPECT_EQ(machine.step({-100, 0}, 0).limits & kLimitForceCeiling, 0) << "free motion is free";
}

TEST(JointControl, IsNeutralWhileInactive) {
  Rig rig(sampled(1), {}, kStart);
  rig.step({kStart + JointVector::Constant(0.2), JointVector::Zero(), true});
  const auto output = rig.step({kStart + JointVector::Constant(0.2), JointVector::Zero(), false});
  EXPECT_TRUE(output.valve.isZero(0));
}

/// Mean of what it sends while one and the same error stays, so that the dither is out of it.
JointVector answer(JointControl control, const estimation::JointState& state, double error_rad) {
  const JointVector wanted = state.angle_rad + JointVector::Constant(error_rad);
  (void)control.step(state, {}, {wanted, JointVector::Zero(), false}, JointVector::Zero());
  JointVector sum = JointVector::Zero();
  constexpr int kSteps = 40;
  for (int k = 0; k < kSteps; ++k)
    sum += control.step(state, {}, {wanted, JointVector::Zero(), true}, JointVector::Zero()).valve;
  return sum / kSteps;
}

/// A boom at one pose that is asked for one speed, while its pressures are what the test says.
class LoadedBoom {
 public:
  explicit LoadedBoom(double towards_rad)
      : command_{kStart + JointVector(towards_rad, 0, 0), JointVector::Zero(), true} {}
  /// Spool without dead band and dither, over so many steps of 5 ms: mean, and half the swing at `swing_Hz`.
  struct Spool {
    double mean, swing;
  };
  Spool over(int steps, double head_bar, double swing_bar, double swing_Hz) {
    double sum = 0, sine = 0, cosine = 0;
    for (int k = 0; k < steps; ++k) {
      const double turn = 2 * std::numbers::pi * swing_Hz * kStep_s * k;
      state_.pressure_Pa[0] = (head_bar + swing_bar * std::sin(turn)) * 1e5;
      state_.pressure_Pa[1] = 15e5;
      state_.cylinder_N[kBoom] = state_.pressure_Pa[0] * test::solar().cylinders[kBoom].head_area_m2() -
                                 state_.pressure_Pa[1] * test::solar().cylinders[kBoom].rod_side_area_m2();
      const double spool = control_.step(state_, {}, command_, JointVector::Zero()).valve[kBoom];
      sum += spool;
      sine += spool * std::sin(turn);
      cosine += spool * std::cos(turn);
    }
    return {sum / steps, 2 * std::hypot(sine, cosine) / steps};
  }

 private:
  JointControl control_{test::solar(), kStep_s};
  estimation::JointState state_ = standing_at(kStart, kinematics());
  JointCommand command_;
};

// An opening that follows the pressure takes away what damps the arm's swing on its oil, and drives it: a stretched arm
// of a machine that nobody has identified swung by 0.4 rad/s for seconds.
TEST(JointControl, OpensNoWiderWhileTheArmSwingsOnItsOil) {
  LoadedBoom boom(0.08);
  boom.over(200, 70, 0, 3);
  for (const double swing_Hz : {2.5, 5.0}) {
    const LoadedBoom::Spool spool = boom.over(800, 70, 40, swing_Hz);
    EXPECT_LT(spool.swing, 0.2 * spool.mean) << swing_Hz << " Hz";
  }
}

TEST(JointControl, OpensLessWhereALoadPushesTheOilOut) {
  LoadedBoom light(-0.08), heavy(-0.08);
  light.over(200, 30, 0, 1);
  heavy.over(200, 120, 0, 1);
  EXPECT_LT(std::abs(heavy.over(200, 120, 0, 1).mean), 0.9 * std::abs(light.over(200, 30, 0, 1).mean));
}

TEST(JointControl, LearnsNothingFromWhatWasCommandedBeforeItWasLetGo) {
  const MachineDescription& machine = test::solar();
  const estimation::JointState standing = standing_at(kStart, kinematics());
  estimation::JointState moving = standing;
  moving.cylinder_mps.setConstant(0.1);
  moving.pressure_Pa.fill(150e5);  // the pump follows the load
  const JointCommand fast{kStart + JointVector::Constant(0.2), JointVector::Zero(), true},
      hold{kStart, JointVector::Zero(), true}, let_go{kStart, JointVector::Zero(), false};
  JointControl fresh(machine, kStep_s), again(machine, kStep_s);
  const auto stand = [&](JointControl& control) {
    for (int k = 0; k < 100; ++k) control.step(standing, {}, hold, JointVector::Zero());
  };
  for (int k = 0; k < 100; ++k) again.step(moving, {}, fast, JointVector::Zero());
  again.step(standing, {}, let_go, JointVector::Zero());
  stand(again);
  stand(fresh);
  for (const double error_rad : {0.02, -0.02})
    EXPECT_NEAR((answer(again, standing, error_rad) - answer(fresh, standing, error_rad)).norm(), 0, 1e-12);
}

TEST(JointControl, LearnsNoMoreThanItsLimit) {
  sim::MachineTruth sticky = sampled(3);
  for (CylinderDescription& cylinder : sticky.machine.cylinders) {
    cylinder.valve.dead_band_extend += 0.06;
    cylinder.valve.dead_band_retract += 0.06;
  }
  Rig rig(sticky, {}, kStart);
  for (int k = 0; k < 8000; ++k)
    rig.step({kStart + JointVector::Constant(k / 2000 % 2 == 0 ? 0.01 : -0.01), JointVector::Zero(), true});
  const MachineDescription& nominal = test::solar();
  const double limit = nominal.control.learning_limit;
  double most = 0;
  for (const double error_rad : {0.01, -0.01}) {
    const JointVector learned =
        answer(rig.control(), rig.state(), error_rad) - answer(JointControl(nominal, kStep_s), rig.state(), error_rad);
    most = std::max(most, learned.cwiseAbs().maxCoeff());
  }
  EXPECT_LE(most, 1.2 * limit);
  EXPECT_GT(most, 0.8 * limit) << "it would have learned more";
}

/// A machine without the boom's transmitters in a contact, for which the controller alone decides.
class TwoTorques {
 public:
  explicit TwoTorques(const JointVector& pose)
      : jacobian(kinematics().tip_jacobian(pose)), state(standing_at(pose, kinematics())) {
    state.pressures_known[kBoom] = false;
    force.joint_covariance_Nm2 = JointVector(40, 12, 5).cwiseAbs2().asDiagonal();
    force.joint_covariance_Nm2(kBoom, kBoom) = std::numeric_limits<double>::infinity();
  }
  /// @return after half a second with the set-point so far ahead.
  JointControl::Output towards(const JointVector& ahead_rad) {
    JointControl::Output output;
    for (int n = 0; n < 100; ++n)
      output = control_.step(state, force, {state.angle_rad + ahead_rad, JointVector::Zero(), true}, output.valve);
    return output;
  }
  PlanarJacobian jacobian;
  estimation::JointState state;
  estimation::ForceEstimate force;

 private:
  JointControl control_{test::solar(), kStep_s};
};

TEST(JointControlOfTwoTorques, GoesBackTheWayItCameAndNotOnWhereTheyDoNotTellTheForce) {
  TwoTorques machine({0.3, -1.5, 0.01});
  const JointVector way(0.02, 0.05, 0.05);
  machine.state.rate_radps = 4 * way;
  (void)machine.towards(way);
  machine.force.contact = true;
  machine.state.rate_radps.setZero();
  const JointControl::Output on = machine.towards(way), back = machine.towards(-way);
  EXPECT_TRUE(test::is(on.assist, ReasonCode::kForceUnknown));
  EXPECT_FALSE(back.assist);
  EXPECT_LT((machine.jacobian * on.rate_radps).norm(), 0.8 * (machine.jacobian * back.rate_radps).norm());
  EXPECT_GT((machine.jacobian * back.rate_radps).norm(), 0.02);
}

// It stands because it was held: then the friction of standing rods must not hold it.
TEST(JointControlOfTwoTorques, IsNotHeldByFrictionOfItsOwnStanding) {
  TwoTorques machine({0.3, -1.5, -0.6});
  machine.force.contact = true;
  ASSERT_FALSE(machine.towards({0, 0.05, 0}).assist);
  const JointVector stuck_Nm2(0, 60 * 60, 30 * 30);
  machine.force.joint_covariance_Nm2.diagonal() += stuck_Nm2;
  EXPECT_TRUE(test::is(machine.towards({0, 0.05, 0}).assist, ReasonCode::kForceUnknown));
  machine.force.stuck_variance_Nm2 = stuck_Nm2;
  EXPECT_FALSE(machine.towards({0, 0.05, 0}).assist);
}

}  // namespace
}  // namespace knuckle::slave
