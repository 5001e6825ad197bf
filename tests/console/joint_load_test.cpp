// What a joint's oil does, and where a joint is at its end: by numbers, and by what a simulated machine comes to when
// somebody leads it there by keys.
#include "app/console/joint_load.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "app/console/machine_text.h"
#include "estimation/regressor.h"
#include "machine/load.h"
#include "tests/console/console_rig.h"
#include "tests/support/says.h"

namespace knuckle::console {
namespace {

struct Still {
  MachineDescription machine = load_machine(find_config("machine", "solar015"));
  Kinematics kinematics{machine};
  SlaveMessage m;

  explicit Still(const JointVector& pose_rad = {0.5, -1.4, -0.9}) {
    m.position_rad = pose_rad;
    m.payload_sigma_kg = 2;
    for (int joint = 0; joint < kJoints; ++joint) set_torque(joint, 0);
  }
  /// Pressures that carry the arm's weight and this torque beside it, with as little oil as can be.
  void set_torque(int joint, double beside_Nm) {
    const estimation::Pose pose(m.position_rad, 0);
    const JointVector weight_Nm =
        estimation::joint_torque(estimation::RigidArm::gravity(pose) * estimation::known_parameters(machine));
    const auto i = static_cast<std::size_t>(joint);
    const double lever_m = kinematics.cylinder_at(joint, m.position_rad[joint])->lever_m;
    const double oil_N = (weight_Nm[joint] + beside_Nm) / lever_m;
    const CylinderDescription& cylinder = machine.cylinders[i];
    m.pressure_Pa[2 * i] = std::max(0.0, oil_N / cylinder.head_area_m2());
    m.pressure_Pa[2 * i + 1] = std::max(0.0, -oil_N / cylinder.rod_side_area_m2());
  }
  [[nodiscard]] JointLoad load(int joint) const {
    return joint_loads(m, machine, kinematics)[static_cast<std::size_t>(joint)];
  }
};

TEST(JointLoads, PressesOnNothingWhileItsOilCarriesTheWeightOfTheArmInAnyPoseAndOnAnySlope) {
  for (const double boom : {-0.3, 0.4, 1.0})
    for (const double arm : {-2.3, -1.5, -0.7})
      for (const double bucket : {-2.0, -0.8, 0.5}) {
        const Still still({boom, arm, bucket});
        for (const JointLoad& load : joint_loads(still.m, still.machine, still.kinematics)) {
          EXPECT_FALSE(load.presses()) << boom << ' ' << arm << ' ' << bucket;
          EXPECT_EQ(load.end, 0);
        }
      }
}

TEST(JointLoads, PressesWhereItsTorqueIsMoreThanWeightAndFrictionExplain) {
  for (const int joint : {kBoom, kArm, kBucket}) {
    SCOPED_TRACE(kJointNames[static_cast<std::size_t>(joint)]);
    Still still;
    const double reach_m = still.load(joint).reach_m;
    for (const int way : {1, -1}) {
      still.set_torque(joint, way * 8000 * reach_m);
      const JointLoad load = still.load(joint);
      EXPECT_EQ(load.pushes, way);
      EXPECT_TRUE(load.presses());
      const double least_N = load.beyond_Nm / reach_m;
      EXPECT_LT(least_N, 8000) << "at least, so never more than it is";
      EXPECT_GT(least_N, 3000) << "and of some use";
    }
  }
}

TEST(JointLoads, NoLoadThatABucketMayHoldIsAPress) {
  Still still;
  const double weight_N = still.machine.payload_full_scale_kg * 9.81;
  const double lifted_Nm = weight_N * still.kinematics.tip_jacobian(still.m.position_rad)(1, kBoom);
  still.set_torque(kBoom, lifted_Nm);
  still.m.payload_sigma_kg = 1000;
  EXPECT_EQ(still.load(kBoom).pushes, 0) << "its load is not known";
  still.m.payload_sigma_kg = 2;
  EXPECT_EQ(still.load(kBoom).pushes, 1) << "it is known to be empty: the boom lifts on something";
}

TEST(JointLoads, PressesOnNothingByTheArmsOwnWeightNorByOilThatSlowsAJointDownNorByWhatIsNoNumber) {
  Still lying;
  lying.set_torque(kBoom, 0);
  lying.m.pressure_Pa[0] = 5e5;
  EXPECT_EQ(lying.load(kBoom).pushes, 0);
  Still slowed;
  slowed.set_torque(kBoom, -20000);
  EXPECT_EQ(slowed.load(kBoom).pushes, -1);
  slowed.m.velocity_radps[kBoom] = 0.3;
  EXPECT_EQ(slowed.load(kBoom).pushes, 0);
  Still unknown;
  unknown.m.pressure_Pa.fill(std::nan(""));
  for (const int joint : {kBoom, kArm, kBucket}) EXPECT_EQ(unknown.load(joint).pushes, 0);
  unknown.m.position_rad.fill(std::nan(""));
  for (const int joint : {kBoom, kArm, kBucket}) EXPECT_EQ(unknown.load(joint).end, 0);
}

TEST(JointLoads, TellTheChamberThatPushesAndWhetherItIsAtRelief) {
  Still still;
  still.m.pressure_Pa[2] = 4e5;
  still.m.pressure_Pa[3] = 219e5;  // the arm goes out by retracting
  JointLoad load = still.load(kArm);
  EXPECT_EQ(load.pushes, 1);
  EXPECT_DOUBLE_EQ(load.pressure_Pa, 219e5);
  EXPECT_TRUE(load.at_relief);
  still.m.pressure_Pa[3] = 150e5;
  load = still.load(kArm);
  EXPECT_EQ(load.pushes, 1);
  EXPECT_FALSE(load.at_relief);
}

TEST(JointLoads, AJointThatIsPushedToAnEndThatMayBeHereIsAtItsEnd) {
  Still still({0.5, -1.4, -2.42});  // 4.6 deg, but 1.5 mm of the rod's way, from the end of the drawing
  still.m.pressure_Pa[4] = 205e5;
  EXPECT_EQ(still.load(kBucket).end, -1);
  EXPECT_TRUE(still.load(kBucket).pushes_on_its_end());
  EXPECT_FALSE(still.load(kBucket).presses());
  still.m.pressure_Pa[4] = 20e5;
  EXPECT_EQ(still.load(kBucket).end, 0) << "it may go on";
  still.m.ahead_rad[kBucket] = -0.08;
  EXPECT_EQ(still.load(kBucket).end, -1) << "asked to go there";
  Still away({0.5, -1.4, -1.9});
  away.m.pressure_Pa[4] = 205e5;
  away.m.ahead_rad[kBucket] = -0.6;
  EXPECT_EQ(away.load(kBucket).end, 0) << "something is in its way";
  EXPECT_TRUE(away.load(kBucket).presses());
  still.m.ahead_rad.setZero();
  still.m.pressure_Pa[4] = 0;
  still.m.pressure_Pa[5] = 205e5;
  EXPECT_TRUE(still.load(kBucket).presses()) << "out, on something";
}

TEST(JointLoads, NearAnEndOfItsRangeButShortOfAnySteelAJointPressesOnSomething) {
  Still still;
  const double margin_rad = still.machine.limits.joint_soft_margin_rad;
  still.m.position_rad[kBoom] = still.machine.links[kBoom].min_rad + 0.9 * margin_rad;
  still.set_torque(kBoom, -60000);
  EXPECT_EQ(still.load(kBoom).end, -1) << "the hand meets a wall";
  EXPECT_TRUE(still.load(kBoom).presses());
  EXPECT_FALSE(still.load(kBoom).pushes_on_its_end());
}

TEST(JointLoads, TheirLeastForceHoldsAtEachCornerOfTheBucketAndAtItsLinkage) {
  for (const double bucket : {-2.4, -0.9, 0.5}) {
    SCOPED_TRACE(bucket);
    const Still still({0.5, -1.4, bucket});
    const MachinePose pose = pose_of(still.machine, still.m.position_rad);
    const PerJoint<PlanarVector> origins{pose.boom.translation(), pose.arm.translation(), pose.bucket.translation()};
    std::vector<PlanarVector> places{pose.linkage_pin_m};
    for (const PlanarVector& corner : bucket_outline(still.machine)) places.push_back(pose.bucket * corner);
    for (int joint = 0; joint < kJoints; ++joint)
      for (const PlanarVector& place : places)
        EXPECT_GE(still.load(joint).reach_m, (place - origins[static_cast<std::size_t>(joint)]).norm() - 1e-12)
            << joint;
  }
}

TEST(JointLoads, TheOffsetOfACalibratedCylindersPressuresIsNoPush) {
  Still drawn, calibrated;
  DynamicsCalibration& found = calibrated.machine.dynamics_calibration.emplace();
  found.parameters.head<kBaseCount>() = estimation::known_parameters(drawn.machine);
  constexpr double kOffset_N = 3000;
  for (const int joint : {kBoom, kArm, kBucket}) {
    const FrictionDescription& friction = drawn.machine.cylinders[static_cast<std::size_t>(joint)].friction;
    found.parameters[friction_index(joint, kCoulombExtend)] = friction.coulomb_N + kOffset_N;
    found.parameters[friction_index(joint, kCoulombRetract)] = friction.coulomb_N - kOffset_N;
    found.parameters[friction_index(joint, kBreakaway)] = friction.coulomb_N * (friction.static_ratio - 1);
    const double lever_m = drawn.kinematics.cylinder_at(joint, drawn.m.position_rad[joint])->lever_m;
    for (const int way : {1, -1}) {
      const double beside_Nm = way * 8000 * drawn.load(joint).reach_m;
      drawn.set_torque(joint, beside_Nm);
      calibrated.set_torque(joint, beside_Nm + lever_m * kOffset_N);
      EXPECT_EQ(calibrated.load(joint).pushes, way) << joint;
      EXPECT_NEAR(calibrated.load(joint).beyond_Nm, drawn.load(joint).beyond_Nm, 1e-6) << joint << ' ' << way;
    }
  }
}

TEST(JointLoads, ARodIsAtRestThatMovesNoMoreThanTheStepsOfItsEncoderSeemTo) {
  Still still;
  const double lever_m = std::abs(still.kinematics.cylinder_at(kArm, still.m.position_rad[kArm])->lever_m);
  EXPECT_TRUE(still.load(kArm).at_rest);
  for (const int way : {1, -1}) {
    still.m.velocity_radps[kArm] = way * 0.011 / lever_m;
    EXPECT_TRUE(still.load(kArm).at_rest);
    still.m.velocity_radps[kArm] = way * 0.015 / lever_m;
    EXPECT_FALSE(still.load(kArm).at_rest);
  }
  still.m.velocity_radps[kArm] = std::nan("");
  EXPECT_FALSE(still.load(kArm).at_rest);
}

TEST(PushWatch, APushIsSteadyAfterAQuarterOfASecondWhateverMovesAndLastsAfterHalfOfOneWithAllRodsAtRest) {
  const struct {
    int way;
    bool at_rest;
    Duration at;
    bool steady, lasts;
  } kLooks[]{{1, true, 1000ms, false, false}, {1, true, 1240ms, false, false},
             {1, true, 1250ms, true, false},  {1, true, 1480ms, true, false},
             {1, true, 1500ms, true, true},   {-1, true, 1520ms, false, false},
             {-1, true, 1770ms, true, false}, {-1, true, 2000ms, true, false},
             {-1, true, 2020ms, true, true},  {-1, false, 2040ms, true, false},  // the boom moves
             {-1, true, 2060ms, true, false}, {-1, true, 2310ms, true, false},
             {-1, true, 2560ms, true, true},  {0, true, 2580ms, false, false},
             {1, true, 2600ms, false, false}, {1, true, 3600ms, false, false},  // nobody looked meanwhile
             {1, true, 100ms, false, false},                                    // another session
             {1, true, 350ms, true, false},   {1, true, 600ms, true, true}};
  PushWatch watch;
  for (const auto& look : kLooks) {
    JointLoads loads;
    for (JointLoad& load : loads) load.at_rest = true;
    loads[kBoom].at_rest = look.at_rest;
    loads[kArm].pushes = look.way;
    watch.watch(loads, Time(look.at));
    EXPECT_EQ(loads[kArm].steady, look.steady) << to_seconds(look.at);
    EXPECT_EQ(loads[kArm].lasts, look.lasts) << to_seconds(look.at);
    EXPECT_FALSE(loads[kBoom].lasts || loads[kBucket].lasts);
  }
}

// As a person leads the simulated machine.

struct LoadedConsole : test::ConsoleRig {
  explicit LoadedConsole(const std::string& scenario) : ConsoleRig(test::live_setup(scenario)) {
    start_up();
    EXPECT_TRUE(engage());
  }
  [[nodiscard]] JointLoads loads() const { return joint_loads(view.machine, setup.machine, kinematics); }
  /// Frame by frame. @param frame called with the loads of each. @return the last.
  JointLoads watch(
      double seconds, const std::function<void(const JointLoads&)>& frame = [](const JointLoads&) {}) {
    JointLoads marked;
    for (const Time until = now + from_seconds(seconds); now < until;) {
      run(0.016);
      marked = loads();
      pushes.watch(marked, view.now);
      frame(marked);
    }
    return marked;
  }
  Kinematics kinematics{setup.machine};
  PushWatch pushes;
};

TEST(LedByKeys, EachJointThatIsLedToItsEndSaysSoAndGoesOnSayingIt) {
  const struct {
    bool HeldKeys::*key;
    int joint, end;
  } kWays[]{{&HeldKeys::boom_up, kBoom, 1},
            {&HeldKeys::arm_out, kArm, 1},
            {&HeldKeys::arm_in, kArm, -1},
            {&HeldKeys::bucket_out, kBucket, 1},
            {&HeldKeys::bucket_in, kBucket, -1}};
  for (const auto& way : kWays) {
    const std::string words = direction_text(way.joint, way.end > 0);
    SCOPED_TRACE(words);
    LoadedConsole led("free_motion");
    EXPECT_TRUE(end_texts(led.loads()).empty());
    led.keys.*way.key = true;
    led.run(9);
    for (int i = 0; i < 10; ++i, led.run(0.1))
      EXPECT_EQ(end_texts(led.loads()), std::vector<std::string>{words + ": at its end"})
          << led.view.machine.position_rad.transpose() << " led to " << led.view.hand.set_point_rad.transpose() << ", "
          << text(led.view.machine.blocking);
  }
}

TEST(LedByKeys, AnArmThatIsLetGoOfAtSpeedInFreeAirIsNeverSaidToPress) {
  const struct {
    bool HeldKeys::*boom, HeldKeys::*arm;
  } kWays[]{{&HeldKeys::boom_up, &HeldKeys::arm_out}, {&HeldKeys::boom_down, &HeldKeys::arm_in}};
  for (const auto& way : kWays) {
    LoadedConsole led("free_motion");
    led.keys.*way.boom = led.keys.*way.arm = true;
    led.run(1);
    ASSERT_GT(led.view.machine.velocity_radps.norm(), 0.2);
    led.keys = {};
    bool pushed = false;
    led.watch(3, [&](const JointLoads& loads) {
      ConsoleView view = led.view;
      EXPECT_EQ(still_pressing(view, loads) + shut_in(view, loads), "") << to_seconds(led.now);
      view.machine.confidence = 0;
      EXPECT_EQ(still_pressing(view, loads) + shut_in(view, loads), "")
          << "its force is not known; " << to_seconds(led.now);
      pushed |= std::any_of(loads.begin(), loads.end(), [](const JointLoad& load) { return load.pushes != 0; });
    });
    EXPECT_EQ(led.view.machine.mode, Mode::kReady);
    EXPECT_TRUE(pushed) << "it swings on its oil";
  }
}

TEST(LedByKeys, AnArmThatIsMovedToAndFroInFreeAirIsNotSaidToPressWhereTheForceIsNotKnown) {
  LoadedConsole led("free_motion");
  led.keys.boom_up = true;
  led.run(9);
  int unknown = 0, pushed = 0;
  for (int turn = 0; turn < 20; ++turn) {
    led.keys.arm_in = led.keys.bucket_in = turn % 4 == 3;
    led.keys.arm_out = led.keys.bucket_out = turn % 4 == 1;
    led.watch(1, [&](const JointLoads& loads) {
      if (force_text(led.view).known) return;
      ++unknown;
      pushed += loads[kBucket].presses() ? 1 : 0;
      EXPECT_EQ(blind_press(led.view, loads).text, "") << to_seconds(led.now);
    });
  }
  EXPECT_EQ(led.view.machine.mode, Mode::kEngaged);
  EXPECT_GT(unknown, 50) << "the boom is at its end";
  EXPECT_GT(pushed, 20) << "its oil starts and stops it";
}

TEST(LedByKeys, AMachineThatPressesOnTheGroundIsSaidToPressThoughItsForceIsNotKnownAndAfterTheHandHasLetGo) {
  LoadedConsole led("wall_contact");
  led.keys.boom_down = led.keys.arm_in = led.keys.bucket_in = true;
  led.run(7);
  ASSERT_EQ(led.view.machine.mode, Mode::kEngaged);
  ASSERT_FALSE(force_text(led.view).known) << "a cylinder is at its end stop";
  const BlindPress press = blind_press(led.view, led.watch(0.3));
  EXPECT_TRUE(test::begins(press.text, "pressing; cannot be measured: "));
  EXPECT_TRUE(test::says(press.text, "boom"));
  EXPECT_GT(press.least_N, 1000);
  EXPECT_TRUE(feels_end_of_range(led.view, led.setup.machine)) << "which is all that is felt of it";
  EXPECT_GT(led.view.hand.sent_force_N.norm(), 0.5);
  led.keys = {};
  const JointLoads loads = led.watch(10);
  ASSERT_EQ(led.view.machine.mode, Mode::kReady);
  const std::string still = still_pressing(led.view, loads);
  EXPECT_TRUE(test::begins(still, "still pressing: "));
  EXPECT_TRUE(test::says(still, "boom"));
}

}  // namespace
}  // namespace knuckle::console
