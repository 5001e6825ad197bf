#include "transport/udp_link.h"

#include <cerrno>
#include <utility>

#include "transport/link_messages.h"
#include "transport/other_version.h"

namespace knuckle {
namespace {

constexpr std::chrono::milliseconds kPeerSilence{1000};  // then the other side may have started anew, from a new port
constexpr std::chrono::milliseconds kSayPlain{500}, kEncryptedLately{5000};

}  // namespace

UdpLink UdpLink::listen(const std::string& address) {
  return {open_udp_socket(address, parse_address(address), ::bind, "listen on"), true};
}

UdpLink UdpLink::connect(const std::string& address, const std::string& option) {
  return {open_udp_socket(address, look_up_one(address, option), ::connect, "reach"), false};
}

UdpLink::UdpLink(UdpLink&& other) noexcept
    : socket_(std::move(other.socket_)), listening_(other.listening_), peer_(other.peer_), heard_at_(other.heard_at_) {}

bool UdpLink::send(std::span<const std::uint8_t> bytes) noexcept {
  release_silent_peer();
  if (bytes.size() > kMaxDatagram || (listening_ && peer_.size == 0)) return false;
  const int error = socket_.send(bytes, peer_);
  if (error == ECONNREFUSED) refused_.store(true, std::memory_order_relaxed);
  return error == 0;
}

bool UdpLink::receive(Datagram& datagram) noexcept {
  // A connected socket reports the peer's absence (ECONNREFUSED) once per send: that is no datagram, try on.
  emptied_ = false;
  for (int attempt = 0; attempt < 16; ++attempt) {
    SocketAddress from;
    const auto arrival = socket_.receive(datagram.bytes, from);
    if (!arrival) {
      emptied_ = errno == EAGAIN || errno == EWOULDBLOCK;
      if (emptied_) return false;
      if (errno == ECONNREFUSED) refused_.store(true, std::memory_order_relaxed);
      continue;
    }
    if (arrival->size > kMaxDatagram) continue;
    datagram.size = static_cast<std::uint16_t>(arrival->size);
    datagram.waited = arrival->waited;
    if (is_encrypted(datagram.view())) {
      hear_encrypted(from);
      continue;
    }
    other_version_.note(datagram.view());
    if (listening_ && !belongs_to(from, datagram)) continue;
    refused_.store(false, std::memory_order_relaxed);
    return true;
  }
  return false;
}

/// Of a far end without --insecure. All that comes of it are words: here, and there.
void UdpLink::hear_encrypted(const SocketAddress& from) noexcept {
  const auto now = std::chrono::steady_clock::now();
  if (now - encrypted_at() >= kSayPlain && listening_ && peer_.size == 0) (void)socket_.send(kPlainHere, from);
  encrypted_at_.store(now.time_since_epoch().count(), std::memory_order_relaxed);
}

std::chrono::steady_clock::time_point UdpLink::encrypted_at() const noexcept {
  using Clock = std::chrono::steady_clock;
  return Clock::time_point(Clock::duration(encrypted_at_.load(std::memory_order_relaxed)));
}

bool UdpLink::heard_encrypted() const noexcept {
  return std::chrono::steady_clock::now() - encrypted_at() < kEncryptedLately;
}

/// Only what an operator's side says claims this end, and keeps it.
bool UdpLink::belongs_to(const SocketAddress& from, const Datagram& datagram) noexcept {
  release_silent_peer();
  if (peer_.size != 0 && !(from == peer_)) return false;
  if (!decode_master(datagram.view())) return peer_.size != 0;
  if (peer_.size == 0) {
    peer_ = from;
    socket_.hear_only_from(peer_);
  }
  heard_at_ = std::chrono::steady_clock::now();
  return true;
}

void UdpLink::release_silent_peer() noexcept {
  if (peer_.size == 0 || !listening_ || std::chrono::steady_clock::now() - heard_at_ < kPeerSilence) return;
  peer_ = {};
  socket_.hear_all();
}

}  // namespace knuckle
