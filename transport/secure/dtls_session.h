// One DTLS 1.2 session (RFC 6347) by OpenSSL, without a socket: datagrams in, datagrams out. The handshake allocates
// and takes milliseconds: it belongs to a thread that is not real-time. What is sealed and opened afterwards allocates
// nothing and may change over to another thread, never used by two at a time.
#pragma once

#include <openssl/types.h>

#include <array>
#include <bit>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "transport/link.h"
#include "transport/secure/identity.h"
#include "transport/secure/video_key.h"
#include "transport/socket_address.h"
#include "transport/udp_socket.h"

namespace knuckle::secure {

/// Why a handshake was refused, by this end or the far one.
enum class Refusal : std::uint8_t {
  kNone,
  kNoCertificate,  ///< The far end showed none.
  kUnknownPeer,    ///< It is not paired here, ...
  kRevokedPeer,    ///< ... was once, ...
  kExpiredPeer,    ///< ... or its certificate has expired.
  kNotKnownThere,  ///< The same, as the far end says it of this one.
  kRevokedThere,
  kExpiredThere,
  kProtocol,       ///< Another version, another cipher, or no DTLS at all.
  kSilence,        ///< It did not answer in time.
  kBusy,           ///< Somebody else has control.
  kFull,           ///< As many observe as may.
  kObserverThere,  ///< The far end lets this one observe, but not control.
  kObserver,       ///< The same, as this end says it of the far one.
  kNoObservers,    ///< The far end admits none.
  kPortClosed,     ///< Its computer says that no program has this port.
  kPlain,          ///< The far end speaks plain UDP.
  kPairsThere,     ///< The far end is knuckle pair, this one is not; ...
  kNoPairThere,    ///< ... the other way round; ...
  kWantsToPair,    ///< ... the same two, as the machine's side says them of the far end.
  kWantsNoPairing,
};
/// One line: what is wrong and what to do.
[[nodiscard]] const char* text(Refusal refusal) noexcept;

enum class Role : std::uint8_t {
  kMachine,   ///< DTLS server.
  kOperator,  ///< DTLS client.
};

/// What an operator's end connects for; said in its hello (ALPN, RFC 7301). Who says nothing wants control.
enum class Purpose : std::uint8_t {
  kControl,
  kObserve,  ///< Hears the machine's messages, is heard by no loop.
  kTry,      ///< Only to know whether the handshake succeeds (doctor).
  kPair,     ///< To get to know each other: whoever has a certificate is let in. Meets only an end that pairs, too.
};

inline constexpr std::size_t kTagSize = 8;
/// Of a datagram with a sealed message: tag, record header, explicit nonce, authentication tag, kind.
inline constexpr std::size_t kSealOverhead = kTagSize + 13 + 8 + 16 + 1;
inline constexpr std::uint8_t kTagMark = 0xC0;  ///< First bytes from here on are tags; those of DTLS are all below.
/// First bytes from here on, up to kTagMark, are the tags of what observers send: it goes to the handshakes' socket.
inline constexpr std::uint8_t kObserverTagMark = 0x80;

using Tag = std::array<std::uint8_t, kTagSize>;
[[nodiscard]] inline std::uint64_t number_of(const Tag& tag) noexcept {
  return std::bit_cast<std::uint64_t>(tag);
}
inline constexpr std::size_t kMostReceived = 2048;  ///< No datagram of ours is longer.
/// DTLS 1.2 record of epoch 0 with a ClientHello.
[[nodiscard]] bool is_hello(std::span<const std::uint8_t> bytes) noexcept;

/// What travels inside a session.
enum class Inner : std::uint8_t {
  kMessage = 0,    ///< Of the loops.
  kChallenge = 1,  ///< To an address that is new: 8 bytes ...
  kResponse = 2,   ///< ... that come back from there.
  kAnswer = 3,     ///< To who is not let in: a Refusal, then the name of who has control.
  kAsked = 4,      ///< To who has control: fingerprint and name of somebody who asks for it.
  kGrant = 5,      ///< The answer: the fingerprint of who may have it.
  kAlive = 6,      ///< Of an observer, empty.
  kVerdict = 7,    ///< Of two ends that pair: what each says of the code (app/pairing).
};

struct Sealed {
  std::size_t size = 0;
  std::array<std::uint8_t, kMaxDatagram + kSealOverhead> bytes{};
  [[nodiscard]] std::span<const std::uint8_t> view() const noexcept { return {bytes.data(), size}; }
};

/// What all sessions of an end have in common: its identity, and whom it lets in.
class DtlsContext {
 public:
  /// @param purpose of an operator's end; of a machine's, only whether it is kPair matters.
  DtlsContext(const Identity& identity, Peers peers, Role role, Purpose purpose = Purpose::kControl);
  ~DtlsContext();
  DtlsContext(const DtlsContext&) = delete;
  DtlsContext& operator=(const DtlsContext&) = delete;

  [[nodiscard]] Role role() const noexcept { return role_; }
  /// The thread that makes the handshakes: whom this end lets in from now on.
  void set_peers(Peers peers) { peers_ = std::move(peers); }
  [[nodiscard]] const Peer* find(const Fingerprint& fingerprint) const noexcept;
  /// Whether this end lets it in now.
  [[nodiscard]] Refusal judge(const X509* certificate, Purpose purpose) const noexcept;
  /// Cookies made from now on differ; those of before the last call but one count no more.
  void renew_cookies();

 private:
  friend class DtlsSession;
  struct Impl;
  /// Whether an end of this purpose is one for this end.
  [[nodiscard]] Refusal judge(Purpose purpose) const noexcept;
  Role role_;
  bool pairs_;
  Peers peers_;
  std::unique_ptr<Impl> impl_;
};

class DtlsSession {
 public:
  /// Where the datagrams of a handshake go.
  class Out {
   public:
    virtual ~Out() = default;
    virtual void put(std::span<const std::uint8_t> bytes) = 0;
  };
  enum class Progress : std::uint8_t { kUnderWay, kDone, kFailed };

  /// The context outlives it.
  explicit DtlsSession(const DtlsContext& context);
  ~DtlsSession();
  DtlsSession(const DtlsSession&) = delete;
  DtlsSession& operator=(const DtlsSession&) = delete;

  // The handshake.
  /// Machine's side: a first hello is answered with a cookie, nothing is kept of it (RFC 6347, 4.2.1).
  /// @return whether this one brought the cookie of its address: then the handshake goes on.
  bool hear_hello(std::span<const std::uint8_t> datagram, const SocketAddress& from, Out& out);
  Progress start(Out& out);
  Progress hear(std::span<const std::uint8_t> datagram, Out& out);
  /// Sends again what may be lost, where it is time to.
  Progress tend(Out& out);
  [[nodiscard]] Refusal refusal() const noexcept;
  /// Of the far end; valid once it has shown its certificate.
  [[nodiscard]] const std::optional<Fingerprint>& peer() const noexcept;
  /// Once its handshake is done.
  [[nodiscard]] Certificate peer_certificate() const;
  /// As it calls itself.
  [[nodiscard]] const std::string& peer_name() const noexcept;
  /// When its certificate expires, "2031-11-24T05:00:00Z".
  [[nodiscard]] const std::string& peer_expires_utc() const noexcept;
  /// Machine's side: what the far end connects for.
  [[nodiscard]] Purpose purpose() const noexcept;

  // After it.
  [[nodiscard]] const VideoSecret& video_secret() const noexcept { return video_secret_; }
  [[nodiscard]] const Tag& receive_tag() const noexcept { return receive_tag_; }
  /// Has it this session's tag?
  [[nodiscard]] bool mine(std::span<const std::uint8_t> datagram) const noexcept;
  bool seal(Inner kind, std::span<const std::uint8_t> plain, Sealed& sealed) noexcept;
  /// That this end has closed the session.
  bool seal_farewell(Sealed& sealed) noexcept;
  struct Opened {
    Inner kind = Inner::kMessage;
    bool newest = false;  ///< No record that was sent later has been opened before.
  };
  /// nullopt for whatever is not authentic, or has been opened before.
  std::optional<Opened> open(std::span<const std::uint8_t> datagram, Datagram& plain) noexcept;
  [[nodiscard]] bool closed() const noexcept { return closed_; }  ///< By the far end.

 private:
  friend class DtlsContext;  // its callbacks
  struct Wire;
  Progress progress(int result);
  void export_secrets();
  bool drop_messages();  // false: something else in the datagram has ended the session

  const DtlsContext& context_;
  std::unique_ptr<Wire> wire_;
  SSL* ssl_ = nullptr;
  Tag receive_tag_{}, send_tag_{};
  VideoSecret video_secret_{};
  std::uint64_t newest_record_ = 0;
  bool closed_ = false;
};

// Sends what a handshake says to one address.

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
