// Bounded queue between two threads that counts what it drops: for recorders and wires inside one process.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace knuckle {

/// One producer, one consumer, no waiting. A full ring refuses the new element (the consumer may be reading the oldest)
/// and counts it. Capacity: a power of two, fully usable.
template <typename T, std::size_t Capacity>
class Ring {
  // Owns nothing, so a copy allocates nothing. Not "trivially copyable": Eigen's fixed-size types are not, by the
  // letter.
  static_assert(std::is_trivially_destructible_v<T>, "only plain data crosses a thread border");
  static_assert(Capacity > 0 && (Capacity & (Capacity - 1)) == 0, "capacity is a power of two");

 public:
  /// Producer's thread only. False where the ring was full: the value is dropped and counted.
  bool push(const T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == Capacity) {
      dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    slots_[tail % Capacity] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  /// Consumer's thread only: oldest first; false where the ring is empty.
  bool pop(T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    value = slots_[head % Capacity];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Elements refused so far; any thread.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kCacheLine = 64;

  alignas(kCacheLine) std::atomic<std::size_t> head_{0};  ///< Popped so far.
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};  ///< Pushed so far.
  std::atomic<std::uint64_t> dropped_{0};                 ///< Written by the producer, like tail_.
  alignas(kCacheLine) std::array<T, Capacity> slots_{};
};

}  // namespace knuckle
