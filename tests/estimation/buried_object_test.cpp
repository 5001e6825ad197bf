// The buried-object cue on prescribed digging: soil of every kind says nothing, a pipe does.
#include "estimation/buried_object.h"

#include <gtest/gtest.h>

#include "tests/estimation/test_machine.h"
#include "tests/support/no_alloc.h"

namespace knuckle::estimation {
namespace {

/// Drags the tip towards the machine at the height of the start; the force on it is the test's, late as the
/// estimator's fast torque is.
class Drag {
 public:
  explicit Drag(double speed_mps) : speed_mps_(speed_mps) {}

  /// One step; `force_N` against the motion. @return the cue.
  bool step(double force_N, double speed_share = 1) {
    x_m_ -= speed_share * speed_mps_ * kStep_s;
    JointState state;
    state.angle_rad = *kinematics_.inverse({x_m_, -0.8}, -1.6);
    for (int i = 0; i < kJoints; ++i) state.lever_m[i] = kinematics_.cylinder_at(i, state.angle_rad[i])->lever_m;
    ForceEstimate force;
    force.fast_torque_Nm = third_.step(second_.step(
        first_.step(JointVector(kinematics_.tip_jacobian(state.angle_rad).transpose() * PlanarVector(force_N, 0)))));
    force.measurement_variance_Nm2 = JointVector(900, 900, 400);
    return cue_.step(state, force);
  }
  [[nodiscard]] double travelled_m() const { return 2.2 - x_m_; }
  BuriedObjectCue& cue() { return cue_; }

 private:
  Kinematics kinematics_{test_machine()};
  BuriedObjectCue cue_{test_machine(), kStep_s};
  FohFilter<JointVector> first_{kFastBand.velocity_Hz, kStep_s}, second_{kFastBand.velocity_Hz, kStep_s},
      third_{kFastBand.observer_Hz, kStep_s};
  double speed_mps_, x_m_ = 2.2;
};

/// Digs `before_m` through soil, then meets a spring that takes the tip to a stop while oil is still coming.
/// @return way [m] beyond the touch at which the cue came, or -1.
double cue_after_m(double speed_mps, double before_m, double soil_N_per_m, double stiffness_N_per_m) {
  Drag drag(speed_mps);
  while (drag.travelled_m() < before_m) {
    if (drag.step(soil_N_per_m * drag.travelled_m())) return -2;
  }
  const double soil_N = soil_N_per_m * before_m, touched_m = drag.travelled_m();
  constexpr double kOil_N_per_m = 3e5;  // the cylinders' oil gives in, in series with what is touched
  const double share = kOil_N_per_m / (kOil_N_per_m + stiffness_N_per_m);
  for (double t = 0; t < 0.3; t += kStep_s) {
    if (drag.step(soil_N + stiffness_N_per_m * (drag.travelled_m() - touched_m), share))
      return drag.travelled_m() - touched_m;
  }
  return -1;
}

TEST(BuriedObject, PipeIsToldWithinMillimetresAtDiggingSpeeds) {
  for (const double speed_mps : {0.08, 0.15, 0.3}) {
    const double way_m = cue_after_m(speed_mps, 0.2, 5e3, 5e6);
    EXPECT_GE(way_m, 0) << speed_mps;
    EXPECT_LT(way_m, 0.005) << speed_mps;
  }
}

TEST(BuriedObject, SoilThatGetsHarderIsNone) {
  for (const double speed_mps : {0.08, 0.15, 0.2, 0.3}) {
    for (const double stiffness : {2e4, 5e4, 1e5})
      EXPECT_EQ(cue_after_m(speed_mps, 0.2, 5e3, stiffness), -1) << speed_mps << " " << stiffness;
  }
}

TEST(BuriedObject, WallMetInFreeAirIsAContactAndNotThis) {
  EXPECT_EQ(cue_after_m(0.2, 0.2, 0, 5e6), -1);
}

TEST(BuriedObject, CueEndsWhereTheForceLetsGo) {
  Drag drag(0.2);
  while (drag.travelled_m() < 0.2) drag.step(1000);
  double force = 1000;
  for (int n = 0; n < 20; ++n) drag.step(force += 200, 0);
  EXPECT_TRUE(drag.cue().on());
  EXPECT_NEAR(drag.cue().stiffness_N_per_m(), 1.84e5, 0.1e5) << "a lower bound: force and way are late";
  for (int n = 0; n < 40; ++n) drag.step(500, 0);
  EXPECT_FALSE(drag.cue().on());
}

TEST(BuriedObject, StepAllocatesNothing) {
  Drag drag(0.2);
  const test::NoAllocScope guard;
  for (int n = 0; n < 200; ++n) drag.step(500);
  EXPECT_EQ(guard.allocations(), 0u);
}

}  // namespace
}  // namespace knuckle::estimation
