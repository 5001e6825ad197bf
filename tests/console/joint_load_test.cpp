// What a joint's oil does, and where a joint is at its end: by numbers, and by what a simulated machine comes to when
// somebody leads it there by keys.
#include "app/console/joint_load.h"

#include <gtest/gtest.h>

#include <cmath>

#include "app/console/machine_words.h"
#include "estimation/regressor.h"
#include "machine/load.h"
#include "machine/pose.h"
#include "tests/console/console_rig.h"

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

TEST(JointLoads, AnArmThatLiesOnTheGroundPressesByItsWeightAndNotByOil) {
  Still still;
  still.set_torque(kBoom, 0);
  still.m.pressure_Pa[0] = 5e5;
  EXPECT_EQ(still.load(kBoom).pushes, 0);
}

TEST(JointLoads, OilThatSlowsAJointDownPressesOnNothing) {
  Still still;
  still.set_torque(kBoom, -20000);
  EXPECT_EQ(still.load(kBoom).pushes, -1);
  still.m.velocity_radps[kBoom] = 0.3;
  EXPECT_EQ(still.load(kBoom).pushes, 0);
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

TEST(JointLoads, SayNothingOfWhatIsNoNumber) {
  Still still;
  still.m.pressure_Pa.fill(std::nan(""));
  for (const JointLoad& load : joint_loads(still.m, still.machine, still.kinematics)) EXPECT_EQ(load.pushes, 0);
  still.m.position_rad.fill(std::nan(""));
  for (const JointLoad& load : joint_loads(still.m, still.machine, still.kinematics)) EXPECT_EQ(load.end, 0);
}

// As a person leads the simulated machine.

struct Led : test::ConsoleRig {
  explicit Led(const std::string& scenario) : ConsoleRig(test::live_setup(scenario)) {
    start_up();
    EXPECT_TRUE(engage());
  }
  [[nodiscard]] JointLoads loads() const { return joint_loads(view.machine, setup.machine, kinematics); }
  Kinematics kinematics{setup.machine};
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
    const std::string words = direction_words(way.joint, way.end > 0);
    SCOPED_TRACE(words);
    Led led("free_motion");
    EXPECT_TRUE(ends_in_words(led.loads()).empty());
    led.keys.*way.key = true;
    led.run(9);
    for (int i = 0; i < 10; ++i, led.run(0.1))
      EXPECT_EQ(ends_in_words(led.loads()), std::vector<std::string>{words + ": at its end"})
          << led.view.machine.position_rad.transpose() << " led to " << led.view.hand.set_point_rad.transpose() << ", "
          << text(led.view.machine.blocking);
  }
}

TEST(LedByKeys, ABucketCurledToItsEndKeepsItsOilShutInAndPressesOnNothing) {
  Led led("free_motion");
  led.keys.bucket_in = true;
  led.run(9);
  led.keys = {};
  led.run(5);
  ASSERT_EQ(led.view.machine.mode, Mode::kReady);
  EXPECT_EQ(still_pressing(led.view, led.loads()), "");
  EXPECT_EQ(shut_in(led.view, led.loads()).rfind("oil shut in, bucket 20", 0), 0U) << shut_in(led.view, led.loads());
}

TEST(LedByKeys, AMachineThatPressesOnTheGroundIsSaidToPressThoughItsForceIsNotKnownAndAfterTheHandHasLetGo) {
  Led led("wall_contact");
  led.keys.boom_down = led.keys.arm_in = led.keys.bucket_in = true;
  led.run(7);
  ASSERT_EQ(led.view.machine.mode, Mode::kEngaged);
  ASSERT_FALSE(force_words(led.view).known) << "a cylinder is at its end stop";
  const BlindPress press = blind_press(led.view, led.loads());
  EXPECT_EQ(press.words.rfind("pressing; cannot be measured: ", 0), 0U) << press.words;
  EXPECT_NE(press.words.find("boom"), std::string::npos) << press.words;
  EXPECT_GT(press.least_N, 1000);
  EXPECT_TRUE(feels_end_of_range(led.view, led.setup.machine)) << "which is all that is felt of it";
  EXPECT_GT(led.view.hand.sent_force_N.norm(), 0.5);
  led.keys = {};
  led.run(10);
  ASSERT_EQ(led.view.machine.mode, Mode::kReady);
  const std::string still = still_pressing(led.view, led.loads());
  EXPECT_EQ(still.rfind("still pressing: ", 0), 0U) << still;
  EXPECT_NE(still.find("boom"), std::string::npos) << still;
}

}  // namespace
}  // namespace knuckle::console
