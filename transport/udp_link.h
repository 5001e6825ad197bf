// The link over a UDP socket (IPv4 or IPv6, non-blocking). One end listens and belongs to the operator's side whose
// messages it heard first, until that one has been silent for a second; the other connects. Nothing is encrypted or
// proven: for loopback, tests, and inside a tunnel that does both.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "transport/link.h"
#include "transport/other_version.h"
#include "transport/udp_socket.h"

namespace knuckle {

class UdpLink final : public Link {
 public:
  /// The machine's end: bound to "ADDR:PORT" ("[ADDR]:PORT" for IPv6; 0.0.0.0 and [::] are every address of this
  /// computer); port 0 lets the system choose.
  /// @throws InputError for a malformed address, or where it cannot be bound.
  [[nodiscard]] static UdpLink listen(const std::string& address);
  /// The operator's end: sends to "HOST:PORT" (look_up_one()) and hears only that address.
  /// @throws InputError for a malformed address, a name without one, port 0, or where there is no way to it.
  /// @param option whose value it is, for the message.
  [[nodiscard]] static UdpLink connect(const std::string& address, const std::string& option = "link:");
  UdpLink(UdpLink&& other) noexcept;
  UdpLink& operator=(UdpLink&&) = delete;
  ~UdpLink() override = default;

  /// False where the system refused, or where a listening end has heard nobody within the last second.
  bool send(std::span<const std::uint8_t> bytes) noexcept override;
  /// Longer datagrams than kMaxDatagram, and those of strangers, are skipped.
  bool receive(Datagram& datagram) noexcept override;
  [[nodiscard]] bool emptied() const noexcept override { return emptied_; }
  /// Local port, as bound.
  [[nodiscard]] std::uint16_t port() const noexcept { return local_address(socket_.descriptor()).port(); }
  /// A connecting end was told, since it last heard a datagram, that nobody listens there. Any thread.
  [[nodiscard]] bool refused() const noexcept { return refused_.load(std::memory_order_relaxed); }
  /// Within the last 5 s, DTLS has come: by its looks, which anybody can give it. Any thread.
  [[nodiscard]] bool heard_encrypted() const noexcept;
  /// Of the messages of a far end that this one does not understand; 0: there were none of late. Any thread.
  [[nodiscard]] std::uint8_t other_version() const noexcept { return other_version_.heard(); }

 private:
  UdpLink(int socket, bool listening) noexcept : socket_(socket), listening_(listening) {}
  [[nodiscard]] bool belongs_to(const SocketAddress& from, const Datagram& datagram) noexcept;
  void release_silent_peer() noexcept;
  void hear_encrypted(const SocketAddress& from) noexcept;
  [[nodiscard]] std::chrono::steady_clock::time_point encrypted_at() const noexcept;

  UdpSocket socket_;
  bool listening_;
  bool emptied_ = false;                              ///< By the last receive() that found nothing.
  SocketAddress peer_;                                ///< Listening end: whom it belongs to.
  std::chrono::steady_clock::time_point heard_at_{};  ///< The peer's last message.
  std::atomic<bool> refused_{false};
  std::atomic<std::chrono::steady_clock::rep> encrypted_at_{0};  ///< Since the clock's epoch.
  OtherVersion other_version_;
};

}  // namespace knuckle
