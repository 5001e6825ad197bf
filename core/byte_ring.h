// Bounded queue of byte records of any size between two threads, for recorders: like core/ring.h, but a record takes no
// more room than it needs.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace knuckle {

/// One producer, one consumer, no waiting. Without room a new record is refused and counted. Allocates in its
/// constructor alone.
class ByteRing {
 public:
  /// @param capacity bytes; rounded up to a power of two. Each record takes up to 15 bytes more than it has.
  explicit ByteRing(std::size_t capacity) : bytes_(std::bit_ceil(capacity)) {}

  /// Producer's thread only. False where there was no room: dropped, and counted.
  bool push(std::span<const std::uint8_t> record) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    const std::size_t head = head_.load(std::memory_order_acquire);
    const std::size_t needed = room_of(record.size());
    const std::size_t to_end = bytes_.size() - tail % bytes_.size();
    const std::size_t skipped = needed > to_end ? to_end : 0;  // a record lies in one piece
    if (tail - head + skipped + needed > bytes_.size()) {
      dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    if (skipped > 0) write_size(tail, kSkip);
    write_size(tail + skipped, record.size());
    std::memcpy(&bytes_[(tail + skipped) % bytes_.size() + kSize], record.data(), record.size());
    tail_.store(tail + skipped + needed, std::memory_order_release);
    return true;
  }

  /// Consumer's thread only: the oldest record, valid until pop(); empty where there is none.
  [[nodiscard]] std::span<const std::uint8_t> front() noexcept {
    std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return {};
    std::uint64_t size = read_size(head);
    if (size == kSkip) {
      head += bytes_.size() - head % bytes_.size();
      head_.store(head, std::memory_order_release);
      size = read_size(head);
    }
    return {&bytes_[head % bytes_.size() + kSize], static_cast<std::size_t>(size)};
  }
  /// Consumer's thread only, after front() gave a record.
  void pop() noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    head_.store(head + room_of(static_cast<std::size_t>(read_size(head))), std::memory_order_release);
  }

  /// Records refused so far; any thread.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kSize = sizeof(std::uint64_t), kCacheLine = 64;
  static constexpr std::uint64_t kSkip = ~std::uint64_t{0};  ///< The next record begins at the start of bytes_.

  [[nodiscard]] static std::size_t room_of(std::size_t size) noexcept {
    return kSize + (size + kSize - 1) / kSize * kSize;
  }
  void write_size(std::size_t at, std::uint64_t size) noexcept {
    std::memcpy(&bytes_[at % bytes_.size()], &size, kSize);
  }
  [[nodiscard]] std::uint64_t read_size(std::size_t at) const noexcept {
    std::uint64_t size = 0;
    std::memcpy(&size, &bytes_[at % bytes_.size()], kSize);
    return size;
  }

  alignas(kCacheLine) std::atomic<std::size_t> head_{0};
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};
  std::atomic<std::uint64_t> dropped_{0};  ///< Written by the producer, like tail_.
  std::vector<std::uint8_t> bytes_;
};

}  // namespace knuckle
