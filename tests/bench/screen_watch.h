// Reads the numbers of stamped pictures off an X11 screen: the same instrument for whatever shows them.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>

#include "core/time.h"

namespace knuckle {

/// Where a picture is on the screen, from its upper left corner.
struct OnScreen {
  int left = 0, top = 0, width = 0, height = 0;
};

/// Looks every half millisecond, over a connection of its own to the display that DISPLAY names.
class ScreenWatch {
 public:
  /// @param seen for each number that has come, and when; in a thread of its own.
  ScreenWatch(OnScreen where, std::function<void(std::uint32_t, Time)> seen)
      : where_(where), seen_(std::move(seen)), thread_([this] { run(); }) {}
  ~ScreenWatch() {
    ending_ = true;
    thread_.join();
  }
  ScreenWatch(const ScreenWatch&) = delete;
  ScreenWatch& operator=(const ScreenWatch&) = delete;

 private:
  void run();

  const OnScreen where_;
  const std::function<void(std::uint32_t, Time)> seen_;
  std::atomic<bool> ending_{false};
  std::thread thread_;
};

}  // namespace knuckle
