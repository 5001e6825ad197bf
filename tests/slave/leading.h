// A machine that is led, and how soon it stands still.
#pragma once

#include <gtest/gtest.h>

#include "slave/orderly_stop.h"
#include "tests/slave/bench_machine.h"

namespace knuckle::test {

inline const JointVector kFast(0.25, -0.25, -0.3);

/// Engages, moves for a while, and forgets what was on the wire so far.
inline void lead(BenchMachine& m) {
  ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
  m.wire.clear();
  m.move(kFast, 400ms);
  ASSERT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault());
  ASSERT_GT(m.loop.commands().cwiseAbs().minCoeff(), 0.12);
}

struct LedMachine : BenchMachine {
  LedMachine() { lead(*this); }
};

/// Every valve was commanded neutral within `limit` of `since`, and stayed so.
inline void expect_neutral_within(const BenchMachine& m, Time since, Duration limit) {
  for (int i = 0; i < kJoints; ++i) {
    const Time neutral = m.command_neutral_since(since, i);
    ASSERT_NE(neutral, kNever) << kJointNames[static_cast<std::size_t>(i)];
    EXPECT_LE(to_seconds(neutral - since), to_seconds(limit)) << kJointNames[static_cast<std::size_t>(i)];
  }
}

/// What answers a question to the operator.
inline void press_and_release(BenchMachine& m) {
  m.hand.enable = true;
  m.run(100ms);
  m.hand.enable = false;
  m.run(100ms);
}

/// Enable is let go of and pressed anew, the hand on the machine.
inline testing::AssertionResult engages_anew(BenchMachine& m) {
  m.hand.enable = false;
  m.run(100ms);
  m.hand.enable = true;
  m.align();
  return testing::AssertionResult(m.reaches(Mode::kEngaged, 1s)) << text(m.loop.blocking());
}

/// Without its loop, until it is out of service. @return how long that took
inline Duration take_out_of_service(BenchMachine& m, slave::OrderlyStop& stop) {
  m.hung = true;
  const Time since = m.now;
  for (int i = 0; i < 1000 && !stop.done(); ++i) {
    stop.step(m.now);
    m.run(5ms);
  }
  EXPECT_TRUE(stop.done());
  return m.now - since;
}

}  // namespace knuckle::test
