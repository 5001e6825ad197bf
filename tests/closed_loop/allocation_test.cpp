// Whole sessions, faults included, in which no step of any loop touches the heap.
#include <gtest/gtest.h>

#include "tests/closed_loop/session_rig.h"

namespace knuckle::test {
namespace {

class EveryStep : public testing::TestWithParam<const char*> {};

TEST_P(EveryStep, AllocatesNothingInAWholeSession) {
  const FinishedSession session = run_session(session_setup(GetParam(), 1));
  EXPECT_EQ(session.allocations, 0u);
  EXPECT_GT(session.metrics.engaged_s.value_or(0), 5);  // it was a session, not a refusal
}

INSTANTIATE_TEST_SUITE_P(Allocation, EveryStep,
                         testing::Values("dismantle", "dig_cycle", "link_faults", "sensor_faults"),
                         [](const auto& test) { return std::string(test.param); });

class EveryLaw : public testing::TestWithParam<const char*> {};

TEST_P(EveryLaw, RunsAWholeSessionWithinItsSlewWithoutAFaultAndAllocatesNothing) {
  session::SessionSetup setup = session_setup("wall_contact", 1);
  setup.law = *control_law_named(GetParam());
  setup.to_machine.delay = setup.to_operator.delay = 25ms;
  const FinishedSession session = run_session(setup);
  EXPECT_EQ(session.allocations, 0u);
  EXPECT_GT(session.metrics.engaged_s.value_or(0), 5);
  EXPECT_TRUE(session.record.faults.empty());
  EXPECT_LE(session.metrics.max_slew_N_per_ms.value_or(1e9), 0.5);
  EXPECT_TRUE(session.record.warnings.empty());
}
INSTANTIATE_TEST_SUITE_P(Laws, EveryLaw, testing::ValuesIn(kControlLawNames),
                         [](const auto& chosen) { return std::string(chosen.param); });

TEST(EveryStepOverABadLink, AllocatesNothingInAWholeSession) {
  session::SessionSetup setup = session_setup("wall_contact", 1);
  setup.to_machine.delay = setup.to_operator.delay = 50ms;
  setup.to_machine.jitter = setup.to_operator.jitter = 20ms;
  setup.to_machine.loss = setup.to_operator.loss = 0.1;
  setup.to_machine.duplication = setup.to_operator.reordering = 0.1;
  const FinishedSession session = run_session(setup);
  EXPECT_EQ(session.allocations, 0u);
  EXPECT_GT(session.metrics.engaged_s.value_or(0), 5);
}

}  // namespace
}  // namespace knuckle::test
