// Latest-value mailbox for what is too large to be copied: one writer, one reader, neither ever waits for the other.
// Beside core/mailbox.h, which copies plain data.
#pragma once

#include <atomic>
#include <memory>

namespace knuckle::video {

template <typename T>
class Newest {
 public:
  Newest() = default;
  Newest(const Newest&) = delete;
  Newest& operator=(const Newest&) = delete;
  ~Newest() { delete slot_.load(); }

  /// Writer's thread only; what was not taken is freed here.
  void put(std::unique_ptr<T> value) { delete slot_.exchange(value.release(), std::memory_order_acq_rel); }
  /// Reader's thread only; nullptr where nothing was put since the last take().
  [[nodiscard]] std::unique_ptr<T> take() noexcept {
    return std::unique_ptr<T>(slot_.exchange(nullptr, std::memory_order_acq_rel));
  }

 private:
  std::atomic<T*> slot_{nullptr};
};

}  // namespace knuckle::video
