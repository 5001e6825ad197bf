// The link over a UDP socket (IPv4, non-blocking). One end listens and answers whoever spoke last; the other connects.
#pragma once

#include <netinet/in.h>

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
  /// Longer datagrams than kMaxDatagram are skipped.
  bool receive(Datagram& datagram) noexcept override;
  /// Local port, as bound.
  [[nodiscard]] std::uint16_t port() const noexcept;

 private:
  UdpLink(int socket, bool listening) noexcept : socket_(socket), listening_(listening) {}
  int socket_;
  bool listening_;
  sockaddr_in peer_{};  ///< Listening end: who spoke last; port 0 = nobody yet.
};

}  // namespace knuckle
