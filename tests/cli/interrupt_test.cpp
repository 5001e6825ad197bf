// Which signals end a program in order, and which at once.
#include "app/cli/interrupt.h"

#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "tests/support/forget_interrupts.h"

namespace knuckle::cli {
namespace {

TEST(InterruptGuard, TheSameWishSentTwiceIsOne) {
  const test::ForgetInterrupts afterwards;
  const InterruptGuard guard;
  EXPECT_FALSE(guard.pending());
  std::raise(SIGTERM);  // as `timeout` does: to the program, and to its group
  std::raise(SIGTERM);
  std::raise(SIGINT);
  EXPECT_TRUE(guard.pending());
  EXPECT_THROW(guard.check(), Interrupted);
}

TEST(InterruptGuard, ALaterSignalEndsTheProgramAtOnce) {
  const auto insist = [] {
    const InterruptGuard guard;
    std::raise(SIGTERM);
    std::this_thread::sleep_for(kSameWish + std::chrono::milliseconds(100));
    std::raise(SIGTERM);
  };
  EXPECT_EXIT(insist(), testing::KilledBySignal(SIGTERM), "");
}

}  // namespace
}  // namespace knuckle::cli
