// Latest-value mailbox between two threads: one writer, one reader, neither ever waits for the other.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace knuckle {

/// Triple buffer: the writer fills its own slot and swaps it with the middle one; the reader swaps the middle one out
/// when it is newer. Wait-free on both sides; values in between are overwritten, which is what "newest wins" means.
template <typename T>
class Mailbox {
  // Owns nothing, so a copy allocates nothing. Not "trivially copyable": Eigen's fixed-size types are not, by the
  // letter.
  static_assert(std::is_trivially_destructible_v<T>, "only plain data crosses a thread border");

 public:
  /// Writer's thread only.
  void put(const T& value) noexcept {
    slots_[writing_] = value;
    writing_ = swap(static_cast<std::uint8_t>(writing_ | kNew));
  }

  /// Reader's thread only. False, and value untouched, where nothing was put since the last take().
  bool take(T& value) noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kNew) == 0) return false;
    reading_ = swap(reading_);
    value = slots_[reading_];
    return true;
  }

 private:
  static constexpr std::uint8_t kIndex = 3;
  static constexpr std::uint8_t kNew = 4;
  static constexpr std::size_t kCacheLine = 64;

  /// Gives a slot to the middle, returns the index of the one that was there.
  std::uint8_t swap(std::uint8_t slot) noexcept {
    return static_cast<std::uint8_t>(middle_.exchange(slot, std::memory_order_acq_rel) & kIndex);
  }

  alignas(kCacheLine) std::atomic<std::uint8_t> middle_{1};
  alignas(kCacheLine) std::uint8_t writing_ = 0;
  alignas(kCacheLine) std::uint8_t reading_ = 2;
  alignas(kCacheLine) std::array<T, 3> slots_{};
};

}  // namespace knuckle
