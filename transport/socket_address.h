// Addresses of UDP sockets: read from text, compared, written for people.
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <string>
#include <vector>

namespace knuckle {

struct SocketAddress {
  sockaddr_storage bytes{};
  socklen_t size = 0;  ///< 0: none.

  [[nodiscard]] const sockaddr* get() const noexcept { return reinterpret_cast<const sockaddr*>(&bytes); }
  [[nodiscard]] sockaddr* get() noexcept { return reinterpret_cast<sockaddr*>(&bytes); }
  [[nodiscard]] std::uint16_t port() const noexcept;
  /// Every address of this computer: 0.0.0.0 or [::].
  [[nodiscard]] bool is_any() const noexcept;
  /// Of this computer itself: 127.0.0.0/8 or ::1.
  [[nodiscard]] bool is_loopback() const noexcept;
  /// Same host and port (and scope, for IPv6).
  friend bool operator==(const SocketAddress& a, const SocketAddress& b) noexcept;
};

/// "192.0.2.7:5683", "[2001:db8::7]:5683"; "nobody" where there is none.
[[nodiscard]] std::string text(const SocketAddress& address);

struct HostAndPort {
  std::string host;  ///< Name, or address in numbers, without brackets.
  std::uint16_t port = 0;
  friend bool operator==(const HostAndPort&, const HostAndPort&) = default;
};
/// Of "HOST:PORT" or "[ADDR]:PORT"; nothing is looked up. @param option whose value it is, for the message.
/// @throws InputError, one line, where it is neither, and for port 0.
[[nodiscard]] HostAndPort parse_host_and_port(const std::string& address, const std::string& option = "link:");
/// @param address "ADDR:PORT", "[ADDR]:PORT" for IPv6, in numbers. @param option whose value it is, for the message.
/// @throws InputError, one line, where it is not.
[[nodiscard]] SocketAddress parse_address(const std::string& address, const std::string& option = "link:");
/// The same, or "NAME:PORT": looked up, which may take seconds. All that the name stands for, best first; never empty.
/// @throws InputError, one line, also where the name has no address.
[[nodiscard]] std::vector<SocketAddress> look_up(const std::string& address, const std::string& option = "link:");
/// Where to send to, for a sender that cannot hear which of a name's addresses answers: the best, IPv4 before IPv6.
/// @throws InputError likewise, and for port 0 and for an address that is of no single computer.
[[nodiscard]] SocketAddress look_up_one(const std::string& address, const std::string& option = "link:");

using Attach = int (*)(int socket, const sockaddr* address, socklen_t size);
/// A non-blocking UDP socket, bound or connected. @param attach ::bind or ::connect. @param what "listen on"
/// @throws InputError "link: cannot WHAT NAME: why".
[[nodiscard]] int open_udp_socket(const std::string& name, const SocketAddress& address, Attach attach,
                                  const char* what);
/// Why a socket was refused an address of this computer, by errno: "another program has this port".
[[nodiscard]] std::string why_not_bound(int error);
/// As bound.
[[nodiscard]] SocketAddress local_address(int socket) noexcept;

}  // namespace knuckle
