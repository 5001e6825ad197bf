// What the machine's side makes of messages that are late, of another run of either side, or urgent, told as stories.
#include <gtest/gtest.h>

#include <vector>

#include "tests/slave/leading.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;
using test::expect_neutral_within;
using test::kFast;
using test::LedMachine;

/// The farthest that any joint has been from where it was, while `story` runs.
template <typename Story>
double moved_rad(BenchMachine& m, Story&& story) {
  const JointVector before = m.angles();
  double most = 0;
  while (story()) most = std::max(most, (m.angles() - before).cwiseAbs().maxCoeff());
  return most;
}

// ------------------------------------------------------------------------------------- recordings of an earlier run

/// All that an operator's side sent from the start on until the machine was in full motion, 5 ms apart.
std::vector<Datagram> recording_of_a_session() {
  BenchMachine m;
  std::vector<Datagram> sent;
  const auto record = [&](Duration time) {
    for (const Time end = m.now + time; m.now < end;) {
      m.move(m.hand.velocity_radps, 5ms);
      sent.push_back(encode(m.hand));
    }
  };
  m.hand.presence = true;
  record(3s);
  m.hand.enable = true;
  m.align();
  record(200ms);
  m.hand.velocity_radps = kFast;
  record(2s);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged);
  return sent;
}

TEST(LinkStory, ARecordingOfAnEarlierRunMovesNothingOnAMachinesSideThatRestarted) {
  const std::vector<Datagram> recording = recording_of_a_session();
  BenchMachine m(test::test_machine(), {12, 3h});  // its clock begins where that of the earlier run began
  m.link_up = false;
  m.run(150ms);
  std::size_t next = 0;
  const double moved = moved_rad(m, [&] {
    if (next == recording.size()) return false;
    m.link.deliver(recording[next++]);
    m.run(5ms);
    EXPECT_NE(m.loop.mode(), Mode::kAligning) << next;
    EXPECT_FALSE(m.nodes.outputs().pilot);
    return m.loop.mode() != Mode::kEngaged;
  });
  EXPECT_EQ(m.loop.mode(), Mode::kReady);
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kLinkLost));
  EXPECT_EQ(m.loop.operator_input().message_at(), kNever);
  EXPECT_EQ(moved, 0);
}

TEST(LinkStory, PilotPressureIsForALivePeerOnly) {
  for (const Duration round_trip : {499ms, 501ms}) {
    BenchMachine m;
    m.round_trip = round_trip;
    const bool led = m.engage();
    EXPECT_EQ(led, round_trip == 499ms);
    EXPECT_EQ(m.nodes.outputs().pilot, led);
    if (led) continue;
    EXPECT_EQ(m.loop.mode(), Mode::kReady);
    EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kRoundTripTooLong));
  }
}

// --------------------------------------------------------------------------------------------------- age of commands

TEST(LinkStory, WaitingInTheKernelIsPartOfACommandsAge) {
  LedMachine m;
  m.waited = 3ms;
  m.master_clock = -3ms;
  m.run(5ms);
  EXPECT_EQ(m.now - m.loop.operator_input().message_at(), 3ms);
  m.hung = true;  // not long enough for a fault
  m.run(30ms);
  m.hung = false;
  m.waited = 30ms;
  m.master_clock = -30ms;
  m.run(5ms);
  EXPECT_EQ(m.now - m.loop.operator_input().message_at(), 30ms);
}

// The kernel's stamp is of a clock that may be set.
TEST(LinkStory, NothingWaitedForLongerThanSinceTheQueueWasEmpty) {
  LedMachine m;
  m.waited = 100ms;
  m.run(50ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged);
  EXPECT_EQ(m.now - m.loop.operator_input().message_at(), 5ms);
  EXPECT_EQ(m.loop.operator_input().set_point().authority, 1);
}

// A queue on the way fills: nothing is lost, and each message is newer than the one before, and later.
TEST(LinkStory, ACommandDelayedBeyondTheLossPolicyIsNoneHoweverNewItsNumber) {
  LedMachine m;
  m.link_up = false;
  const Time last = m.now;
  for (Duration late = 5ms; late <= 300ms; late += 5ms) {
    ++m.hand.stamp.sequence;
    m.hand.stamp.sent_at += 1us;
    m.link.deliver(encode(m.hand));
    m.run(5ms);
    const bool command = late <= 200ms;  // less some microseconds
    ASSERT_EQ(m.loop.operator_input().message().stamp.sequence == m.hand.stamp.sequence, command) << to_seconds(late);
    EXPECT_NEAR(to_seconds(m.now - m.loop.operator_input().message_at()), to_seconds(late), 1e-3);
    EXPECT_NEAR(m.loop.operator_input().set_point().authority, std::clamp((0.150 - to_seconds(late)) / 0.1, 0.0, 1.0),
                1e-3);
    EXPECT_EQ(m.loop.mode(), command ? Mode::kEngaged : Mode::kFault) << to_seconds(late);
  }
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kLinkLost));
  expect_neutral_within(m, last, 200ms);
}

TEST(LinkStory, DelayThatStaysIsNoLoss) {
  for (const Duration more : {60ms, 140ms}) {
    LedMachine m;
    m.master_clock -= more;  // from one message to the next
    m.round_trip += more;
    m.run(5ms);
    EXPECT_EQ(m.now - m.loop.operator_input().message_at(), more) << "the first of them are late";
    m.hand.velocity_radps.setZero();
    m.run(600ms);
    EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault());
    EXPECT_EQ(m.now - m.loop.operator_input().message_at(), 0ms);
    EXPECT_EQ(m.loop.operator_input().set_point().authority, 1);
  }
}

TEST(LinkStory, AStepOfTheOperatorsClockIsNoDelay) {
  for (const Duration step : {Duration(250ms), Duration(-250ms), Duration(10s), Duration(-10s)}) {
    LedMachine m;
    m.hand.velocity_radps.setZero();
    m.run(1s);
    m.master_clock += step;
    for (int i = 0; i < 200; ++i) {
      m.run(5ms);
      ASSERT_EQ(m.loop.mode(), Mode::kEngaged) << to_seconds(step) << " " << text(m.loop.fault());
      ASSERT_EQ(m.now, m.loop.operator_input().message_at());
    }
  }
}

// ------------------------------------------------------------------------------------------------- stop and release

TEST(LinkStory, AStopOrReleaseThatOnlyItsCountStillTellsIsObeyed) {
  for (const bool stop : {true, false}) {
    LedMachine m;
    const Time at = m.now;
    ++(stop ? m.hand.stops : m.hand.releases);  // pressed and let go again, or the other way round, in what was lost
    m.run(5ms);
    EXPECT_EQ(m.loop.mode(), stop ? Mode::kFault : Mode::kReady);
    if (stop) {
      EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kOperatorStop));
      m.run(2s);
      EXPECT_EQ(m.loop.mode(), Mode::kFault) << "enable is still held";
      expect_neutral_within(m, at, 15ms);
      EXPECT_TRUE(m.engage()) << "released and pressed again, it counts once: " << text(m.loop.blocking());
    }
  }
}

TEST(LinkStory, WhatWasStoppedBeforeThisSideWasHeardStopsNothingNow) {
  BenchMachine m;
  m.hand.stops = 3;
  m.hand.releases = 8;
  EXPECT_TRUE(m.engage()) << text(m.loop.blocking());
}

TEST(LinkStory, ALateStopIsObeyedAndALateCommandIsNot) {
  for (const bool stop : {true, false}) {
    LedMachine m;
    m.link_up = false;
    MasterMessage late = m.hand;
    ++(stop ? late.stops : late.releases);
    late.stamp.sequence += 1;
    late.stamp.sent_at -= 250ms;
    late.stamp.echoed -= 250ms;
    late.position_rad += JointVector(0.01, 0.01, 0.01);
    late.enable = true;
    const Time at = m.now;
    m.link.deliver(encode(late));
    m.run(5ms);
    EXPECT_NE(m.loop.operator_input().message().position_rad, late.position_rad);
    EXPECT_EQ(m.loop.mode(), stop ? Mode::kFault : Mode::kReady) << text(m.loop.blocking());
    m.run(100ms);
    EXPECT_EQ(m.loop.mode(), stop ? Mode::kFault : Mode::kReady) << "what was heard before does not undo it";
    expect_neutral_within(m, at, 15ms);
  }
}

TEST(LinkStory, AReleaseAndTheNextPressInOneStepAreARelease) {
  LedMachine m;
  ++m.hand.releases;
  m.link_up = false;
  for (int i = 0; i < 3; ++i) {
    ++m.hand.stamp.sequence;
    m.link.queue(encode(m.hand));
  }
  m.run(5ms);
  EXPECT_EQ(m.loop.mode(), Mode::kReady);
}

// ------------------------------------------------------------------------------------ set-points that no hand makes

struct Impossible {
  ReasonCode code;
  int joint;
  void (*make)(MasterMessage&);
};

TEST(LinkStory, SetPointThatNoHandMakesHoldsUntilEnableIsLetGo) {
  const Impossible cases[] = {
      {ReasonCode::kSetpointRange, kBoom, [](MasterMessage& m) { m.position_rad += JointVector(5, 5, 5); }},
      {ReasonCode::kSetpointSpeed, kBucket, [](MasterMessage& m) { m.velocity_radps[kBucket] = -40.1; }},
      {ReasonCode::kSetpointJump, kArm, [](MasterMessage& m) { m.position_rad[kArm] += 0.4; }},
      {ReasonCode::kSetpointJump, kArm, [](MasterMessage& m) { m.velocity_radps[kArm] = 39; }},
  };
  for (const Impossible& c : cases) {
    LedMachine m;
    const MasterMessage good = m.hand;
    const JointVector before = m.angles();
    c.make(m.hand);
    const Time at = m.now;
    m.run(5ms);
    EXPECT_EQ(m.loop.mode(), Mode::kHold);
    EXPECT_TRUE(test::is(m.loop.blocking(), c.code, c.joint));
    EXPECT_EQ(m.loop.commands(), JointVector(0, 0, 0));
    m.run(1s);
    m.hand.position_rad = good.position_rad;
    m.hand.velocity_radps.setZero();
    m.run(1s);
    EXPECT_EQ(m.loop.mode(), Mode::kHold) << "once is enough";
    EXPECT_TRUE(test::is(m.loop.blocking(), c.code));
    expect_neutral_within(m, at, 10ms);
    EXPECT_LT((m.angles() - before).cwiseAbs().maxCoeff(), 0.05) << "what was on its way";
    m.hand.enable = false;
    m.run(100ms);
    EXPECT_EQ(m.loop.mode(), Mode::kReady);
    EXPECT_TRUE(test::engages_anew(m));
  }
}

TEST(LinkStory, ExtrapolatingLeadsNotBeyondTheWorkingRange) {
  LedMachine m;
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
