// How soon a stop and a release of enable act over a link that loses and reorders, however briefly the key is touched.
#include <gtest/gtest.h>

#include "tests/closed_loop/two_sides.h"

namespace knuckle::test {
namespace {

session::SessionSetup story(std::uint64_t seed, double loss, double reordering) {
  session::SessionSetup setup = endless_motion(seed, 60);
  setup.scenario.duration_s = 100;
  setup.to_machine.loss = loss;
  setup.to_machine.reordering = reordering;
  setup.to_machine.reorder_delay = 10ms;
  return setup;
}

/// Stop is touched for a millisecond, the way back is lost half of the time. @return until the machine has stopped.
Duration time_to_stop(std::uint64_t seed, double loss, double reordering) {
  TwoSides s(story(seed, loss, reordering));
  EXPECT_TRUE(s.until([&] { return s.person.phase() == 1 && s.moving(); })) << text(s.slave->blocking());
  s.run(Duration(1ms) * static_cast<int>(seed % 10));
  const Time at = s.now;
  s.master->set_stop(true);
  s.step();
  s.master->set_stop(false);
  EXPECT_TRUE(s.until([&] { return s.mode() == Mode::kFault; }, 1s));
  EXPECT_EQ(s.slave->fault().code, ReasonCode::kOperatorStop);
  EXPECT_EQ(s.slave->commands(), JointVector(0, 0, 0));
  return s.now - at;
}

// One way 1 ms, a step of the machine's side each 5 ms.
TEST(UrgentStop, ActsInTheNextStepOfTheMachineOverALinkThatLosesNothing) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) EXPECT_LE(time_to_stop(seed, 0, 0), 6ms + 1ms) << seed;
}

// Each datagram that is lost costs the 2 ms to the next; of 30 % all of eight in a row get lost once in 15 000 times.
TEST(UrgentStop, CostsAPeriodForEachDatagramThatIsLost) {
  Duration sum{}, worst{};
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Duration took = time_to_stop(seed, 0.3, 0);
    sum += took;
    worst = std::max(worst, took);
  }
  EXPECT_LE(worst, 7ms + 8 * 2ms);
  EXPECT_LE(sum / 12, 7ms + 2ms);
}

TEST(UrgentStop, IsNotHeldUpByMessagesThatOvertakeIt) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
    EXPECT_LE(time_to_stop(seed, 0.3, 0.3), 7ms + 8 * 2ms) << "seed " << seed;
}

}  // namespace
}  // namespace knuckle::test
