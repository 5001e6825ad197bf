// The three wires with the one tap that each has: whatever a loop reads or writes goes through unchanged, and onto its
// tap. That of the CAN bus meters its load, too, and keeps copies of its frames for a log.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <ostream>
#include <span>
#include <string>

#include "core/ring.h"
#include "core/time.h"
#include "recording/loop_tap.h"
#include "transport/can_bus.h"
#include "transport/can_load.h"
#include "transport/hid_port.h"
#include "transport/link.h"
#include "transport/timed_frame.h"

namespace knuckle::recording {

/// Frames that the controller's filter keeps out are not seen: on a CAN interface, those of a stranger who babbles.
class TappedCan final : public CanBus {
 public:
  /// Both outlive this.
  TappedCan(CanBus& bus, LoopTap& tap) noexcept : bus_(bus), tap_(tap) {}

  /// Before the first frame: copies of all that passes are kept for write(). Allocates their room.
  void keep_copies() { copies_ = std::make_unique<Copies>(); }

  // For the thread of the loop.
  /// Time that copies get from now on: of the step that sends or takes the frames.
  void stamp(Time now) noexcept { now_ = now; }
  bool send(const CanFrame& frame) noexcept override {
    const bool sent = bus_.send(frame);
    if (sent) note(frame);
    tap_.add(sent ? WireEventKind::kCanSent : WireEventKind::kCanRefused, frame.id, data_of(frame));
    return sent;
  }
  bool receive(CanFrame& frame) noexcept override {
    if (!bus_.receive(frame)) return false;
    note(frame);
    tap_.add(WireEventKind::kCanReceived, frame.id, data_of(frame));
    return true;
  }
  [[nodiscard]] CanState state() const noexcept override {
    (void)bus_.state();  // every answer: it may change within a step, and what is recorded is what was told
    const std::array<CanState, 2> states = bus_.states();
    tap_.add(WireEventKind::kCanState, can_states_value(states));
    return std::max(states[0], states[1]);
  }
  [[nodiscard]] std::array<CanState, 2> states() const noexcept override { return bus_.states(); }
  void acknowledge() noexcept override {
    bus_.acknowledge();
    tap_.add(WireEventKind::kCanAcknowledged, 0);
  }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return bus_.errors(); }
  /// Of the controller's own traffic, both ways.
  [[nodiscard]] CanMeter& meter() noexcept { return meter_; }

  // For the thread that writes.
  /// Lines of a candump log for what has passed since the last call. @param second of two buses
  void write(std::ostream& out, const std::string& interface, const std::string& second = "can1") {
    TimedFrame passed;
    while (copies_ && copies_->pop(passed))
      out << candump_line(passed.at, passed.frame, interface.c_str(), second.c_str()) << '\n';
  }
  /// Frames that passed without room for a copy; any thread.
  [[nodiscard]] std::uint64_t lost() const noexcept { return copies_ ? copies_->dropped() : 0; }

 private:
  using Copies = Ring<TimedFrame, 8192>;  // about a second of a full bus at 1 Mbit/s
  void note(const CanFrame& frame) noexcept {
    meter_.add(frame);
    if (copies_) copies_->push({now_, frame});
  }
  static std::span<const std::uint8_t> data_of(const CanFrame& frame) noexcept {
    return std::span(frame.data).first(std::min<std::size_t>(frame.size, frame.data.size()));
  }
  CanBus& bus_;
  LoopTap& tap_;
  CanMeter meter_;
  std::unique_ptr<Copies> copies_;
  Time now_{};
};

class TappedHid final : public HidPort {
 public:
  /// Both outlive this.
  TappedHid(HidPort& port, LoopTap& tap) noexcept : port_(port), tap_(tap) {}

  bool write(const HidReport& report) noexcept override {
    const bool sent = port_.write(report);
    tap_.add(sent ? WireEventKind::kHidSent : WireEventKind::kHidRefused, 0, report);
    return sent;
  }
  bool read(HidReport& report) noexcept override {
    if (!port_.read(report)) return false;
    tap_.add(WireEventKind::kHidReceived, 0, report);
    return true;
  }
  [[nodiscard]] bool connected() const noexcept override {
    const bool now = port_.connected();
    if (tap_.on() && now != connected_) tap_.add(WireEventKind::kHidConnected, now ? 1 : 0);
    connected_ = now;
    return now;
  }

 private:
  HidPort& port_;
  LoopTap& tap_;
  mutable bool connected_ = false;  // as the tap has it
};

class TappedLink final : public Link {
 public:
  /// Both outlive this.
  TappedLink(Link& link, LoopTap& tap) noexcept : link_(link), tap_(tap) {}

  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    const bool sent = link_.send(bytes);
    tap_.add(sent ? WireEventKind::kLinkSent : WireEventKind::kLinkRefused, 0, bytes);
    return sent;
  }
  /// What has waited for longer than 4 s counts as having waited 4 s: for no reader is there a difference.
  bool receive(Datagram& datagram) noexcept override {
    if (!link_.receive(datagram)) return false;
    datagram.waited = std::clamp(datagram.waited, Duration::zero(), kLongest);
    tap_.add(WireEventKind::kLinkReceived, static_cast<std::uint32_t>(datagram.waited.count()), datagram.view());
    return true;
  }
  [[nodiscard]] bool emptied() const noexcept override {
    const bool now = link_.emptied();
    if (tap_.on() && now != emptied_) tap_.add(WireEventKind::kLinkNotEmptied, now ? 0 : 1);
    emptied_ = now;
    return now;
  }

 private:
  static constexpr Duration kLongest = 4s;  // nanoseconds in 32 bits
  Link& link_;
  LoopTap& tap_;
  mutable bool emptied_ = true;  // as the tap has it
};

}  // namespace knuckle::recording
