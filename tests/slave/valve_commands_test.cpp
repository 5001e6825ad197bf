// A machine that is led by auxiliary valves of ISO 11783-7, from wire to wire.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>

#include "machine/reason_text.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/j1939_machine.h"
#include "transport/j1939.h"

namespace knuckle::slave {
namespace {

constexpr std::array kValves{0x0CFE3326U | kExtendedId, 0x0CFE3026U | kExtendedId, 0x0CFE3F26U | kExtendedId};

struct ValveMachine : test::BenchMachine {
  ValveMachine() : BenchMachine(calibrated(test::valves_machine())) {
    signals.shaft_rad = JointVector(0.3, -1.5, -0.8);
  }
  [[nodiscard]] std::string fault() const { return text_with_code(loop.fault(), description.bus); }
  /// Of all commands since the last call: how many, and how many are not blocked.
  struct Said {
    int all = 0, open = 0;
  };
  Said said() {
    Said said;
    for (const auto& [at, frame] : wire) {
      if (std::find(kValves.begin(), kValves.end(), frame.id) == kValves.end()) continue;
      ++said.all;
      const int state = frame.data[2] & 0xF;
      EXPECT_LE(state, 2) << "float, or none";
      EXPECT_EQ(state == 0, frame.data[0] == 0);
      said.open += state == 0 ? 0 : 1;
    }
    wire.clear();
    return said;
  }
};

TEST(ValveMachine, FollowsTheHandAndIsBlockedWhereNobodyLeads) {
  ValveMachine m;
  ASSERT_TRUE(m.engage()) << m.fault();
  const JointVector from = m.angles();
  (void)m.said();
  m.move(JointVector(0.1, -0.1, 0.15), 2s);
  const auto moving = m.said();
  EXPECT_NEAR(moving.all, 2 * (50 + 100 + 50), 8) << "each 20 and 10 ms, and more where a joint stops";
  EXPECT_GT(moving.open, 100);
  m.move(JointVector::Zero(), 1500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
  const JointVector went = m.angles() - from, wanted(0.2, -0.2, 0.3);
  for (int i = 0; i < kJoints; ++i) EXPECT_NEAR(went[i], wanted[i], 0.04) << i;
  m.hand.enable = false;
  m.run(20ms);
  (void)m.said();
  m.run(2s);
  EXPECT_EQ(m.said().open, 0);
}

TEST(ValveMachine, IsBlockedByItsEStopAtOnce) {
  ValveMachine m;
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.1, -0.1, 0.15), 500ms);
  m.nodes.set_estop(true);
  m.run(40ms);  // its state comes every 25 ms
  (void)m.said();
  m.move(JointVector(0.1, -0.1, 0.15), 500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop);
  EXPECT_EQ(m.said().open, 0);
}

TEST(ValveMachine, AnotherCommanderOfOneOfItsValvesIsAFault) {
  ValveMachine m;
  ASSERT_TRUE(m.engage()) << m.fault();
  (void)m.bus.port(2).send({0x18FE3F80U | kExtendedId, 8, {0, 0xFF, 0x30, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}});
  m.run(10ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.loop.fault().code, ReasonCode::kOtherController) << m.fault();
}

}  // namespace
}  // namespace knuckle::slave
