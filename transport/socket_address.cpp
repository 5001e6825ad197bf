#include "transport/socket_address.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include "core/descriptor.h"
#include "core/error.h"

namespace knuckle {
namespace {

const sockaddr_in6& six(const SocketAddress& address) noexcept {
  return reinterpret_cast<const sockaddr_in6&>(address.bytes);
}
const sockaddr_in& four(const SocketAddress& address) noexcept {
  return reinterpret_cast<const sockaddr_in&>(address.bytes);
}
bool is_six(const SocketAddress& address) noexcept {
  return address.bytes.ss_family == AF_INET6;
}

/// An address as it was given, and for what.
struct Given {
  const std::string& option;
  const std::string& address;
};

[[noreturn]] void refuse(const Given& given, const std::string& why) {
  throw InputError(given.option + " " + given.address + ": " + why);
}

/// Host and port of "HOST:PORT" or "[ADDR]:PORT"; nullopt where it is neither.
std::optional<std::pair<std::string, std::string>> split(const std::string& address) {
  const auto colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  std::string host = address.substr(0, colon);
  if (host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  } else if (host.find(':') != std::string::npos) {
    return std::nullopt;  // IPv6 without brackets: nobody can tell where the port begins
  }
  return std::pair(host, address.substr(colon + 1));
}

std::uint16_t parse_port(const Given& given, const std::string& text, int least) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port < least)
    refuse(given, "port \"" + text + "\" must be a whole number from " + std::to_string(least) + " to 65535");
  return port;
}

constexpr const char* kNotPermitted =
    "not permitted: it is a broadcast address, or this computer's firewall forbids it";

std::vector<SocketAddress> resolve(const Given& given, bool names) {
  const auto parts = split(given.address);
  if (!parts)
    refuse(given, names ? "is not HOST:PORT such as arm.example.org:5683, 192.0.2.7:5683 or [2001:db8::7]:5683"
                        : "is not ADDR:PORT such as 127.0.0.1:5683 or [::1]:5683");
  const auto& [host, port] = *parts;
  (void)parse_port(given, port, 0);
  addrinfo hints{}, *found = nullptr;
  hints.ai_flags = AI_NUMERICSERV | (names ? 0 : AI_NUMERICHOST);
  hints.ai_socktype = SOCK_DGRAM;
  const int error = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  if (error != 0) {
    refuse(given, names ? "\"" + host + "\" has no address: " + ::gai_strerror(error)
                        : "\"" + host + "\" is not an IPv4 or IPv6 address in numbers");
  }
  std::vector<SocketAddress> result;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    SocketAddress& added = result.emplace_back();
    std::memcpy(&added.bytes, one->ai_addr, one->ai_addrlen);
    added.size = one->ai_addrlen;
  }
  ::freeaddrinfo(found);
  return result;
}

}  // namespace

std::uint16_t SocketAddress::port() const noexcept {
  return ntohs(is_six(*this) ? six(*this).sin6_port : four(*this).sin_port);
}

bool SocketAddress::is_any() const noexcept {
  if (is_six(*this)) return IN6_IS_ADDR_UNSPECIFIED(&six(*this).sin6_addr);
  return four(*this).sin_addr.s_addr == htonl(INADDR_ANY);
}

bool SocketAddress::is_loopback() const noexcept {
  if (is_six(*this)) return IN6_IS_ADDR_LOOPBACK(&six(*this).sin6_addr);
  return (ntohl(four(*this).sin_addr.s_addr) >> 24) == 127;
}

bool operator==(const SocketAddress& a, const SocketAddress& b) noexcept {
  if (a.size == 0 || b.size == 0) return a.size == b.size;
  if (a.bytes.ss_family != b.bytes.ss_family || a.port() != b.port()) return false;
  if (is_six(a)) {
    return IN6_ARE_ADDR_EQUAL(&six(a).sin6_addr, &six(b).sin6_addr) && six(a).sin6_scope_id == six(b).sin6_scope_id;
  }
  return four(a).sin_addr.s_addr == four(b).sin_addr.s_addr;
}

std::string text(const SocketAddress& address) {
  if (address.size == 0) return "nobody";
  std::array<char, INET6_ADDRSTRLEN> host{};
  const void* bytes = is_six(address) ? static_cast<const void*>(&six(address).sin6_addr) : &four(address).sin_addr;
  ::inet_ntop(address.bytes.ss_family, bytes, host.data(), host.size());
  const std::string port = ":" + std::to_string(address.port());
  return is_six(address) ? "[" + std::string(host.data()) + "]" + port : host.data() + port;
}

HostAndPort parse_host_and_port(const std::string& address, const std::string& option) {
  const Given given{option, address};
  const auto parts = split(address);
  if (!parts) refuse(given, "is not HOST:PORT: a name, 192.0.2.7 or [2001:db8::7], and a port from 1 to 65535");
  return {parts->first, parse_port(given, parts->second, 1)};
}

SocketAddress parse_address(const std::string& address, const std::string& option) {
  return resolve({option, address}, false).front();
}

std::vector<SocketAddress> look_up(const std::string& address, const std::string& option) {
  return resolve({option, address}, true);
}

SocketAddress look_up_one(const std::string& address, const std::string& option) {
  const std::vector<SocketAddress> found = look_up(address, option);
  const auto chosen = std::find_if(found.begin(), found.end(), [](const SocketAddress& one) { return !is_six(one); });
  const SocketAddress target = chosen == found.end() ? found.front() : *chosen;
  if (target.port() == 0)
    refuse({option, address}, "port 0 cannot be used; give the port that the other side listens on");
  if (target.is_any()) refuse({option, address}, "is no single computer's address");
  return target;
}

std::string why_not_bound(int error) {
  switch (error) {
    case EADDRINUSE:
      return "another program has this port";
    case EADDRNOTAVAIL:
      return "this computer has no such address";
    case EACCES:
      return "not permitted; ports below 1024 need CAP_NET_BIND_SERVICE";
    case EAFNOSUPPORT:
      return "this computer has no IPv6";
    case ENETUNREACH:
    case EHOSTUNREACH:
      return "no route to it";
    default:
      return std::strerror(error);
  }
}

int open_udp_socket(const std::string& name, const SocketAddress& address, Attach attach, const char* what) {
  Descriptor socket(::socket(address.bytes.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (socket && attach(socket.get(), address.get(), address.size) == 0) return socket.release();
  const int error = errno;
  throw InputError(std::string("link: cannot ") + what + " " + name + ": " +
                   (attach == ::connect && error == EACCES ? kNotPermitted : why_not_bound(error)));
}

SocketAddress local_address(int socket) noexcept {
  SocketAddress local;
  local.size = sizeof local.bytes;
  if (::getsockname(socket, local.get(), &local.size) != 0) return {};
  return local;
}

}  // namespace knuckle
