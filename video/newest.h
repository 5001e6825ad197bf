// Latest-value mailbox for what is too large to be copied: one writer, one reader, neither ever waits for the other.
// Beside core/mailbox.h, which copies plain data.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>

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

// Wakes who waits for the next picture. No loop's thread rings it or waits for it.

class Bell {
 public:
  /// Any thread.
  void ring() {
    {
      const std::lock_guard lock(mutex_);
      rung_ = true;
    }
    rings_.notify_one();
  }
  /// Before pictures are taken: what rang so far is taken with them.
  void quiet() {
    const std::lock_guard lock(mutex_);
    rung_ = false;
  }
  /// One thread. @return whether it has rung since quiet() or the last wait; at the latest then.
  bool wait_until(std::chrono::steady_clock::time_point latest) {
    std::unique_lock lock(mutex_);
    rings_.wait_until(lock, latest, [this] { return rung_; });
    return std::exchange(rung_, false);
  }

 private:
  std::mutex mutex_;
  std::condition_variable rings_;
  bool rung_ = false;
};

}  // namespace knuckle::video
