#include "core/byte_ring.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <thread>
#include <vector>

#include "tests/support/no_alloc.h"

namespace knuckle {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes record(std::size_t size, std::uint8_t first) {
  Bytes bytes(size);
  std::iota(bytes.begin(), bytes.end(), first);
  return bytes;
}

TEST(ByteRing, GivesBackRecordsOfAnySizeInOrderAcrossItsEnd) {
  std::mt19937 random(5);
  ByteRing ring(1 << 12);
  std::vector<Bytes> waiting;
  std::size_t read = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Bytes bytes = record(1 + random() % 900, static_cast<std::uint8_t>(i));
    if (ring.push(bytes)) waiting.push_back(bytes);
    if (random() % 2 == 0 || read + 8 < waiting.size()) {
      const auto front = ring.front();
      ASSERT_FALSE(front.empty());
      ASSERT_EQ(Bytes(front.begin(), front.end()), waiting[read++]) << "record " << i;
      ring.pop();
    }
  }
  for (auto front = ring.front(); !front.empty(); front = ring.front(), ++read) {
    ASSERT_EQ(Bytes(front.begin(), front.end()), waiting[read]);
    ring.pop();
  }
  EXPECT_EQ(read, waiting.size());
}

TEST(ByteRing, RefusesAndCountsWhatDoesNotFit) {
  ByteRing ring(128);
  EXPECT_TRUE(ring.push(record(50, 1)));
  EXPECT_FALSE(ring.push(record(100, 2)));
  EXPECT_FALSE(ring.push(record(200, 3)));  // larger than the ring itself
  EXPECT_EQ(ring.dropped(), 2u);
  EXPECT_TRUE(ring.push(record(50, 4)));
  EXPECT_EQ(ring.front()[0], 1);
  ring.pop();
  EXPECT_EQ(ring.front()[0], 4);
  ring.pop();
  EXPECT_TRUE(ring.front().empty());
}

TEST(ByteRing, AllocatesNothing) {
  ByteRing ring(1024);
  const Bytes bytes = record(100, 0);
  test::NoAllocScope scope;
  for (int i = 0; i < 50; ++i) {
    ring.push(bytes);
    if (!ring.front().empty()) ring.pop();
  }
  EXPECT_EQ(scope.allocations(), 0u);
}

TEST(ByteRingThreads, EveryRecordArrivesWholeOnceInOrderOrIsCountedAsDropped) {
  constexpr std::uint32_t kPushes = 100'000;
  ByteRing ring(1 << 12);
  std::atomic<bool> done{false};
  std::thread producer([&] {
    for (std::uint32_t n = 1; n <= kPushes; ++n) {
      std::vector<std::uint32_t> numbers(1 + n % 37, n);
      ring.push({reinterpret_cast<const std::uint8_t*>(numbers.data()), numbers.size() * sizeof n});
    }
    done.store(true);
  });
  std::uint32_t last = 0, received = 0;
  for (bool over = false; !over;) {
    over = done.load();
    for (auto front = ring.front(); !front.empty(); front = ring.front()) {
      std::vector<std::uint32_t> numbers(front.size() / sizeof last);
      std::memcpy(numbers.data(), front.data(), front.size());
      ASSERT_GT(numbers[0], last);
      last = numbers[0];
      ASSERT_EQ(numbers, std::vector<std::uint32_t>(1 + last % 37, last));
      ++received;
      ring.pop();
    }
  }
  producer.join();
  EXPECT_EQ(received + ring.dropped(), kPushes);
  EXPECT_GT(received, 0u);
}

}  // namespace
}  // namespace knuckle
