// A CAN interface of the Linux kernel: classic data frames with 11-bit identifiers over three raw sockets, so that
// PDOs, services (SDO) and error frames have queues of their own and cannot displace each other.
#pragma once

#include <linux/can.h>
#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "transport/can_bus.h"
#include "transport/can_health.h"

namespace knuckle {

/// For one thread. send() and receive() are system calls that never wait, so they belong into a loop's step.
///
/// Priorities: NMT, SYNC, set-points, enable output and heartbeats leave through the kernel's first band, in the order
/// sent; SDOs wait behind them in a lower one. Within the first band nothing overtakes: a neutral set-point that did
/// would be undone by the older one behind it. That band is kept short, so nothing in it grows old.
class SocketCanBus final : public CanBus {
 public:
  /// @param interface such as "can0" or "vcan0".
  /// @param hear exact identifiers of what is to be received, 512 at most; everything else is left to the kernel to
  ///   throw away. Empty: every standard data frame but one's own.
  /// @throws InputError where there is no such interface, it is no CAN interface, it is down, or access is denied.
  explicit SocketCanBus(const std::string& interface, std::span<const std::uint32_t> hear = {});

  /// Sockets that are open already, each carrying struct can_frame; taken over.
  struct Sockets {
    int process = -1, service = -1, errors = -1;
  };
  SocketCanBus(const std::string& interface, const Sockets& sockets);
  ~SocketCanBus() override;
  SocketCanBus(const SocketCanBus&) = delete;
  SocketCanBus& operator=(const SocketCanBus&) = delete;

  /// False, and counted, where the queue is full, the interface down or a bus-off not acknowledged. Never repeated.
  bool send(const CanFrame& frame) noexcept override;
  /// PDOs and the like before SDOs; in each of the two, oldest first.
  bool receive(CanFrame& frame) noexcept override;
  /// As of the last send() and receive(). A bus-off stays until acknowledge().
  [[nodiscard]] CanState state() const noexcept override { return health_.state(); }
  /// Forgets a bus-off whose controller has been restarted since, and an error-passive in which frames were heard.
  void acknowledge() noexcept override { health_.acknowledge(); }
  [[nodiscard]] std::uint64_t errors() const noexcept override { return health_.counters().errors(); }

  [[nodiscard]] const CanCounters& counters() const noexcept { return health_.counters(); }
  /// What is wrong and what to do, in one line; empty while nothing is. Allocates: not for loops.
  [[nodiscard]] std::string diagnosis() const { return health_.diagnosis(interface_); }

 private:
  /// One socket, read in batches.
  class Inbox {
   public:
    explicit Inbox(int socket) noexcept;
    [[nodiscard]] int socket() const noexcept { return socket_; }
    [[nodiscard]] bool empty() const noexcept { return next_ == count_; }
    [[nodiscard]] const can_frame& take() noexcept { return frames_[next_++]; }
    /// Reads what has arrived; to be called when empty.
    void fill(CanHealth& health) noexcept;

   private:
    static constexpr std::size_t kBatch = 32;
    struct Control {
      alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint32_t))> bytes;
    };
    void count_overflows(CanHealth& health, const msghdr& message) noexcept;

    int socket_;
    std::size_t next_ = 0, count_ = 0;
    std::uint32_t overflows_ = 0;  // as last told by the kernel; wraps
    std::array<can_frame, kBatch> frames_{};
    std::array<iovec, kBatch> places_{};
    std::array<Control, kBatch> controls_{};
    std::array<mmsghdr, kBatch> messages_{};
  };
  void look_at_errors() noexcept;
  bool take(Inbox& inbox, CanFrame& frame) noexcept;

  std::string interface_;
  CanHealth health_;
  Inbox process_, service_, errors_;
};

}  // namespace knuckle
