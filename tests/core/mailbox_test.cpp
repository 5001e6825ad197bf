#include "core/mailbox.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <atomic>
#include <thread>

#include "tests/support/no_alloc.h"

namespace knuckle {
namespace {

/// Torn where the words differ.
struct Wide {
  std::array<std::uint64_t, 32> words{};
  static Wide of(std::uint64_t n) {
    Wide value;
    value.words.fill(n);
    return value;
  }
  [[nodiscard]] bool whole() const {
    for (const std::uint64_t word : words) {
      if (word != words[0]) return false;
    }
    return true;
  }
};

TEST(Mailbox, GivesTheNewestValueOnce) {
  Mailbox<int> mailbox;
  int value = 0;
  EXPECT_FALSE(mailbox.take(value)) << "nothing was put yet";
  for (int newest = 1; newest < 20; ++newest) {
    for (int older = 0; older < newest % 4; ++older) mailbox.put(-1);
    mailbox.put(newest);
    ASSERT_TRUE(mailbox.take(value));
    EXPECT_EQ(value, newest);
    EXPECT_FALSE(mailbox.take(value));
    EXPECT_EQ(value, newest);
  }
}

TEST(Mailbox, AllocatesNothing) {
  struct Posture {
    Eigen::Vector3d joint_rad = Eigen::Vector3d::Zero();
    double at_s = 0;
  };
  Mailbox<Posture> mailbox;
  Posture value;
  test::NoAllocScope scope;
  mailbox.put({{1, 2, 3}, 4});
  mailbox.take(value);
  EXPECT_EQ(scope.allocations(), 0u);
  EXPECT_EQ(value.joint_rad, Eigen::Vector3d(1, 2, 3));
}

TEST(MailboxThreads, ReaderSeesWholeValuesThatNeverGoBack) {
  constexpr std::uint64_t kLast = 200'000;
  Mailbox<Wide> mailbox;
  std::thread writer([&mailbox] {
    for (std::uint64_t n = 1; n <= kLast; ++n) mailbox.put(Wide::of(n));
  });
  std::uint64_t torn = 0, backwards = 0, seen = 0;
  for (Wide value; seen < kLast;) {
    if (!mailbox.take(value)) continue;
    torn += !value.whole();
    backwards += value.words[0] <= seen;
    seen = value.words[0];
  }
  writer.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(backwards, 0u);
}

}  // namespace
}  // namespace knuckle
