// What every UDP socket of the link does: send without waiting, receive with the time that a datagram waited in the
// kernel, and have the kernel drop what is not for it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/descriptor.h"
#include "core/time.h"
#include "transport/socket_address.h"

namespace knuckle {

/// One socket, closed at its end.
class UdpSocket {
 public:
  UdpSocket() = default;
  explicit UdpSocket(int descriptor) noexcept;

  [[nodiscard]] int descriptor() const noexcept { return descriptor_.get(); }

  /// @param to size 0: where the socket is connected to. @return 0, or errno.
  int send(std::span<const std::uint8_t> bytes, const SocketAddress& to) const noexcept;

  struct Arrival {
    std::size_t size = 0;  ///< Also where it is more than there was room for.
    Duration waited{};     ///< From its arrival at this computer until now.
  };
  /// @return nullopt where nothing is there, or errno tells what is wrong.
  std::optional<Arrival> receive(std::span<std::uint8_t> bytes, SocketAddress& from) const noexcept;

  /// While on, next_refusal() has the ports where nobody listens, and a send() or receive() after one may fail once.
  void hear_refusals(bool on) const noexcept;
  /// Where a datagram was sent to, and the computer there answered (ICMP) that no program has the port. Anybody can
  /// forge that: for a message, not for a decision. Any thread.
  [[nodiscard]] std::optional<SocketAddress> next_refusal() const noexcept;

  // A filter in the kernel: what it drops costs the receiver neither time nor room. Where the kernel takes none, all
  // comes through and the receiver has to tell.
  static constexpr std::size_t kMostBeginnings = 4;
  void hear_only_from(const SocketAddress& source) const noexcept;
  /// What begins with one of these 8 bytes, at most kMostBeginnings of them; nothing where there are none.
  void hear_only_beginning_with(std::span<const std::array<std::uint8_t, 8>> beginnings) const noexcept;
  void hear_all() const noexcept;

 private:
  Descriptor descriptor_;
};

/// Two sockets on one address and port: datagrams whose first byte is at least `mark` come to the first, others to the
/// second. @throws InputError where the address cannot be bound.
struct SocketPair {
  UdpSocket marked, unmarked;
};
[[nodiscard]] SocketPair open_socket_pair(const std::string& name, const SocketAddress& address, std::uint8_t mark);

}  // namespace knuckle
