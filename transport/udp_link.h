// The link over a UDP socket (IPv4, non-blocking). One end listens and belongs to who spoke first, until
// that one has been silent for a second; the other connects. Nothing is encrypted or proven: loopback and tests only.
#pragma once

#include <netinet/in.h>

#include <chrono>
#include <cstdint>
#include <string>

#include "transport/link.h"

namespace knuckle {

class UdpLink final : public Link {
 public:
  /// The machine's end: bound to "ADDR:PORT"; port 0 lets the system choose.
  /// @throws InputError for a malformed address; or where it cannot be bound.
  [[nodiscard]] static UdpLink listen(const std::string& address);
  /// The operator's end: sends to "ADDR:PORT" and hears only that address. @throws InputError as above.
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

 private:
  UdpLink(int socket, bool listening) noexcept : socket_(socket), listening_(listening) {}
  int socket_;
  bool listening_;
  [[nodiscard]] bool belongs_to(const sockaddr_in& from) noexcept;

  sockaddr_in peer_{};                                ///< Listening end: whom it belongs to; port 0 = nobody yet.
  std::chrono::steady_clock::time_point heard_at_{};  ///< The peer, last.
};

}  // namespace knuckle
