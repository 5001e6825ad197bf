// Set-points that no hand makes lead the machine nowhere.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/slave/leading.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;
using test::expect_neutral_within;
using test::lead;

struct Impossible {
  ReasonCode code;
  int joint;
  void (*make)(MasterMessage&);
};

TEST(SlaveLoop, SetPointThatNoHandMakesHoldsUntilEnableIsLetGo) {
  const Impossible cases[] = {
      {ReasonCode::kSetpointRange, kBoom, [](MasterMessage& m) { m.position_rad += JointVector(5, 5, 5); }},
      {ReasonCode::kSetpointRange, kBoom, [](MasterMessage& m) { m.position_rad -= JointVector(5, 5, 5); }},
      {ReasonCode::kSetpointSpeed, kBoom, [](MasterMessage& m) { m.velocity_radps.setConstant(200); }},
      {ReasonCode::kSetpointSpeed, kBucket, [](MasterMessage& m) { m.velocity_radps[kBucket] = -40.1; }},
      {ReasonCode::kSetpointJump, kArm, [](MasterMessage& m) { m.position_rad[kArm] += 0.4; }},
      {ReasonCode::kSetpointJump, kArm, [](MasterMessage& m) { m.velocity_radps[kArm] = 39; }},
  };
  for (const Impossible& c : cases) {
    BenchMachine m;
    lead(m);
    const MasterMessage good = m.hand;
    const JointVector before = m.angles();
    c.make(m.hand);
    const Time at = m.now;
    m.run(5ms);
    EXPECT_EQ(m.loop.mode(), Mode::kHold);
    EXPECT_EQ(m.loop.blocking().code, c.code) << text(m.loop.blocking());
    EXPECT_EQ(m.loop.blocking().subject, c.joint);
    EXPECT_EQ(m.loop.commands(), JointVector(0, 0, 0));
    m.run(1s);
    m.hand.position_rad = good.position_rad;
    m.hand.velocity_radps.setZero();
    m.run(1s);
    EXPECT_EQ(m.loop.mode(), Mode::kHold) << "once is enough";
    EXPECT_EQ(m.loop.blocking().code, c.code);
    expect_neutral_within(m, at, 10ms);
    EXPECT_LT((m.angles() - before).cwiseAbs().maxCoeff(), 0.05) << "what was on its way";
    m.hand.enable = false;
    m.run(50ms);
    EXPECT_EQ(m.loop.mode(), Mode::kReady);
    m.align();
    m.hand.enable = true;
    EXPECT_TRUE(m.reaches(Mode::kEngaged, 1s)) << text(m.loop.blocking());
  }
}

TEST(SlaveLoop, SpeedThatIsNotThatOfThePositionLeadsNowhere) {
  for (const double rate : {0.6, -2.0, 20.0}) {
    BenchMachine m;
    ASSERT_TRUE(m.engage());
    const JointVector before = m.angles();
    m.hand.velocity_radps[kBoom] = rate;
    m.run(3s);
    EXPECT_EQ(m.loop.mode(), Mode::kHold) << rate;
    EXPECT_EQ(m.loop.blocking().code, ReasonCode::kSetpointJump);
    EXPECT_LT(std::abs(m.angles()[kBoom] - before[kBoom]), 0.25) << rate;
  }
}

TEST(SlaveLoop, ExtrapolatingLeadsNotBeyondTheWorkingRange) {
  BenchMachine m;
  lead(m);
  const double end = m.description.links[kBucket].max_rad;
  m.hand.position_rad[kBucket] = end - 0.01;  // where it cannot be, but nothing acts on it here
  m.hand.velocity_radps[kBucket] = 30;
  m.run(5ms);
  m.link_up = false;
  for (int i = 0; i < 20; ++i) {
    m.run(5ms);
    EXPECT_LE(m.loop.operator_input().set_point().position_rad[kBucket], end + 0.0175);
  }
}

}  // namespace
}  // namespace knuckle::slave
