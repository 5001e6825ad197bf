// A joint's position against the pilot pressures of its spool: which of the two is wrong.
#include "slave/pilot_or_position.h"

#include <gtest/gtest.h>

#include "machine/reason_text.h"
#include "tests/support/command_machine.h"

namespace knuckle::slave {
namespace {

constexpr double kShut_Pa = 1e5, kOpen_Pa = 20e5;

/// The arm, in steps of 5 ms.
struct Arm {
  explicit Arm(const std::string& commands, const std::string& state = test::state_with_pilots())
      : machine(parse_machine(test::command_text(commands, state), "m.toml")) {}
  void step(double demand, double extend_Pa, double retract_Pa, double time_s) {
    Piloting piloting{.demand = JointVector(0, demand, 0)};
    piloting.pressure_Pa[2 * kArm] = extend_Pa;
    piloting.pressure_Pa[2 * kArm + 1] = retract_Pa;
    for (double t = 0; t < time_s; t += 5e-3) wrong.step(piloting);
  }
  [[nodiscard]] std::string named(std::uint8_t subject) const {
    return subject_text(Reason{ReasonCode::kSensorImplausible, subject}, machine.bus);
  }
  [[nodiscard]] std::string of_open(int direction) const { return named(wrong.of_open(kArm, direction)); }
  [[nodiscard]] std::string of_shut(int direction) const { return named(wrong.of_shut(kArm, direction)); }
  MachineDescription machine;
  PilotOrPosition wrong{machine, 5e-3};
};

constexpr const char *kAngle = "front_angle (0x18FF1021), arm_angle",
                     *kExtend = "pilot_pressure (0x18FF5021), arm_extend_pilot",
                     *kRetract = "pilot_pressure (0x18FF5021), arm_retract_pilot";

/// Of a machine that is led by joint speeds, or by pilot pressures.
class PilotOrPositionOf : public testing::TestWithParam<bool> {
 protected:
  [[nodiscard]] static const char* commands() { return GetParam() ? test::kRateCommands : test::kPilotCommands; }
};

TEST_P(PilotOrPositionOf, AnOpenSpoolThatWasAskedForNamesThePosition) {
  for (const double demand : {0.3, 1.0}) {
    Arm arm(commands());
    arm.step(demand, kOpen_Pa, 0, 2);
    EXPECT_EQ(arm.of_open(1), kAngle) << "however steady the pressure is";
    arm.step(-demand, 0, kOpen_Pa, 2);
    EXPECT_EQ(arm.of_open(-1), kAngle);
  }
}

TEST_P(PilotOrPositionOf, AnOpenSpoolThatNobodyAskedForNamesTheReading) {
  Arm arm(commands());
  arm.step(1, kOpen_Pa, 0, 2);
  arm.step(0, kOpen_Pa, 0, 0.095);
  EXPECT_EQ(arm.of_open(1), kAngle) << "a pressure that falls";
  arm.step(0, kOpen_Pa, 0, 0.02);
  EXPECT_EQ(arm.of_open(1), kExtend);
  arm.step(-1, kOpen_Pa, 0, 0.2);
  EXPECT_EQ(arm.of_open(1), kExtend) << "the other way was";
  arm.step(0, 0, kOpen_Pa, 0.2);
  EXPECT_EQ(arm.of_open(-1), kRetract);
}

TEST_P(PilotOrPositionOf, AMotionThatNobodyAskedForNamesThePosition) {
  Arm arm(commands());
  arm.step(0, kShut_Pa, kShut_Pa, 0.5);
  EXPECT_EQ(arm.of_shut(1), kAngle);
  EXPECT_EQ(arm.of_shut(-1), kAngle);
}

TEST_P(PilotOrPositionOf, AMotionThatWasAskedForNamesTheReadingThatShutsTheSpool) {
  Arm arm(commands());
  arm.step(1, kShut_Pa, kShut_Pa, 0.5);
  EXPECT_EQ(arm.of_shut(1), kExtend) << "it does not open";
  arm.step(1, kOpen_Pa, kOpen_Pa, 0.5);
  EXPECT_EQ(arm.of_shut(1), kRetract) << "it holds against one that does";
  arm.step(-1, kOpen_Pa, kOpen_Pa, 0.5);
  EXPECT_EQ(arm.of_shut(-1), kExtend);
}

TEST_P(PilotOrPositionOf, WithoutPilotPressuresItIsThePosition) {
  Arm arm(commands(), test::kStateBroadcast);
  arm.step(0, kOpen_Pa, 0, 1);
  EXPECT_EQ(arm.of_open(1), kAngle);
  EXPECT_EQ(arm.of_shut(1), kAngle);
}

INSTANTIATE_TEST_SUITE_P(Kinds, PilotOrPositionOf, testing::Bool(),
                         [](const auto& kind) { return kind.param ? "JointRate" : "PilotPressure"; });

}  // namespace
}  // namespace knuckle::slave
