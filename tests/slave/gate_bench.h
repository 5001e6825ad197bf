// The two gates with an ordinary state in front of them: each test changes the one value that its rule looks at.
#pragma once

#include <gtest/gtest.h>

#include <limits>

#include "slave/safety_gate.h"
#include "tests/slave/reasons.h"
#include "tests/slave/test_machine.h"

namespace knuckle::slave {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInf = std::numeric_limits<double>::infinity();

inline JointVector only(int joint, double value) {
  JointVector v = JointVector::Zero();
  v[joint] = value;
  return v;
}

/// Of a gate that lets nothing pass. @return why
inline Reason refusal_of(const GateResult& result, Time now) {
  EXPECT_EQ(result.commands, JointVector(0, 0, 0));
  EXPECT_EQ(result.memory.sent, JointVector(0, 0, 0));
  EXPECT_EQ(result.memory.at, now) << "neutral was sent now: no credit for opening builds up meanwhile";
  return result.fault;
}

using test::expect_reason;

class GateBench : public ::testing::Test {
 protected:
  GateBench() {
    place(JointVector(0.3, -1.5, -0.8));
    state.valid = true;
    state.pressure_Pa = {60e5, 20e5, 50e5, 25e5, 40e5, 20e5};
    state.oldest_at = now;
    state.oldest_subject = 0x23;
    memory = {JointVector(1, 1, 1), now - 5ms};
  }
  void place(const JointVector& angle) {
    state.angle_rad = angle;
    for (int i = 0; i < kJoints; ++i) state.lever_m[i] = limits.kinematics.cylinder_at(i, angle[i]).value().lever_m;
  }
  /// As if these commands had been sent long enough: the rate rule is out of the way.
  GateResult gate(const JointVector& wanted, Mode mode = Mode::kEngaged) {
    memory.sent = wanted.array().isFinite().select(wanted, 0);
    return gate_from_memory(wanted, mode);
  }
  GateResult gate_from_memory(const JointVector& wanted, Mode mode = Mode::kEngaged) const {
    return safety_gate(wanted, mode, setpoint_at, state, memory, limits, now);
  }
  Reason refused(const JointVector& wanted = {0.2, 0.2, 0.2}, Mode mode = Mode::kEngaged) {
    return refusal_of(gate(wanted, mode), now);
  }
  void remake(const MachineDescription& machine) { limits = GateLimits(machine); }

  Time now = Time(10s);
  Time setpoint_at = now;
  GateLimits limits{test::test_machine()};
  GateState state;
  GateMemory memory;
};

/// A motion of the arm, begun a second ago.
class JogGateBench : public ::testing::Test {
 protected:
  JogGateBench() {
    state.joint = kArm;
    state.since = now - 1s;
    state.pressure_Pa.fill(100e5);
    state.oldest_at = now;
    state.oldest_subject = 0x23;
  }
  /// As if this command had been sent long enough: the rate rule is out of the way.
  GateResult gate(const JointVector& wanted) {
    memory.sent = wanted.array().isFinite().select(wanted, 0);
    return gate_from_memory(wanted);
  }
  GateResult gate_from_memory(const JointVector& wanted) const { return jog_gate(wanted, state, memory, limits, now); }

  Time now = Time(100s);
  GateLimits limits{test::test_machine()};
  JogState state;
  GateMemory memory{only(kArm, 0.3), now - 5ms};
};

}  // namespace knuckle::slave
