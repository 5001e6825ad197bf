// What is known of a CAN controller from what the kernel says of it: error frames, and errors of sending and receiving.
// No I/O and no time in here.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "transport/can_bus.h"

namespace knuckle {

/// Since opening. Nothing is lost without being counted.
struct CanCounters {
  std::uint64_t sent = 0;          ///< Taken by the kernel's queue; not yet proof of a frame on the wire.
  std::uint64_t received = 0;      ///< Data frames read.
  std::uint64_t queue_full = 0;    ///< Not sent: the queue towards the controller was full (ENOBUFS).
  std::uint64_t not_sendable = 0;  ///< Not sent: interface down or gone, or bus-off not yet acknowledged.
  std::uint64_t overflows = 0;     ///< Frames lost in the kernel because they were not read in time (SO_RXQ_OVFL).
  std::uint64_t controller_overflows = 0;  ///< Times the controller itself lost frames.
  std::uint64_t error_frames = 0;
  std::uint64_t protocol_errors = 0;  ///< Bit, stuff, form, CRC errors; only where the driver reports each.
  std::uint64_t no_acknowledge = 0;   ///< Frames that nobody acknowledged; only where the driver reports each.
  std::uint64_t passive = 0;          ///< Times error-passive was entered.
  std::uint64_t bus_off = 0;          ///< Times bus-off was entered.
  std::uint64_t restarts = 0;         ///< Times the controller was restarted after bus-off.
  std::uint64_t downs = 0;            ///< Times the interface went down or away.
  std::uint8_t transmit_errors = 0, receive_errors = 0;  ///< The controller's error counters, as last reported.
  /// Error frames, and frames lost on the way.
  [[nodiscard]] std::uint64_t errors() const noexcept {
    return error_frames + queue_full + not_sendable + overflows + controller_overflows;
  }
};

class CanHealth {
 public:
  /// An error frame of the kernel: its error class (identifier without flags) and its eight bytes.
  void on_error_frame(std::uint32_t error_class, const std::array<std::uint8_t, 8>& data) noexcept;
  void on_received() noexcept;
  void on_sent() noexcept;
  void on_send_error(int error) noexcept;
  void on_receive_error(int error) noexcept;
  void on_not_sent() noexcept { ++counters_.not_sendable; }
  void on_overflow(std::uint64_t frames) noexcept { counters_.overflows += frames; }
  /// What was seen between two looks has been looked at: an interface that can send or hear again counts as up from
  /// here on. Of two buses there may be one on which nothing is sent.
  void on_look() noexcept;
  /// An interface that was gone has been opened anew: down until it can send or hear.
  void on_found_again() noexcept { gone_ = false; }

  /// kBusOff stays until acknowledge(), even where kernel or integrator have restarted the controller since.
  [[nodiscard]] CanState state() const noexcept;
  /// There is no such interface any more, as its adapter was pulled.
  [[nodiscard]] bool gone() const noexcept { return gone_; }
  /// Forgets a bus-off that is over; and an error-passive during which frames were heard, as not every driver tells of
  /// its end.
  void acknowledge() noexcept;
  [[nodiscard]] const CanCounters& counters() const noexcept { return counters_; }
  /// What is wrong and what to do, in one line that begins with the interface's name; empty while nothing is.
  /// Allocates.
  [[nodiscard]] std::string diagnosis(const std::string& interface) const;

 private:
  void go_down(bool gone) noexcept;

  CanCounters counters_;
  bool off_ = false;      // the controller, now
  bool was_off_ = false;  // not yet acknowledged
  bool passive_ = false, down_ = false, gone_ = false;
  bool works_again_ = false;  // a frame was taken or received since the interface went down
  std::uint64_t received_before_passive_ = 0;
};

}  // namespace knuckle
