// A classic CAN bus on virtual time: ports that arbitrate by identifier, frames that take their worst-case stuffed
// length at the bit rate, bounded queues that count what they drop, faults to inject, and a tap for recordings.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/time.h"
#include "transport/can_bus.h"
#include "transport/can_load.h"

namespace knuckle {

/// Told of every frame when its last bit has been sent. A plain function, as it is called inside steps.
struct CanTap {
  void (*on_frame)(void* context, Time at, const CanFrame& frame) = nullptr;
  void* context = nullptr;
};

class VirtualCanBus {
 public:
  static constexpr std::size_t kMaxPorts = 8, kSendSlots = 64, kReceiveSlots = 256;

  /// @throws InputError for more than kMaxPorts ports or a bit rate of 0.
  VirtualCanBus(std::size_t ports, std::uint32_t bit_rate);
  VirtualCanBus(const VirtualCanBus&) = delete;
  VirtualCanBus& operator=(const VirtualCanBus&) = delete;

  /// A participant. Within a port the lowest identifier goes first, equal ones in the order sent, as in a controller
  /// with several mailboxes; so one port can stand for several nodes.
  [[nodiscard]] CanBus& port(std::size_t index) noexcept { return ports_[index]; }
  /// Moves frames until `now`. What is sent between two calls competes for the bus from the earlier call's time on.
  void advance(Time now) noexcept;
  void set_tap(CanTap tap) noexcept { tap_ = tap; }

  // Faults.
  /// What a silent port sends vanishes; it still hears the others.
  void silence(std::size_t port, bool on) noexcept;
  /// Nobody hears anybody: frames wait in their queues, unacknowledged, and go out when the bus is whole again.
  void cut(bool on) noexcept { cut_ = on; }
  /// The port's end of the cable is cut off: nobody hears it, it hears nobody, and finds nobody who acknowledges: its
  /// frames wait, and go out when the cable is mended. The others go on.
  void disconnect(std::size_t port, bool on) noexcept { ports_[port].disconnected_ = on; }
  /// The port's controller has counted so many errors that it is error-passive; its frames still pass.
  void disturb(std::size_t port, bool on) noexcept { ports_[port].disturbed_ = on; }
  /// The port's controller is off the bus: its queues are lost, it neither sends nor hears. After recover() it hears
  /// again, but says kBusOff and sends nothing until acknowledge().
  void bus_off(std::size_t port) noexcept;
  void recover(std::size_t port) noexcept { ports_[port].off_ = false; }
  /// The port's interface goes down (its queues are lost, it neither sends nor hears) or comes up again.
  void take_down(std::size_t port, bool down) noexcept;

  // Since construction.
  [[nodiscard]] Duration busy() const noexcept { return busy_; }
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  /// Frames dropped because the port's sending or receiving queue was full.
  [[nodiscard]] std::uint64_t dropped(std::size_t port) const noexcept { return ports_[port].dropped_; }

 private:
  class Port final : public CanBus {
   public:
    bool send(const CanFrame& frame) noexcept override;
    bool receive(CanFrame& frame) noexcept override;
    [[nodiscard]] CanState state() const noexcept override;
    void acknowledge() noexcept override { was_off_ = off_; }
    [[nodiscard]] std::uint64_t errors() const noexcept override { return dropped_; }

   private:
    friend class VirtualCanBus;
    struct Waiting {
      std::uint64_t rank = 0;  ///< Identifier, then order of sending: the smallest wins.
      CanFrame frame;
    };
    void hear(const CanFrame& frame) noexcept;

    VirtualCanBus* bus_ = nullptr;
    std::array<Waiting, kSendSlots> sending_{};
    std::array<CanFrame, kReceiveSlots> received_{};
    std::size_t waiting_ = 0, oldest_ = 0, unread_ = 0;
    std::uint64_t dropped_ = 0;
    bool silent_ = false, down_ = false, disconnected_ = false, disturbed_ = false;
    bool off_ = false, was_off_ = false;  // bus-off now; not yet acknowledged
  };

  void empty(Port& port) noexcept;
  bool start_next() noexcept;
  void finish() noexcept;

  std::array<Port, kMaxPorts> ports_;
  std::size_t count_;
  Duration bit_;
  CanTap tap_;
  Time now_{};
  Time free_at_{};  ///< End of the frame on the wire, or of the last one.
  CanFrame on_wire_;
  std::size_t sender_ = 0;
  bool sending_ = false, cut_ = false;
  std::size_t waiting_ = 0;  ///< In all ports.
  std::uint64_t order_ = 0, frames_ = 0;
  Duration busy_{};
};

}  // namespace knuckle
