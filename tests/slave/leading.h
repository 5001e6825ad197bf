// A machine that is led, and how soon it stands still.
#pragma once

#include <gtest/gtest.h>

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

/// Every valve was commanded neutral within `limit` of `since`, and stayed so.
inline void expect_neutral_within(const BenchMachine& m, Time since, Duration limit) {
  for (int i = 0; i < kJoints; ++i) {
    const Time neutral = m.command_neutral_since(since, i);
    ASSERT_NE(neutral, kNever) << kJointNames[static_cast<std::size_t>(i)];
    EXPECT_LE(to_seconds(neutral - since), to_seconds(limit)) << kJointNames[static_cast<std::size_t>(i)];
  }
}

}  // namespace knuckle::test
