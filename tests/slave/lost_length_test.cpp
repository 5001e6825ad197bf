// A cylinder length that was doubtful for a while counts again only after enable was pressed and let go.
#include <gtest/gtest.h>

#include "tests/slave/leading.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;
using test::kFast;
using test::LedMachine;

/// Ready, with a hand on the device.
void wait_until_ready(BenchMachine& m) {
  m.hand.presence = true;
  ASSERT_TRUE(m.reaches(Mode::kReady, 4s)) << text(m.loop.blocking());
}

void expect_shown(const BenchMachine& m, ReasonCode code, const char* why = "") {
  EXPECT_TRUE(test::is(m.loop.blocking(), code)) << why;
}
/// The press and release of enable were the answer: the length counts, and nothing goes on by itself.
void expect_answered(const BenchMachine& m) {
  expect_shown(m, ReasonCode::kEnableNotPressed);
  EXPECT_EQ(m.loop.mode(), Mode::kFault) << "nothing goes on by itself";
  EXPECT_NEAR(m.loop.state()->angle_rad[kBoom], m.angles()[kBoom], 1e-3);
}

/// A press and a release of enable answer what is shown, and nothing else: pressed is half an answer.
void answer(BenchMachine& m) {
  m.hand.enable = true;
  m.run(100ms);
  expect_shown(m, ReasonCode::kLengthElsewhere, "pressed");
  m.hand.enable = false;
  m.run(20ms);
}
void expect_elsewhere(const BenchMachine& m, int node) {
  expect_shown(m, ReasonCode::kLengthElsewhere);
  EXPECT_EQ(m.loop.blocking().subject, node) << text(m.loop.blocking());
}

TEST(SlaveLoop, EncoderThatWakesFarFromWhereItFrozeCountsAgainOnlyAfterEnableWasPressedAndLetGo) {
  LedMachine m;
  ASSERT_TRUE(m.nodes.inject(0x30, sim::NodeFault::kFrozen));
  m.move(kFast, 400ms);
  ASSERT_EQ(m.loop.mode(), Mode::kFault);
  m.signals.cylinder_m[kBoom] += 0.04;
  m.nodes.inject(0x30, sim::NodeFault::kNone);
  m.align();
  m.run(3s);  // enable is still held
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  expect_elsewhere(m, 0x30);
  m.hand.enable = false;  // let go of in fright: no answer to anything
  m.run(3s);
  expect_shown(m, ReasonCode::kLengthElsewhere);
  m.hand.enable = true;
  m.run(100ms);
  m.hand.enable = false;
  m.hand.presence = false;  // nobody there: nobody let go
  m.run(3s);
  m.hand.presence = true;
  m.run(3s);
  expect_shown(m, ReasonCode::kLengthElsewhere);
  m.hand.enable = true;
  m.run(3s);
  expect_shown(m, ReasonCode::kLengthElsewhere);
  m.hand.enable = false;
  m.run(20ms);
  expect_answered(m);
  m.hand.enable = true;
  m.align();
  EXPECT_TRUE(m.reaches(Mode::kEngaged, 1s)) << text(m.loop.blocking());
}

TEST(SlaveLoop, DrumThatSlipsWhileTheMachineIsReadyIsNotBelievedBeforeEnableWasPressedAndLetGo) {
  BenchMachine m;
  ASSERT_NO_FATAL_FAILURE(wait_until_ready(m));
  m.run(500ms);
  m.hand.enable = true;  // a press and a release before the fault say nothing of it
  m.run(50ms);
  m.hand.enable = false;
  m.run(500ms);
  ASSERT_EQ(m.loop.mode(), Mode::kReady);
  const double before = m.loop.state()->angle_rad[kBoom];
  m.signals.cylinder_m[kBoom] += 0.04;
  m.run(10s);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  expect_elsewhere(m, 0x30);
  EXPECT_NEAR(m.loop.state()->angle_rad[kBoom], before, 1e-3);
  answer(m);
  expect_answered(m);
  // The act was for that slip alone: the next one asks for its own.
  m.signals.cylinder_m[kBoom] += 0.04;
  m.run(3s);
  expect_shown(m, ReasonCode::kLengthElsewhere);
}

TEST(SlaveLoop, EncoderNodeThatComesBackElsewhereCountsOnlyAfterEnableWasPressedAndLetGoOnceItIsBack) {
  LedMachine m;
  m.nodes.inject(0x30, sim::NodeFault::kSilent);
  m.run(500ms);
  ASSERT_EQ(m.loop.client().phase(), CanopenClient::Phase::kFailed);
  for (const bool pressed : {false, true, false}) {  // while the node is away: answers nothing
    m.hand.enable = pressed;
    m.run(500ms);
  }
  m.signals.cylinder_m[kBoom] += 0.04;
  m.nodes.inject(0x30, sim::NodeFault::kNone);
  m.run(5s);
  ASSERT_TRUE(m.loop.client().operational()) << text(m.loop.client().fault());
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  expect_elsewhere(m, 0x30);
  answer(m);
  expect_answered(m);
}

TEST(SlaveLoop, LengthThatJumpsDuringTheSelfTestCanBeAnsweredForThere) {
  BenchMachine m;
  m.hand.presence = true;
  ASSERT_TRUE(m.nodes.inject(0x31, sim::NodeFault::kInvalid));  // keeps the self test from ending
  m.run(4s);
  ASSERT_EQ(m.loop.mode(), Mode::kSelfTest) << text(m.loop.blocking());
  m.signals.cylinder_m[kBoom] += 0.04;
  m.run(3s);
  m.nodes.inject(0x31, sim::NodeFault::kNone);
  m.run(3s);
  EXPECT_EQ(m.loop.mode(), Mode::kSelfTest);
  expect_elsewhere(m, 0x30);
  answer(m);
  EXPECT_EQ(m.loop.mode(), Mode::kReady) << text(m.loop.blocking());
  EXPECT_NEAR(m.loop.state()->angle_rad[kBoom], m.angles()[kBoom], 1e-3);
}

TEST(SlaveLoop, LengthIsNotBelievedByAPressWhileTheEStopIsWhatIsShown) {
  BenchMachine m;
  ASSERT_NO_FATAL_FAILURE(wait_until_ready(m));
  m.nodes.set_estop(true);
  m.run(100ms);
  m.signals.cylinder_m[kBoom] += 0.04;
  m.run(3s);
  ASSERT_TRUE(test::is(m.loop.blocking(), ReasonCode::kEmergencyStop));
  test::press_and_release(m);
  m.nodes.set_estop(false);
  m.run(100ms);
  expect_shown(m, ReasonCode::kLengthElsewhere);
  answer(m);
  expect_shown(m, ReasonCode::kEnableNotPressed);
}

TEST(SlaveLoop, EachLengthThatJumpedIsShownAndAnsweredForByItself) {
  BenchMachine m;
  ASSERT_NO_FATAL_FAILURE(wait_until_ready(m));
  m.signals.cylinder_m[kBoom] += 0.04;
  m.signals.cylinder_m[kArm] += 0.03;
  m.run(3s);
  for (const int node : {0x30, 0x31}) {
    expect_elsewhere(m, node);
    answer(m);
  }
  expect_shown(m, ReasonCode::kEnableNotPressed);
}

TEST(SlaveLoop, DrumThatSlipsOnWhileEnableIsPressedIsAskedAboutAnew) {
  BenchMachine m;
  ASSERT_NO_FATAL_FAILURE(wait_until_ready(m));
  m.signals.cylinder_m[kBoom] += 0.04;
  m.run(3s);
  m.hand.enable = true;
  m.run(100ms);
  m.signals.cylinder_m[kBoom] += 0.06;
  m.run(3s);
  m.hand.enable = false;
  m.run(20ms);
  expect_shown(m, ReasonCode::kLengthElsewhere);
  EXPECT_NEAR(m.loop.blocking().value, 100, 1);
}

}  // namespace
}  // namespace knuckle::slave
