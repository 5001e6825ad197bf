// Wakes who waits for the next picture. No loop's thread rings it or waits for it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <utility>

namespace knuckle::video {

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
