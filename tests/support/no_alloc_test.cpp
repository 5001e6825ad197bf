#include "tests/support/no_alloc.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace knuckle::test {
namespace {

// Shows a block to an observer the optimiser cannot see through, so that the allocation is not proved away.
void show(const void* block) {
  asm volatile("" : : "g"(block) : "memory");
}
void show_and_free(void* block) {
  show(block);
  std::free(block);
}

std::uint64_t allocations_of(const std::function<void()>& work) {
  NoAllocScope scope;
  work();
  return scope.allocations();
}

struct alignas(64) Aligned {
  double values[16];
};

TEST(NoAllocScope, CountsEveryWayToAllocate) {
  EXPECT_EQ(allocations_of([] { show_and_free(std::malloc(10)); }), 1u);
  EXPECT_EQ(allocations_of([] { show_and_free(std::calloc(2, 10)); }), 1u);
  EXPECT_EQ(allocations_of([] { show_and_free(std::realloc(nullptr, 10)); }), 1u);
#if !defined(__SANITIZE_THREAD__)  // Its hook does not see the aligned C functions.
  EXPECT_EQ(allocations_of([] { show_and_free(std::aligned_alloc(64, 128)); }), 1u);
  EXPECT_EQ(allocations_of([] {
              void* block = nullptr;
              if (posix_memalign(&block, 64, 128) == 0) show_and_free(block);
            }),
            1u);
#endif
  EXPECT_EQ(allocations_of([] { show(std::make_unique<int>(7).get()); }), 1u);
  EXPECT_EQ(allocations_of([] { show(std::make_unique<Aligned>().get()); }), 1u);
  EXPECT_EQ(allocations_of([] { show(std::vector<double>(100).data()); }), 1u);
  EXPECT_GE(allocations_of([] { show(Eigen::MatrixXd(9, 9).data()); }), 1u);
  EXPECT_GE(allocations_of([] { show(std::string(100, 'x').data()); }), 1u);
}

TEST(NoAllocScope, CountsItsOwnThreadOnly) {
  std::uint64_t inside = 0;
  NoAllocScope outer;
  const std::uint64_t before = outer.allocations();
  std::thread thread([&inside] {
    inside = allocations_of([] {
      for (int i = 0; i < 1000; ++i) show_and_free(std::malloc(10));
    });
  });
  thread.join();
  EXPECT_EQ(inside, 1000u);
  EXPECT_LT(outer.allocations() - before, 20u);  // Those of std::thread itself.
}

}  // namespace
}  // namespace knuckle::test
