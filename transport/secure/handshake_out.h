// Sends what a handshake says to one address.
#pragma once

#include "transport/secure/dtls_session.h"
#include "transport/udp_socket.h"

namespace knuckle::secure {

class HandshakeOut final : public DtlsSession::Out {
 public:
  /// Both outlive it.
  HandshakeOut(const UdpSocket& socket, const SocketAddress& address) : socket_(socket), address_(address) {}
  void put(std::span<const std::uint8_t> bytes) override { (void)socket_.send(bytes, address_); }

 private:
  const UdpSocket& socket_;
  const SocketAddress& address_;
};

}  // namespace knuckle::secure
