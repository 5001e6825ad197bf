// The link over a UDP socket (IPv4 or IPv6, non-blocking). One end listens and belongs to who spoke first, until that
// one has been silent for a second; the other connects. Nothing is encrypted or proven: for loopback, tests, and inside
// a tunnel that does both.
#pragma once

#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "transport/link.h"

namespace knuckle {

class UdpLink final : public Link {
 public:
  /// The machine's end: bound to "ADDR:PORT" ("[ADDR]:PORT" for IPv6; 0.0.0.0 and [::] are every address of this
  /// computer); port 0 lets the system choose.
  /// @throws InputError for a malformed address, or where it cannot be bound.
  [[nodiscard]] static UdpLink listen(const std::string& address);
  /// The operator's end: sends to "ADDR:PORT" and hears only that address.
  /// @throws InputError for a malformed address, port 0, or where there is no way to it.
  [[nodiscard]] static UdpLink connect(const std::string& address);
  UdpLink(UdpLink&& other) noexcept;
  UdpLink& operator=(UdpLink&&) = delete;
  ~UdpLink() override;

  /// False where the system refused, or where a listening end has not heard anybody yet.
  bool send(std::span<const std::uint8_t> bytes) noexcept override;
  /// Longer datagrams than kMaxDatagram, and those of strangers, are skipped.
  bool receive(Datagram& datagram) noexcept override;
  /// Local port, as bound.
  [[nodiscard]] std::uint16_t port() const noexcept;
  /// A connecting end was told, since it last heard a datagram, that nobody listens there. Any thread.
  [[nodiscard]] bool refused() const noexcept { return refused_.load(std::memory_order_relaxed); }

 private:
  UdpLink(int socket, bool listening) noexcept : socket_(socket), listening_(listening) {}
  [[nodiscard]] bool belongs_to(const sockaddr_storage& from, socklen_t size) noexcept;

  int socket_;
  bool listening_;
  sockaddr_storage peer_{};                           ///< Listening end: whom it belongs to.
  socklen_t peer_size_ = 0;                           ///< 0: nobody yet.
  std::chrono::steady_clock::time_point heard_at_{};  ///< The peer, last.
  std::atomic<bool> refused_{false};
};

}  // namespace knuckle
