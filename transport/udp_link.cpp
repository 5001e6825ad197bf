#include "transport/udp_link.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <utility>

#include "core/error.h"

namespace knuckle {
namespace {

constexpr std::chrono::milliseconds kPeerSilence{1000};  // then the other side may have started anew, from a new port

sockaddr_in parse(const std::string& address) {
  const auto colon = address.rfind(':');
  const std::string host = address.substr(0, colon);
  std::uint16_t port = 0;
  sockaddr_in result{};
  result.sin_family = AF_INET;
  bool good = colon != std::string::npos && inet_pton(AF_INET, host.c_str(), &result.sin_addr) == 1;
  if (good) {
    const char* first = address.data() + colon + 1;
    const char* last = address.data() + address.size();
    const auto [end, error] = std::from_chars(first, last, port);
    good = error == std::errc() && end == last;
  }
  if (!good) throw InputError("link: \"" + address + "\" is not an IPv4 ADDR:PORT such as 127.0.0.1:5683");
  result.sin_port = htons(port);
  return result;
}

using Attach = int (*)(int, const sockaddr*, socklen_t);

int open_socket(const std::string& address, Attach attach, const char* what) {
  const sockaddr_in target = parse(address);
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket >= 0 && attach(socket, reinterpret_cast<const sockaddr*>(&target), sizeof target) == 0) return socket;
  const std::string reason = std::strerror(errno);
  if (socket >= 0) ::close(socket);
  throw InputError(std::string("link: cannot ") + what + " " + address + ": " + reason);
}

}  // namespace

UdpLink UdpLink::listen(const std::string& address) {
  return {open_socket(address, ::bind, "listen on"), true};
}

UdpLink UdpLink::connect(const std::string& address) {
  return {open_socket(address, ::connect, "reach"), false};
}

UdpLink::UdpLink(UdpLink&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      listening_(other.listening_),
      peer_(other.peer_),
      heard_at_(other.heard_at_) {}

UdpLink::~UdpLink() {
  if (socket_ >= 0) ::close(socket_);
}

bool UdpLink::send(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() > kMaxDatagram || (listening_ && peer_.sin_port == 0)) return false;
  const auto* to = listening_ ? reinterpret_cast<const sockaddr*>(&peer_) : nullptr;
  const socklen_t to_size = listening_ ? sizeof peer_ : 0;
  return ::sendto(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL, to, to_size) == static_cast<ssize_t>(bytes.size());
}

bool UdpLink::receive(Datagram& datagram) noexcept {
  // A connected socket reports the peer's absence (ECONNREFUSED) once per send: that is no datagram, try on.
  for (int attempt = 0; attempt < 16; ++attempt) {
    sockaddr_in from{};
    socklen_t from_size = sizeof from;
    const ssize_t got = ::recvfrom(socket_, datagram.bytes.data(), datagram.bytes.size(), MSG_TRUNC,
                                   reinterpret_cast<sockaddr*>(&from), &from_size);
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return false;
    if (got < 0 || static_cast<std::size_t>(got) > kMaxDatagram) continue;
    datagram.size = static_cast<std::uint16_t>(got);
    if (listening_ && !belongs_to(from)) continue;
    return true;
  }
  return false;
}

bool UdpLink::belongs_to(const sockaddr_in& from) noexcept {
  const auto now = std::chrono::steady_clock::now();
  const bool same = from.sin_port == peer_.sin_port && from.sin_addr.s_addr == peer_.sin_addr.s_addr;
  if (!same && peer_.sin_port != 0 && now - heard_at_ < kPeerSilence) return false;
  peer_ = from;
  heard_at_ = now;
  return true;
}

std::uint16_t UdpLink::port() const noexcept {
  sockaddr_in local{};
  socklen_t size = sizeof local;
  if (::getsockname(socket_, reinterpret_cast<sockaddr*>(&local), &size) != 0) return 0;
  return ntohs(local.sin_port);
}

}  // namespace knuckle
