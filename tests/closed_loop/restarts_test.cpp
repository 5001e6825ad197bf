// A side ends in the middle of a session and another run of it begins, soon or later: nothing goes on by itself, and
// after release, alignment and press the hand leads again.
#include <gtest/gtest.h>

#include "tests/closed_loop/two_sides.h"

namespace knuckle::test {
namespace {

constexpr double kMostMoved_rad = 0.06;  // what was on its way: valve and spool closing

/// Brings the machine to where a side is to restart.
struct Phase {
  const char* name;
  bool (*reach)(TwoSides&);
};

bool in_motion(TwoSides& s) {
  return s.until([&] { return s.person.phase() >= 1 && s.person.in_phase(s.now) > 2s && s.moving(); });
}

const Phase kPhases[] = {
    {"ready", [](TwoSides& s) { return s.until([&] { return s.mode() == Mode::kReady; }); }},
    {"aligning",
     [](TwoSides& s) {
       if (!s.until([&] { return s.mode() == Mode::kReady; })) return false;
       s.take_the_hand();
       s.intent.presence = true;
       s.intent.joint_rad += JointVector(0.2, 0, 0);
       s.run(500ms);
       s.intent.enable = true;
       s.run(500ms);
       return s.mode() == Mode::kAligning;
     }},
    {"engaged", in_motion},
    {"hold",
     [](TwoSides& s) {
       if (!in_motion(s)) return false;
       s.take_the_hand();
       s.intent.clutch = true;
       s.run(300ms);
       return s.mode() == Mode::kHold;
     }},
    {"contact",
     [](TwoSides& s) {
       Time since = kNever;
       return s.until([&] {
         if (s.mode() != Mode::kEngaged || !s.slave->force().contact) since = kNever;
         if (s.slave->force().contact && since == kNever) since = s.now;
         return since != kNever && s.now - since > 500ms;
       });
     }},
};

session::SessionSetup story(const Phase& phase) {
  return std::string(phase.name) == "contact" ? session_setup("wall_contact", 1) : endless_motion(1, 20);
}

enum class Side : std::uint8_t { kOperator, kMachine };

class Restart : public testing::TestWithParam<std::tuple<Phase, Side, Duration>> {};

TEST_P(Restart, NothingGoesOnByItselfAndTheHandLeadsAgainOnceItHasLetGo) {
  const auto& [phase, side, pause] = GetParam();
  TwoSides s(story(phase));
  ASSERT_TRUE(phase.reach(s)) << text(s.slave->blocking());
  s.take_the_hand();
  const bool was_held = s.intent.enable;
  const JointVector from_rad = s.machine.plant().joint_rad;
  const Time at = s.now;
  if (side == Side::kOperator) {
    s.master.reset();
    s.run(pause);
    s.start_master();
  } else {
    s.slave.reset();
    s.run(pause);
    s.start_slave();
  }
  double moved_rad = 0;
  s.intent.clutch = false;
  while (s.now < at + 5s) {
    s.step();
    moved_rad = std::max(moved_rad, (s.machine.plant().joint_rad - from_rad).cwiseAbs().maxCoeff());
    if (s.now < at + 205ms) continue;
    ASSERT_NE(s.mode(), Mode::kEngaged);
    ASSERT_EQ(s.slave->commands(), JointVector(0, 0, 0));
    if (side == Side::kMachine || !was_held) {
      ASSERT_NE(s.mode(), Mode::kAligning) << "pilot pressure";
    }
  }
  EXPECT_LT(moved_rad, kMostMoved_rad);
  EXPECT_EQ(s.slave->operator_input().message().stamp.echoed_session, s.slave->message(s.now).stamp.session)
      << "they have found each other";

  s.intent.enable = false;
  s.intent.presence = s.intent.clutch = true;  // brings the set-point to the machine
  s.run(500ms);
  s.intent.clutch = false;
  s.run(200ms);
  s.intent.enable = true;
  EXPECT_TRUE(s.until([&] { return s.mode() == Mode::kEngaged; }, 5s)) << text(s.slave->blocking());
}

std::string name_of(const testing::TestParamInfo<std::tuple<Phase, Side, Duration>>& story) {
  const auto& [phase, side, pause] = story.param;
  return std::string(phase.name) + (side == Side::kOperator ? "_operator_" : "_machine_") +
         std::to_string(pause / 1ms) + "ms";
}
INSTANTIATE_TEST_SUITE_P(Stories, Restart,
                         testing::Combine(testing::ValuesIn(kPhases), testing::Values(Side::kOperator, Side::kMachine),
                                          testing::Values(Duration(0), Duration(1500ms))),
                         name_of);

}  // namespace
}  // namespace knuckle::test
