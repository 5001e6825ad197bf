// A CAN interface of the Linux kernel: classic data frames over three raw sockets, so that PDOs, services (SDO) and
// error frames have queues of their own and cannot displace each other.
#pragma once

#include <linux/can.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "core/descriptor.h"
#include "transport/can_bus.h"
#include "transport/can_health.h"

namespace knuckle {

/// Why a CAN interface cannot be used yet, in words and with what to do: there is none of this name, or it is down.
/// Empty where it can. @throws InputError where waiting is in vain: the name is none, or that of another kind of
/// interface.
[[nodiscard]] std::string why_not_yet(const std::string& interface);

/// For one thread, but for find_again(). send() and receive() are system calls that never wait, so they belong into a
/// loop's step.
///
/// Priorities: NMT, SYNC, set-points, enable output and heartbeats leave through the kernel's first band, in the order
/// sent; SDOs wait behind them in a lower one. Within the first band nothing overtakes: a neutral set-point that did
/// would be undone by the older one behind it. That band is kept short, so nothing in it grows old.
class SocketCanBus final : public CanBus {
 public:
  /// @param interface such as "can0" or "vcan0".
  /// @param hear identifiers of what is to be received, 512 filters at most; everything else is left to the kernel to
  ///   throw away. Empty: every data frame but one's own.
  /// @throws InputError where there is no such interface, it is no CAN interface, it is down, or access is denied.
  explicit SocketCanBus(const std::string& interface, std::span<const CanFilter> hear = {});

  /// Sockets that are open already, each carrying struct can_frame; taken over.
  struct Sockets {
    int process = -1, service = -1, errors = -1;
  };
  /// @param open_again opens them anew; throws InputError as long as it cannot. Empty: they never come back.
  SocketCanBus(const std::string& interface, const Sockets& sockets, std::function<Sockets()> open_again = {});
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

  /// For another thread than the loop's, now and then: an interface that was gone (its adapter pulled) and is there and
  /// up again is opened anew. The loop's thread goes on with it by itself; until then, nothing is sent or received.
  /// @return true once for each time.
  [[nodiscard]] bool find_again();

  [[nodiscard]] const CanCounters& counters() const noexcept { return health_.counters(); }
  /// What is wrong and what to do, in one line; empty while nothing is. Allocates: not for loops.
  [[nodiscard]] std::string diagnosis() const { return health_.diagnosis(interface_); }

 private:
  /// One socket, read in batches.
  class Inbox {
   public:
    explicit Inbox(int socket) noexcept;
    [[nodiscard]] int socket() const noexcept { return socket_.get(); }
    [[nodiscard]] bool empty() const noexcept { return next_ == count_; }
    [[nodiscard]] const can_frame& take() noexcept { return frames_[next_++]; }
    /// Reads what has arrived; to be called when empty.
    void fill(CanHealth& health) noexcept;
    /// Another socket is behind the same descriptor from now on.
    void start_anew() noexcept { next_ = count_ = overflows_ = 0; }

   private:
    static constexpr std::size_t kBatch = 32;
    struct Control {
      alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint32_t))> bytes;
    };
    void count_overflows(CanHealth& health, const msghdr& message) noexcept;

    Descriptor socket_;
    std::size_t next_ = 0, count_ = 0;
    std::uint32_t overflows_ = 0;  // as last told by the kernel; wraps
    std::array<can_frame, kBatch> frames_{};
    std::array<iovec, kBatch> places_{};
    std::array<Control, kBatch> controls_{};
    std::array<mmsghdr, kBatch> messages_{};
  };
  /// Whose the sockets are: the loop's thread gives them away once the interface is gone, find_again() gives them back.
  enum class Ends : std::uint8_t { kInUse, kGone, kFoundAgain };
  [[nodiscard]] bool usable() noexcept;
  void give_away_if_gone() noexcept;
  void look_at_errors() noexcept;
  bool take(Inbox& inbox, CanFrame& frame) noexcept;

  std::string interface_;
  CanHealth health_;
  Inbox process_, service_, errors_;
  std::function<Sockets()> open_again_;
  std::atomic<Ends> ends_{Ends::kInUse};
};

}  // namespace knuckle
