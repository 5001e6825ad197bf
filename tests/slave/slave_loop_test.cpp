// The machine's side as a whole against the simulated nodes, told as stories; times to neutral are read off the wire.
#include "slave/slave_loop.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/slave/leading.h"
#include "tests/support/no_alloc.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;
using test::expect_neutral_within;
using test::kFast;
using test::LedMachine;

TEST(SlaveLoop, OperatorTakesOverAndTheMachineFollowsTheHand) {
  BenchMachine m;
  ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
  const JointVector before = m.angles();
  m.move(kFast, 1s);
  const JointVector moved = m.angles() - before;
  // The bench's loads stay those of the pose in which it was switched on: direction and rough size only.
  for (int i = 0; i < kJoints; ++i) {
    EXPECT_GT(moved[i] / kFast[i], 0.3) << i;
    EXPECT_LT(moved[i] / kFast[i], 1.3) << i;
  }
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged);
  const SlaveMessage& told = m.link.last().value();
  EXPECT_EQ(told.mode, Mode::kEngaged);
  EXPECT_LT((told.position_rad - m.angles()).norm(), 0.02);
  EXPECT_GT(told.ahead_rad.cwiseProduct(kFast).minCoeff(), 0) << "the machine trails";
  EXPECT_LE(m.now - told.stamp.echoed, 10ms);
}

TEST(SlaveLoop, NothingMovesBeforeItIsEngaged) {
  BenchMachine m;
  m.hand.presence = m.hand.enable = true;  // held from the beginning: does not count
  m.hand.position_rad += JointVector(0.5, 0.5, 0.5);
  m.run(3s);
  EXPECT_EQ(m.loop.mode(), Mode::kReady);
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kEnableHeld));
  for (int i = 0; i < kJoints; ++i) {
    for (const CanFrame& f : m.frames(canopen::rpdo1_id(static_cast<std::uint8_t>(0x10 + i)))) {
      EXPECT_EQ(canopen::parse_valve_command(f)->set_point, 0);
    }
  }
  EXPECT_FALSE(m.nodes.outputs().pilot);
}

TEST(SlaveLoop, LinkCutEndsNeutralWithinTheDesignsTimesAndNothingResumes) {
  LedMachine m;
  const Time cut = m.now;
  m.link_up = false;
  m.run(400ms);
  EXPECT_TRUE(m.faulted(ReasonCode::kLinkLost));
  expect_neutral_within(m, cut, 200ms);
  m.link_up = true;
  m.align();
  m.run(2s);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  expect_neutral_within(m, cut, 200ms);
  EXPECT_TRUE(test::engages_anew(m));
}

/// What the operator's side sends while it lasts, to be delivered again later.
std::vector<MasterMessage> sent_while(BenchMachine& m, Duration time) {
  std::vector<MasterMessage> sent;
  for (const Time end = m.now + time; m.now < end;) {
    m.move(kFast, 5ms);
    sent.push_back(m.hand);
  }
  return sent;
}

TEST(SlaveLoop, LateCopiesEndNoOutage) {
  LedMachine m;
  const auto sent = sent_while(m, 250ms);
  const Time cut = m.now;
  const MasterMessage newest = m.loop.operator_input().message();
  m.link_up = false;
  for (const MasterMessage& copy : sent) {  // 250 ms late, one a step
    m.link.deliver(encode(copy));
    m.run(5ms);
    EXPECT_EQ(m.loop.operator_input().message().stamp.sequence, newest.stamp.sequence);
    EXPECT_EQ(m.loop.operator_input().message().position_rad, newest.position_rad);
  }
  EXPECT_TRUE(m.faulted(ReasonCode::kLinkLost));
  expect_neutral_within(m, cut, 200ms);
  m.link_up = true;
  m.align();
  m.run(2s);
  EXPECT_EQ(m.loop.mode(), Mode::kFault) << "enable is still held";
}

// The next packet comes in exactly when the outage has lasted that long, and is a good one.
TEST(SlaveLoop, OutageAsLongAsTheLimitLatchesAlsoInTheStepThatEndsIt) {
  for (const Duration outage : {195ms, 200ms, 205ms}) {
    LedMachine m;
    const Time last = m.loop.operator_input().message_at();
    m.link_up = false;
    while (m.now < last + outage - 5ms) m.run(5ms);
    m.link_up = true;
    m.run(5ms);
    ASSERT_EQ(m.loop.operator_input().message_at(), last + outage);
    m.run(100ms);
    EXPECT_EQ(m.loop.mode(), outage >= 200ms ? Mode::kFault : Mode::kEngaged) << to_seconds(outage);
    if (outage >= 200ms) {
      EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kLinkLost));
      expect_neutral_within(m, last, 200ms);
    }
  }
}

TEST(SlaveLoop, EchoOfASilentOperatorGrowsOld) {
  LedMachine m;
  const Time cut = m.now;
  m.link_up = false;
  m.run(400ms);
  EXPECT_LE(m.loop.message(m.now).stamp.echoed, cut + kMostHeld);
}

TEST(SlaveLoop, ANodeThatBreaksIsNamedAndEndsNeutralInTimeAndASingleSpikeDoesNot) {
  using sim::NodeFault;
  struct Broken {
    NodeFault fault;
    std::vector<int> nodes;
    Duration neutral_within;
  };
  // The enable node repeats its inputs every 50 ms only, and drops the pilot by itself meanwhile.
  for (const Broken& broken : {Broken{NodeFault::kSilent, {0x10, 0x12, 0x20, 0x25, 0x31, 0x38}, 60ms},
                               {NodeFault::kSilent, {0x40}, 260ms},
                               {NodeFault::kInvalid, {0x21, 0x30, 0x38}, 60ms},
                               {NodeFault::kBrokenWire, {0x30}, 200ms},
                               {NodeFault::kFrozen, {0x30}, 200ms}}) {
    for (const int id : broken.nodes) {
      LedMachine m;
      const Time at = m.now;
      ASSERT_TRUE(m.nodes.inject(static_cast<std::uint8_t>(id), broken.fault));
      m.move(kFast, 400ms);
      EXPECT_EQ(m.loop.mode(), Mode::kFault) << id;
      EXPECT_EQ(m.loop.fault().subject, id) << text(m.loop.fault());
      expect_neutral_within(m, at, broken.neutral_within);
    }
  }
  LedMachine m;
  ASSERT_TRUE(m.nodes.inject(0x32, NodeFault::kSpike));
  m.run(200ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault());
}

TEST(SlaveLoop, WayMadeDuringASensorGapIsNeitherSpeedNorForce) {
  BenchMachine m;
  ASSERT_TRUE(m.reaches(Mode::kReady, 4s));
  m.run(2s);
  const JointVector torque = m.loop.force().fast_torque_Nm;
  ASSERT_TRUE(m.nodes.inject(0x30, sim::NodeFault::kSilent));
  m.run(60ms);
  m.signals.cylinder_m[kBoom] += 0.015;
  m.nodes.inject(0x30, sim::NodeFault::kNone);
  for (int i = 0; i < 100; ++i) {
    m.run(5ms);
    ASSERT_LT((m.loop.force().fast_torque_Nm - torque).norm(), 700) << i;  // gravity of another pose
    ASSERT_LT(m.loop.newest_state().rate_radps.norm(), 0.05) << i;
  }
  EXPECT_NEAR(m.loop.state()->angle_rad[kBoom], m.angles()[kBoom], 1e-3);
}

TEST(SlaveLoop, StuckValveEndsNeutral) {
  LedMachine m;
  const Time at = m.now;
  ASSERT_TRUE(m.nodes.inject(0x11, sim::NodeFault::kStuck));
  m.move(-kFast, 600ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(m.loop.fault()) << "by the enable node or by the loop's own watch, whichever is first";
  EXPECT_FALSE(m.nodes.outputs().pilot);
  expect_neutral_within(m, at, 400ms);
}

TEST(SlaveLoop, SpoolThatStaysOpenIsAFaultWithoutPilotPressureToo) {
  BenchMachine m;
  m.hand.presence = true;
  ASSERT_TRUE(m.reaches(Mode::kReady, 4s));
  m.blocked[kArm] = true;  // nothing moves it yet
  m.jammed[kArm] = 0.3;
  m.run(400ms);
  EXPECT_TRUE(m.faulted(ReasonCode::kValveNotFollowing, kArm));
  for (int i = 0; i < 3; ++i) {  // however often it is tried
    m.hand.enable = false;
    m.run(200ms);
    m.hand.enable = true;
    m.align();
    m.run(500ms);
    EXPECT_FALSE(m.nodes.outputs().pilot);
    EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kValveNotFollowing));
  }
  m.jammed[kArm].reset();
  m.run(500ms);
  EXPECT_TRUE(m.engage()) << text(m.loop.blocking());
}

TEST(SlaveLoop, PilotPressureThatNobodyAskedForIsAFault) {
  BenchMachine m;
  m.hand.presence = true;
  ASSERT_TRUE(m.reaches(Mode::kReady, 4s));
  const std::uint32_t id = m.description.bus.enable().tpdo_id();
  const auto stays_on = [&](Duration time) {  // a relay that is welded shut: said in place of what the node would say
    m.nodes.node(m.description.bus.enable().id)->replace(canopen::kTpdo1CobId, id | canopen::kPdoDisabled);
    for (const Time end = m.now + time; m.now < end;) {
      ASSERT_TRUE(
          m.bus.port(1).send(canopen::enable_inputs_frame(id, canopen::kInputEStopClosed | canopen::kInputPilotOn)));
      m.run(50ms);
    }
  };
  stays_on(900ms);
  EXPECT_EQ(m.loop.mode(), Mode::kReady) << "it may take a moment to fall";
  stays_on(300ms);
  EXPECT_TRUE(m.faulted(ReasonCode::kPilotStaysOn));
  m.hand.enable = true;
  m.align();
  stays_on(300ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault) << "no way in";
  m.nodes.node(m.description.bus.enable().id)->replace(canopen::kTpdo1CobId, id);
  m.run(500ms);
  EXPECT_TRUE(m.engage()) << text(m.loop.blocking());
}

TEST(SlaveLoop, HungLoopIsAFaultWhenItComesBack) {
  LedMachine m;
  m.hung = true;
  m.run(300ms);
  EXPECT_NEAR(m.signals.spool.cwiseAbs().maxCoeff(), 0, 0.02) << "the valves' own watchdogs";
  m.hung = false;
  m.run(20ms);
  EXPECT_TRUE(m.faulted(ReasonCode::kLoopOverrun));
}

TEST(SlaveLoop, EStopDropsEverythingAndCanBeLeftOnPurposeOnly) {
  LedMachine m;
  const Time at = m.now;
  m.nodes.set_estop(true);
  m.run(300ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop);
  expect_neutral_within(m, at, 20ms);
  m.nodes.set_estop(false);
  m.run(2s);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop);
  EXPECT_TRUE(test::engages_anew(m));
}

TEST(SlaveLoop, NodeThatComesBackIsSetUpAgainOnceTheOperatorLetsGo) {
  for (const int node : {0x11, 0x30}) {
    LedMachine m;
    const auto id = static_cast<std::uint8_t>(node);
    m.nodes.inject(id, sim::NodeFault::kSilent);
    m.run(500ms);
    ASSERT_EQ(m.loop.mode(), Mode::kFault);
    m.nodes.inject(id, sim::NodeFault::kNone);
    m.run(3s);
    EXPECT_EQ(m.loop.client().phase(), CanopenClient::Phase::kFailed) << "enable is still held";
    m.hand.enable = false;
    m.run(3s);
    EXPECT_TRUE(m.loop.client().operational()) << text(m.loop.client().fault());
    EXPECT_TRUE(test::engages_anew(m));
  }
}

/// Other sensors go on: their frames are no sign that pose and force are of now.
TEST(SlaveLoop, WhatIsMeasuredIsAsOldAsItsFramesOnceOneSensorIsSilent) {
  LedMachine m;
  const auto age = [&m] { return m.link.last()->stamp.sent_at - m.link.last()->sensor_at; };
  m.run(100ms);
  EXPECT_LT(age(), 10ms);
  constexpr std::uint8_t kPressure = 0x22;
  m.nodes.inject(kPressure, sim::NodeFault::kSilent);
  m.run(1s);
  ASSERT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_GT(age(), 900ms);
  m.nodes.inject(kPressure, sim::NodeFault::kNone);
  m.hand.enable = false;
  m.run(1s);
  EXPECT_LT(age(), 10ms);
}

TEST(SlaveLoop, DeadLinkWithNonsenseOnItCountsAsLost) {
  LedMachine m;
  m.link_up = false;
  const Time at = m.now;
  for (int i = 0; i < 60; ++i) {
    Datagram noise;
    noise.size = 100;
    noise.bytes.fill(static_cast<std::uint8_t>(i));
    m.link.deliver(noise);
    m.run(5ms);
  }
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kLinkLost));
  EXPECT_GE(m.loop.operator_input().malformed(), 50U);
  expect_neutral_within(m, at, 200ms);
}

TEST(SlaveLoop, StepAllocatesNothingOverAWholeSession) {
  BenchMachine m;
  m.recording = false;
  const test::NoAllocScope scope;
  m.engage();
  m.move(kFast, 500ms);
  m.nodes.inject(0x21, sim::NodeFault::kSilent);
  m.run(3s);
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace knuckle::slave
