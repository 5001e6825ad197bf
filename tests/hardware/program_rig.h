// The programs of both sides in one process: the slave's bus and the nodes' bus joined by a thread that plays the
// wire, the link over the loopback interface. What they say is read as it is said; nobody asks how long it took.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "app/frame_log.h"
#include "core/realtime_thread.h"
#include "transport/thread_wires.h"
#include "transport/virtual_can.h"

namespace knuckle::test {

/// Patience of a test: reached only where something does not come at all.
inline constexpr std::chrono::seconds kPatience{60};

/// Lines that one thread writes and another waits for.
class Heard : public std::streambuf {
 public:
  Heard() : stream(this) {}
  [[nodiscard]] std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }
  [[nodiscard]] bool says(const std::string& what) const { return text().find(what) != std::string::npos; }
  /// Forgets what was said so far.
  void forget() {
    const std::lock_guard lock(mutex_);
    text_.clear();
  }

  std::ostream stream;

 protected:
  int_type overflow(int_type c) override {
    const std::lock_guard lock(mutex_);
    text_ += static_cast<char>(c);
    return c;
  }
  std::streamsize xsputn(const char* data, std::streamsize size) override {
    const std::lock_guard lock(mutex_);
    text_.append(data, static_cast<std::size_t>(size));
    return size;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

/// Waits until it is so. @return false where it never was.
inline bool eventually(const std::function<bool()>& so) {
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (!so()) {
    if (std::chrono::steady_clock::now() > give_up) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

/// Two controllers on one bus, each for a thread of its own, and a log of every frame in the order of the wire.
class Wire {
 public:
  explicit Wire(std::uint32_t bit_rate) : bus_(2, bit_rate) {
    bus_.set_tap({[](void* self, Time at, const CanFrame& frame) {
                    auto& wire = *static_cast<Wire*>(self);
                    const std::lock_guard lock(wire.mutex_);
                    wire.frames_.push_back({at, frame});
                  },
                  this});
    thread_ = std::jthread([this](const std::stop_token& stop) {
      const RealtimeClock clock;
      while (!stop.stop_requested()) {
        exchange();
        bus_.advance(clock.now());
        exchange();
        clock.sleep_until(clock.now() + std::chrono::microseconds(500));
      }
    });
  }
  Wire(const Wire&) = delete;
  Wire& operator=(const Wire&) = delete;

  [[nodiscard]] CanBus& slave() noexcept { return slave_.controller(); }
  [[nodiscard]] CanBus& nodes() noexcept { return nodes_.controller(); }
  [[nodiscard]] app::FrameLog frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }

 private:
  void exchange() {
    slave_.exchange(bus_.port(0));
    nodes_.exchange(bus_.port(1));
  }
  ThreadCan slave_, nodes_;
  VirtualCanBus bus_;
  mutable std::mutex mutex_;
  app::FrameLog frames_;
  std::jthread thread_;
};

}  // namespace knuckle::test
