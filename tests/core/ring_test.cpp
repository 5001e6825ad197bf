#include "core/ring.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/support/no_alloc.h"

namespace knuckle {
namespace {

TEST(Ring, GivesBackInOrderAcrossItsEnd) {
  Ring<int, 4> ring;
  int value = 0;
  EXPECT_FALSE(ring.pop(value));
  for (int n = 0; n < 100; n += 3) {
    for (int i = n; i < n + 3; ++i) ASSERT_TRUE(ring.push(i));
    for (int i = n; i < n + 3; ++i) {
      ASSERT_TRUE(ring.pop(value));
      EXPECT_EQ(value, i);
    }
    EXPECT_FALSE(ring.pop(value));
  }
}

TEST(Ring, RefusesAndCountsWhatDoesNotFit) {
  Ring<int, 4> ring;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.push(i));
  EXPECT_FALSE(ring.push(4));
  EXPECT_FALSE(ring.push(5));
  EXPECT_EQ(ring.dropped(), 2u);
  int value = -1;
  EXPECT_TRUE(ring.pop(value));
  EXPECT_EQ(value, 0);
  EXPECT_TRUE(ring.push(6));
  EXPECT_EQ(ring.dropped(), 2u);
}

TEST(Ring, AllocatesNothing) {
  Ring<int, 4> ring;
  int value = 0;
  test::NoAllocScope scope;
  for (int i = 0; i < 6; ++i) ring.push(i);
  while (ring.pop(value)) {
  }
  EXPECT_EQ(scope.allocations(), 0u);
}

struct Numbered {
  std::uint64_t number, copy;
};

TEST(RingThreads, EveryElementArrivesOnceInOrderOrIsCountedAsDropped) {
  constexpr std::uint64_t kPushes = 300'000;
  Ring<Numbered, 64> ring;
  std::atomic<bool> done{false};
  std::thread producer([&] {
    for (std::uint64_t n = 1; n <= kPushes; ++n) ring.push({n, n});
    done.store(true);
  });
  std::uint64_t popped = 0, damaged = 0, last = 0;
  const auto drain = [&] {
    for (Numbered value{}; ring.pop(value); ++popped) {
      damaged += value.number != value.copy || value.number <= last;
      last = value.number;
    }
  };
  while (!done.load()) drain();
  producer.join();
  drain();
  EXPECT_EQ(damaged, 0u);
  EXPECT_EQ(popped + ring.dropped(), kPushes);
}

}  // namespace
}  // namespace knuckle
