#include "transport/udp_link.h"

#include <netdb.h>
#include <netinet/in.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include "core/error.h"

namespace knuckle {
namespace {

constexpr std::chrono::milliseconds kPeerSilence{1000};  // then the other side may have started anew, from a new port

struct Address {
  sockaddr_storage bytes{};
  socklen_t size = 0;
  [[nodiscard]] const sockaddr* get() const noexcept { return reinterpret_cast<const sockaddr*>(&bytes); }
};

std::uint16_t port_of(const sockaddr_storage& address) noexcept {
  const bool six = address.ss_family == AF_INET6;
  return ntohs(six ? reinterpret_cast<const sockaddr_in6&>(address).sin6_port
                   : reinterpret_cast<const sockaddr_in&>(address).sin_port);
}

bool is_any(const Address& address) noexcept {
  if (address.bytes.ss_family == AF_INET6) {
    return IN6_IS_ADDR_UNSPECIFIED(&reinterpret_cast<const sockaddr_in6&>(address.bytes).sin6_addr);
  }
  return reinterpret_cast<const sockaddr_in&>(address.bytes).sin_addr.s_addr == htonl(INADDR_ANY);
}

bool same_peer(const sockaddr_storage& a, const sockaddr_storage& b) noexcept {
  if (a.ss_family != b.ss_family || port_of(a) != port_of(b)) return false;
  if (a.ss_family == AF_INET6) {
    const auto& left = reinterpret_cast<const sockaddr_in6&>(a);
    const auto& right = reinterpret_cast<const sockaddr_in6&>(b);
    return IN6_ARE_ADDR_EQUAL(&left.sin6_addr, &right.sin6_addr) && left.sin6_scope_id == right.sin6_scope_id;
  }
  return reinterpret_cast<const sockaddr_in&>(a).sin_addr.s_addr ==
         reinterpret_cast<const sockaddr_in&>(b).sin_addr.s_addr;
}

[[noreturn]] void refuse(const std::string& address, const std::string& why) {
  throw InputError("link: " + address + ": " + why);
}

/// Host and port of "ADDR:PORT" or "[ADDR]:PORT"; nullopt where it is neither.
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

std::uint16_t parse_port(const std::string& address, const std::string& text) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size()) {
    refuse(address, "port \"" + text + "\" must be a whole number from 0 to 65535");
  }
  return port;
}

/// Numbers only: a name would have to be looked up, which can take seconds and change its answer.
Address parse(const std::string& address) {
  const auto parts = split(address);
  if (!parts) refuse(address, "is not ADDR:PORT such as 127.0.0.1:5683 or [::1]:5683");
  const auto& [host, port] = *parts;
  (void)parse_port(address, port);
  addrinfo hints{}, *found = nullptr;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_DGRAM;
  if (::getaddrinfo(host.c_str(), port.c_str(), &hints, &found) != 0) {
    refuse(address, "\"" + host + "\" is not an IPv4 or IPv6 address in numbers");
  }
  Address result;
  std::memcpy(&result.bytes, found->ai_addr, found->ai_addrlen);
  result.size = found->ai_addrlen;
  ::freeaddrinfo(found);
  return result;
}

std::string reason_of(int error) {
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

using Attach = int (*)(int, const sockaddr*, socklen_t);

int open_socket(const std::string& name, const Address& address, Attach attach, const char* what) {
  const int socket = ::socket(address.bytes.ss_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket >= 0 && attach(socket, address.get(), address.size) == 0) return socket;
  const int error = errno;
  if (socket >= 0) ::close(socket);
  throw InputError(std::string("link: cannot ") + what + " " + name + ": " + reason_of(error));
}

}  // namespace

UdpLink UdpLink::listen(const std::string& address) {
  return {open_socket(address, parse(address), ::bind, "listen on"), true};
}

UdpLink UdpLink::connect(const std::string& address) {
  const Address target = parse(address);
  if (port_of(target.bytes) == 0)
    refuse(address, "port 0 cannot be used; give the port that the other side listens on");
  if (is_any(target)) refuse(address, "is no single computer's address");
  return {open_socket(address, target, ::connect, "reach"), false};
}

UdpLink::UdpLink(UdpLink&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      listening_(other.listening_),
      peer_(other.peer_),
      peer_size_(other.peer_size_),
      heard_at_(other.heard_at_) {}

UdpLink::~UdpLink() {
  if (socket_ >= 0) ::close(socket_);
}

bool UdpLink::send(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() > kMaxDatagram || (listening_ && peer_size_ == 0)) return false;
  const auto* to = listening_ ? reinterpret_cast<const sockaddr*>(&peer_) : nullptr;
  const ssize_t sent = ::sendto(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL, to, listening_ ? peer_size_ : 0);
  if (sent < 0 && errno == ECONNREFUSED) refused_.store(true, std::memory_order_relaxed);
  return sent == static_cast<ssize_t>(bytes.size());
}

bool UdpLink::receive(Datagram& datagram) noexcept {
  // A connected socket reports the peer's absence (ECONNREFUSED) once per send: that is no datagram, try on.
  for (int attempt = 0; attempt < 16; ++attempt) {
    sockaddr_storage from{};
    socklen_t from_size = sizeof from;
    const ssize_t got = ::recvfrom(socket_, datagram.bytes.data(), datagram.bytes.size(), MSG_TRUNC,
                                   reinterpret_cast<sockaddr*>(&from), &from_size);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return false;
    if (got < 0 && errno == ECONNREFUSED) refused_.store(true, std::memory_order_relaxed);
    if (got < 0 || static_cast<std::size_t>(got) > kMaxDatagram) continue;
    datagram.size = static_cast<std::uint16_t>(got);
    if (listening_ && !belongs_to(from, from_size)) continue;
    refused_.store(false, std::memory_order_relaxed);
    return true;
  }
  return false;
}

bool UdpLink::belongs_to(const sockaddr_storage& from, socklen_t size) noexcept {
  const auto now = std::chrono::steady_clock::now();
  if (peer_size_ != 0 && !same_peer(from, peer_) && now - heard_at_ < kPeerSilence) return false;
  peer_ = from;
  peer_size_ = size;
  heard_at_ = now;
  return true;
}

std::uint16_t UdpLink::port() const noexcept {
  sockaddr_storage local{};
  socklen_t size = sizeof local;
  if (::getsockname(socket_, reinterpret_cast<sockaddr*>(&local), &size) != 0) return 0;
  return port_of(local);
}

}  // namespace knuckle
