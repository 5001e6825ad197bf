// The CAN and HID wires between two threads of one process, for simulated sessions in real time: bounded rings, no
// locks; what does not fit is dropped and counted, as a controller's queue would.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "core/ring.h"
#include "transport/can_bus.h"
#include "transport/hid_port.h"

namespace knuckle {

/// A CAN controller whose bus lives in another thread: frames cross when that thread calls exchange().
class ThreadCan {
 public:
  ThreadCan() = default;
  ThreadCan(const ThreadCan&) = delete;
  ThreadCan& operator=(const ThreadCan&) = delete;

  /// For the thread of the loop.
  [[nodiscard]] CanBus& controller() noexcept { return controller_; }
  /// For the thread of the bus: hands over what the loop sent, what arrived at the port, and the port's state and
  /// errors.
  void exchange(CanBus& port) noexcept;
  /// Frames lost between the threads, both ways.
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return controller_.sent_.dropped() + controller_.arrived_.dropped();
  }

 private:
  class Controller final : public CanBus {
   public:
    bool send(const CanFrame& frame) noexcept override { return sent_.push(frame); }
    bool receive(CanFrame& frame) noexcept override { return arrived_.pop(frame); }
    [[nodiscard]] CanState state() const noexcept override {
      seen_ = told_.load(std::memory_order_relaxed);
      return std::max(seen_[0], seen_[1]);
    }
    [[nodiscard]] std::array<CanState, 2> states() const noexcept override { return seen_; }
    void acknowledge() noexcept override { acknowledged_.store(true, std::memory_order_relaxed); }
    [[nodiscard]] std::uint64_t errors() const noexcept override {
      return errors_.load(std::memory_order_relaxed) + sent_.dropped() + arrived_.dropped();
    }

   private:
    friend class ThreadCan;
    Ring<CanFrame, 64> sent_;
    Ring<CanFrame, 1024> arrived_;  // 60 ms of a full bus at 1 Mbit/s
    std::atomic<std::array<CanState, 2>> told_{};
    mutable std::array<CanState, 2> seen_{};  // the loop's thread
    std::atomic<bool> acknowledged_{false};
    std::atomic<std::uint64_t> errors_{0};
  };
  Controller controller_;
};

/// A HID cable with its two ends in different threads.
class ThreadHid {
 public:
  ThreadHid() noexcept : host_(to_host_, to_device_), device_(to_device_, to_host_) {}
  ThreadHid(const ThreadHid&) = delete;
  ThreadHid& operator=(const ThreadHid&) = delete;

  /// The driver's end and the firmware's end, each for one thread.
  [[nodiscard]] HidPort& host() noexcept { return host_; }
  [[nodiscard]] HidPort& device() noexcept { return device_; }
  /// Reports lost because the other thread did not read, both ways.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return to_host_.dropped() + to_device_.dropped(); }

 private:
  using Reports = Ring<HidReport, 64>;
  class End final : public HidPort {
   public:
    End(Reports& incoming, Reports& outgoing) noexcept : incoming_(incoming), outgoing_(outgoing) {}
    bool write(const HidReport& report) noexcept override { return outgoing_.push(report); }
    bool read(HidReport& report) noexcept override { return incoming_.pop(report); }
    [[nodiscard]] bool connected() const noexcept override { return true; }

   private:
    Reports& incoming_;
    Reports& outgoing_;
  };
  Reports to_host_, to_device_;
  End host_, device_;
};

}  // namespace knuckle
