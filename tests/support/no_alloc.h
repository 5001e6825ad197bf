// Guard of the real-time rule "a step allocates nothing": counts heap allocations of the calling thread.
// Every test binary is linked with it; malloc itself is counted, so operator new, Eigen and the C library are too.
#pragma once

#include <cstdint>

namespace knuckle::test {

/// Heap allocations (malloc, calloc, realloc, aligned forms, every operator new) of this thread since it started.
[[nodiscard]] std::uint64_t thread_allocations() noexcept;

/// Counts from construction on, on the thread that made it; scopes may nest. Keep gtest assertions outside the counted
/// stretch: they allocate.
///   NoAllocScope scope;
///   for (...) loop.step(now);
///   EXPECT_EQ(scope.allocations(), 0u);
class NoAllocScope {
 public:
  NoAllocScope() noexcept : start_(thread_allocations()) {}
  [[nodiscard]] std::uint64_t allocations() const noexcept { return thread_allocations() - start_; }

 private:
  std::uint64_t start_;
};

}  // namespace knuckle::test
