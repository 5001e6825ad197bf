#include "transport/secure/dtls_session.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace knuckle::secure {
namespace {

constexpr int kHandshakeMtu = 1200;
constexpr unsigned kFirstTimeout_us = 300'000, kLongestTimeout_us = 2'000'000;
constexpr std::size_t kSecretSize = 32;
constexpr char kTagLabel[] = "EXPORTER-knuckle-tag";  // RFC 5705
// Application protocols (RFC 7301) in the order of Purpose, as they travel: length, name.
constexpr std::array<std::string_view, 4> kPurposes{"\x0Fknuckle-control", "\x0Fknuckle-observe", "\x0Bknuckle-try",
                                                    "\x0Cknuckle-pair"};

// Of a record (RFC 6347, 4.1): content type, version, epoch and sequence number, length.
constexpr std::size_t kRecordHeader = 13;
// What an encrypted one has at least: explicit nonce, authentication tag.
constexpr std::size_t kLeastEncrypted = 8 + 16;

std::size_t length_of(std::span<const std::uint8_t> record) noexcept {
  return static_cast<std::size_t>(record[11] << 8 | record[12]);
}
/// After a handshake. OpenSSL ends a session for an encrypted record that is too short to be authentic, which anybody
/// can make, and keeps those of an epoch to come.
bool may_be_authentic(std::span<const std::uint8_t> record) noexcept {
  return record[1] == 0xFE && record[2] == 0xFD && record[3] == 0 && record[4] == 1 &&
         length_of(record) >= kLeastEncrypted;
}
/// What a far end says again: whole records, of its handshake or encrypted. Behind a malformed one OpenSSL would look
/// for others inside of it.
bool may_be_said_again(std::span<const std::uint8_t> datagram) noexcept {
  while (datagram.size() >= kRecordHeader) {
    const std::size_t size = kRecordHeader + length_of(datagram);
    const bool plain = datagram[1] == 0xFE && datagram[2] == 0xFD && datagram[3] == 0 && datagram[4] == 0;
    if (size > datagram.size() || !(plain || may_be_authentic(datagram))) return false;
    datagram = datagram.subspan(size);
  }
  return datagram.empty();
}

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

/// Of a list as it travels, the first that is known; in the list's own memory.
std::optional<std::pair<Purpose, std::span<const unsigned char>>> first_known(std::span<const unsigned char> offered) {
  while (!offered.empty() && offered[0] < offered.size()) {
    const auto one = offered.first(offered[0] + std::size_t{1});
    const std::string_view text(reinterpret_cast<const char*>(one.data()), one.size());
    const auto known = std::find(kPurposes.begin(), kPurposes.end(), text);
    if (known != kPurposes.end()) return std::pair(static_cast<Purpose>(known - kPurposes.begin()), one.subspan(1));
    offered = offered.subspan(one.size());
  }
  return std::nullopt;
}

Purpose purpose_of(const SSL* ssl) {
  const unsigned char* name = nullptr;
  unsigned size = 0;
  SSL_get0_alpn_selected(ssl, &name, &size);
  for (std::size_t i = 0; i < kPurposes.size(); ++i) {
    if (size > 0 && kPurposes[i].substr(1) == std::string_view(reinterpret_cast<const char*>(name), size))
      return static_cast<Purpose>(i);
  }
  return Purpose::kControl;
}

void must(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string("OpenSSL: ") + what + " failed");
}

}  // namespace

bool is_hello(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::size_t kTypeOfMessage = 13;
  constexpr std::uint8_t kHandshakeRecord = 22, kClientHello = 1;
  return bytes.size() > kTypeOfMessage && bytes[0] == kHandshakeRecord && bytes[3] == 0 && bytes[4] == 0 &&
         bytes[kTypeOfMessage] == kClientHello;
}

const char* text(Refusal refusal) noexcept {
  switch (refusal) {
    case Refusal::kNone:
      return "none";
    case Refusal::kNoCertificate:
      return "the far end showed no certificate: it is no Knuckle program, or has no key (knuckle pair)";
    case Refusal::kUnknownPeer:
      return "the far end is not paired with this computer: compare fingerprints, then knuckle pair";
    case Refusal::kRevokedPeer:
      return "the far end's pairing was revoked here: knuckle pair pairs it anew";
    case Refusal::kExpiredPeer:
      return "the far end's certificate has expired, or one of the two clocks is wrong: make a new key there and pair";
    case Refusal::kNotKnownThere:
      return "the far end does not know this computer: pair there, too (knuckle pair)";
    case Refusal::kRevokedThere:
      return "the far end has revoked this computer's pairing";
    case Refusal::kExpiredThere:
      return "this computer's certificate has expired, or one of the two clocks is wrong: make a new key and pair";
    case Refusal::kProtocol:
      return "no DTLS 1.2 handshake with this version's cipher was possible: is it a Knuckle program, without "
             "--insecure?";
    case Refusal::kSilence:
      return "no answer: is the program running there, with this address and port, and does a firewall let UDP pass?";
    case Refusal::kBusy:
      return "somebody else has control";
    case Refusal::kFull:
      return "as many observers as it admits are connected there";
    case Refusal::kObserverThere:
      return "the far end lets this computer observe only: connect with --observe, or pair there without --observer";
    case Refusal::kObserver:
      return "the far end was paired as an observer and wants control: it connects with --observe, or is paired anew";
    case Refusal::kNoObservers:
      return "the far end admits no observers (--observers 0)";
    case Refusal::kPortClosed:
      return "no program listens on this port: start knuckle slave there, or check the port";
    case Refusal::kPlain:
      return "the far end runs with --insecure and this one does not: start both without it (or, in a lab, both with "
             "it)";
    case Refusal::kPairsThere:
      return "knuckle pair runs there, not knuckle slave: pair, or end it, and start knuckle slave";
    case Refusal::kNoPairThere:
      return "knuckle slave runs there, not knuckle pair: end it, or pair on another port";
    case Refusal::kWantsToPair:
      return "the far end runs knuckle pair, which only another knuckle pair answers: end this program meanwhile, or "
             "pair on another port";
    case Refusal::kWantsNoPairing:
      return "another program than knuckle pair asks here (knuckle master, console or doctor): it is not paired";
  }
  return "unknown";
}

// ---------------------------------------------------------------------------------------------- the wire of a session

/// What OpenSSL reads and writes: one datagram at a time.
struct DtlsSession::Wire {
  std::span<const std::uint8_t> in;
  bool waiting = false;      // `in` has not been read yet
  Out* out = nullptr;        // during the handshake
  Sealed* sealed = nullptr;  // after it
  const DtlsContext* context = nullptr;
  SocketAddress from;  // of the hello
  Refusal refusal = Refusal::kNone;
  std::optional<Fingerprint> peer;
  std::string peer_name, peer_expires_utc;

  static int read(BIO* bio, char* data, int size) noexcept {
    auto& wire = *static_cast<Wire*>(BIO_get_data(bio));
    BIO_clear_retry_flags(bio);
    if (!wire.waiting) {
      BIO_set_retry_read(bio);
      return -1;
    }
    wire.waiting = false;
    const auto count = std::min(wire.in.size(), static_cast<std::size_t>(size));
    std::memcpy(data, wire.in.data(), count);
    return static_cast<int>(count);
  }
  static int write(BIO* bio, const char* data, int size) noexcept {
    auto& wire = *static_cast<Wire*>(BIO_get_data(bio));
    BIO_clear_retry_flags(bio);
    const std::span bytes(reinterpret_cast<const std::uint8_t*>(data), static_cast<std::size_t>(size));
    if (wire.sealed != nullptr) {
      if (kTagSize + bytes.size() <= wire.sealed->bytes.size()) {
        std::memcpy(wire.sealed->bytes.data() + kTagSize, bytes.data(), bytes.size());
        wire.sealed->size = kTagSize + bytes.size();
      }
    } else if (wire.out != nullptr) {
      wire.out->put(bytes);
    }
    return size;
  }
  static long control(BIO* /*bio*/, int command, long /*number*/, void* /*pointer*/) noexcept {
    switch (command) {
      case BIO_CTRL_FLUSH:
      case BIO_CTRL_DGRAM_SET_NEXT_TIMEOUT:
        return 1;
      case BIO_CTRL_DGRAM_QUERY_MTU:
      case BIO_CTRL_DGRAM_GET_FALLBACK_MTU:
        return kHandshakeMtu;
      default:
        return 0;
    }
  }
  static int create(BIO* bio) noexcept {
    BIO_set_init(bio, 1);
    return 1;
  }
};

// ------------------------------------------------------------------------------------------------------- the context

struct DtlsContext::Impl {
  SSL_CTX* ssl = nullptr;
  BIO_METHOD* wire = nullptr;
  using Secret = std::array<unsigned char, kSecretSize>;
  std::array<Secret, 2> cookie_secrets{};  // of now, of before

  ~Impl() {
    SSL_CTX_free(ssl);
    BIO_meth_free(wire);
  }
  /// Whose address it is is all that a cookie says.
  bool cookie(const Secret& secret, const SocketAddress& from, std::array<unsigned char, 32>& cookie) const {
    const std::string address = knuckle::text(from);
    unsigned size = 0;
    return HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
                reinterpret_cast<const unsigned char*>(address.data()), address.size(), cookie.data(),
                &size) != nullptr;
  }
  void renew_cookies() {
    cookie_secrets[1] = cookie_secrets[0];
    must(RAND_bytes(cookie_secrets[0].data(), static_cast<int>(cookie_secrets[0].size())) == 1, "random number");
  }
};

DtlsContext::DtlsContext(const Identity& identity, Peers peers, Role role, Purpose purpose)
    : role_(role), pairs_(purpose == Purpose::kPair), peers_(std::move(peers)), impl_(std::make_unique<Impl>()) {
  impl_->ssl = SSL_CTX_new(role == Role::kMachine ? DTLS_server_method() : DTLS_client_method());
  SSL_CTX* c = impl_->ssl;
  must(c != nullptr && SSL_CTX_set_min_proto_version(c, DTLS1_2_VERSION) == 1 &&
           SSL_CTX_set_max_proto_version(c, DTLS1_2_VERSION) == 1 &&
           SSL_CTX_set_cipher_list(c, "ECDHE-ECDSA-AES128-GCM-SHA256") == 1 &&
           SSL_CTX_set1_groups_list(c, "P-256") == 1 && SSL_CTX_set1_sigalgs_list(c, "ECDSA+SHA256") == 1,
       "setting up DTLS 1.2");
  must(
      SSL_CTX_use_certificate(c, identity.certificate.get()) == 1 && SSL_CTX_use_PrivateKey(c, identity.key.get()) == 1,
      "using this computer's key");
  SSL_CTX_set_options(c, SSL_OP_NO_TICKET | SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_NO_QUERY_MTU |
                             SSL_OP_COOKIE_EXCHANGE | SSL_OP_SINGLE_ECDH_USE);
  const std::string_view wanted = kPurposes[static_cast<std::size_t>(purpose)];
  if (role == Role::kMachine) {
    SSL_CTX_set_alpn_select_cb(
        c,
        [](SSL* ssl, const unsigned char** chosen, unsigned char* size, const unsigned char* offered, unsigned length,
           void*) {
          const auto found = first_known({offered, length});
          if (!found) return SSL_TLSEXT_ERR_ALERT_FATAL;
          auto& wire = *static_cast<DtlsSession::Wire*>(SSL_get_app_data(ssl));
          wire.refusal = wire.context->judge(found->first);
          *chosen = found->second.data();
          *size = static_cast<unsigned char>(found->second.size());
          return wire.refusal == Refusal::kNone ? SSL_TLSEXT_ERR_OK : SSL_TLSEXT_ERR_ALERT_FATAL;
        },
        nullptr);
  } else {
    must(SSL_CTX_set_alpn_protos(c, bytes_of(wanted), static_cast<unsigned>(wanted.size())) == 0, "naming the purpose");
  }
  SSL_CTX_set_session_cache_mode(c, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_read_ahead(c, 1);
  SSL_CTX_set_verify(c, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  impl_->renew_cookies();
  impl_->renew_cookies();

  // Pinned certificates only: no chain, no authority, no name.
  SSL_CTX_set_cert_verify_callback(
      c,
      [](X509_STORE_CTX* store, void*) {
        const auto* ssl = static_cast<SSL*>(X509_STORE_CTX_get_ex_data(store, SSL_get_ex_data_X509_STORE_CTX_idx()));
        auto& wire = *static_cast<DtlsSession::Wire*>(SSL_get_app_data(ssl));
        const X509* certificate = X509_STORE_CTX_get0_cert(store);
        if (certificate == nullptr) return 0;
        wire.peer = fingerprint_of(certificate);
        wire.peer_name = common_name(certificate);
        wire.peer_expires_utc = expires_utc(certificate);
        wire.refusal = wire.context->judge(certificate, purpose_of(ssl));
        switch (wire.refusal) {
          case Refusal::kNone:
            X509_STORE_CTX_set_error(store, X509_V_OK);
            return 1;
          case Refusal::kExpiredPeer:
            X509_STORE_CTX_set_error(store, X509_V_ERR_CERT_HAS_EXPIRED);
            return 0;
          case Refusal::kRevokedPeer:
            X509_STORE_CTX_set_error(store, X509_V_ERR_CERT_REVOKED);
            return 0;
          case Refusal::kObserver:  // told as unsupported_certificate
            X509_STORE_CTX_set_error(store, X509_V_ERR_INVALID_PURPOSE);
            return 0;
          default:
            X509_STORE_CTX_set_error(store, X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT);
            return 0;
        }
      },
      nullptr);
  SSL_CTX_set_info_callback(c, [](const SSL* ssl, int where, int value) {
    if ((where & SSL_CB_ALERT) == 0 || (value >> 8) != SSL3_AL_FATAL) return;
    auto& wire = *static_cast<DtlsSession::Wire*>(SSL_get_app_data(ssl));
    if (wire.refusal != Refusal::kNone) return;
    const bool told = (where & SSL_CB_READ) != 0;
    switch (value & 0xFF) {
      case SSL_AD_CERTIFICATE_EXPIRED:
        wire.refusal = told ? Refusal::kExpiredThere : Refusal::kExpiredPeer;
        return;
      case SSL_AD_CERTIFICATE_REVOKED:
        wire.refusal = told ? Refusal::kRevokedThere : Refusal::kRevokedPeer;
        return;
      case SSL_AD_UNSUPPORTED_CERTIFICATE:
        wire.refusal = told ? Refusal::kObserverThere : Refusal::kObserver;
        return;
      case SSL_AD_UNKNOWN_CA:
      case SSL_AD_BAD_CERTIFICATE:
      case SSL_AD_CERTIFICATE_UNKNOWN:
        wire.refusal = told ? Refusal::kNotKnownThere : Refusal::kUnknownPeer;
        return;
      case SSL_AD_NO_APPLICATION_PROTOCOL:
        if (told) wire.refusal = wire.context->pairs_ ? Refusal::kNoPairThere : Refusal::kPairsThere;
        return;
      default:
        wire.refusal = Refusal::kProtocol;
    }
  });
  SSL_CTX_set_cookie_generate_cb(c, [](SSL* ssl, unsigned char* cookie, unsigned* size) {
    const auto& wire = *static_cast<DtlsSession::Wire*>(SSL_get_app_data(ssl));
    std::array<unsigned char, 32> made{};
    if (!wire.context->impl_->cookie(wire.context->impl_->cookie_secrets[0], wire.from, made)) return 0;
    std::copy(made.begin(), made.end(), cookie);
    *size = made.size();
    return 1;
  });
  SSL_CTX_set_cookie_verify_cb(c, [](SSL* ssl, const unsigned char* cookie, unsigned size) {
    const auto& wire = *static_cast<DtlsSession::Wire*>(SSL_get_app_data(ssl));
    const DtlsContext::Impl& impl = *wire.context->impl_;
    return static_cast<int>(
        std::any_of(impl.cookie_secrets.begin(), impl.cookie_secrets.end(), [&](const Impl::Secret& secret) {
          std::array<unsigned char, 32> made{};
          return impl.cookie(secret, wire.from, made) && size == made.size() &&
                 CRYPTO_memcmp(cookie, made.data(), size) == 0;
        }));
  });

  impl_->wire = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "datagram");
  must(impl_->wire != nullptr, "making a wire");
  BIO_meth_set_read(impl_->wire, DtlsSession::Wire::read);
  BIO_meth_set_write(impl_->wire, DtlsSession::Wire::write);
  BIO_meth_set_ctrl(impl_->wire, DtlsSession::Wire::control);
  BIO_meth_set_create(impl_->wire, DtlsSession::Wire::create);
}

DtlsContext::~DtlsContext() = default;

void DtlsContext::renew_cookies() {
  impl_->renew_cookies();
}

const Peer* DtlsContext::find(const Fingerprint& fingerprint) const noexcept {
  const auto found =
      std::find_if(peers_.begin(), peers_.end(), [&](const Peer& peer) { return peer.fingerprint == fingerprint; });
  return found == peers_.end() ? nullptr : &*found;
}

Refusal DtlsContext::judge(Purpose purpose) const noexcept {
  if (pairs_ == (purpose == Purpose::kPair)) return Refusal::kNone;
  if (role_ == Role::kMachine) return pairs_ ? Refusal::kWantsNoPairing : Refusal::kWantsToPair;
  return pairs_ ? Refusal::kNoPairThere : Refusal::kPairsThere;
}

Refusal DtlsContext::judge(const X509* certificate, Purpose purpose) const noexcept {
  if (const Refusal refusal = judge(purpose); refusal != Refusal::kNone) return refusal;
  if (X509_cmp_current_time(X509_get0_notAfter(certificate)) <= 0 ||
      X509_cmp_current_time(X509_get0_notBefore(certificate)) >= 0)
    return Refusal::kExpiredPeer;
  if (pairs_) return Refusal::kNone;
  const Peer* peer = find(fingerprint_of(certificate));
  if (peer == nullptr) return Refusal::kUnknownPeer;
  if (peer->revoked) return Refusal::kRevokedPeer;
  return role_ == Role::kMachine && peer->observer && purpose == Purpose::kControl ? Refusal::kObserver
                                                                                   : Refusal::kNone;
}

// ------------------------------------------------------------------------------------------------------- the session

DtlsSession::DtlsSession(const DtlsContext& context) : context_(context), wire_(std::make_unique<Wire>()) {
  wire_->context = &context;
  ssl_ = SSL_new(context.impl_->ssl);
  BIO* bio = BIO_new(context.impl_->wire);
  must(ssl_ != nullptr && bio != nullptr, "making a session");
  BIO_set_data(bio, wire_.get());
  SSL_set_bio(ssl_, bio, bio);
  SSL_set_mtu(ssl_, kHandshakeMtu);
  SSL_set_app_data(ssl_, wire_.get());
  DTLS_set_timer_cb(ssl_, [](SSL*, unsigned last_us) {
    return last_us == 0 ? kFirstTimeout_us : std::min(2 * last_us, kLongestTimeout_us);
  });
  if (context.role() == Role::kMachine)
    SSL_set_accept_state(ssl_);
  else
    SSL_set_connect_state(ssl_);
}

DtlsSession::~DtlsSession() {
  SSL_free(ssl_);
  ERR_clear_error();
}

bool DtlsSession::hear_hello(std::span<const std::uint8_t> datagram, const SocketAddress& from, Out& out) {
  wire_->from = from;
  wire_->in = datagram;
  wire_->waiting = true;
  wire_->out = &out;
  const std::unique_ptr<BIO_ADDR, void (*)(BIO_ADDR*)> nobody(BIO_ADDR_new(), BIO_ADDR_free);
  ERR_clear_error();
  const bool verified = DTLSv1_listen(ssl_, nobody.get()) == 1;
  ERR_clear_error();
  wire_->refusal = Refusal::kNone;
  wire_->waiting = false;
  return verified;
}

DtlsSession::Progress DtlsSession::start(Out& out) {
  wire_->out = &out;
  ERR_clear_error();
  return progress(SSL_do_handshake(ssl_));
}

DtlsSession::Progress DtlsSession::hear(std::span<const std::uint8_t> datagram, Out& out) {
  const bool shaken = SSL_is_init_finished(ssl_) != 0;
  if (shaken && !may_be_said_again(datagram)) return Progress::kDone;
  wire_->in = datagram;
  wire_->waiting = true;
  wire_->out = &out;
  ERR_clear_error();
  if (!shaken) return progress(SSL_do_handshake(ssl_));
  // What the far end sends again because our last flight was lost.
  (void)drop_messages();
  wire_->waiting = false;
  return Progress::kDone;
}

/// A record among the handshake's datagrams is none that open() was given: OpenSSL would keep it, or what is left of
/// it, and give it out as what the next datagram holds.
bool DtlsSession::drop_messages() {
  std::array<std::uint8_t, kMaxDatagram + 1> text;
  int got = 1;
  while (got > 0) got = SSL_read(ssl_, text.data(), static_cast<int>(text.size()));
  const bool lives = SSL_get_error(ssl_, got) != SSL_ERROR_SSL;
  ERR_clear_error();
  return lives;
}

DtlsSession::Progress DtlsSession::tend(Out& out) {
  wire_->out = &out;
  if (SSL_is_init_finished(ssl_) != 0) return Progress::kDone;
  ERR_clear_error();
  if (DTLSv1_handle_timeout(ssl_) < 0) {
    ERR_clear_error();
    wire_->refusal = Refusal::kSilence;
    return Progress::kFailed;
  }
  return Progress::kUnderWay;
}

DtlsSession::Progress DtlsSession::progress(int result) {
  wire_->waiting = false;
  if (result == 1) {
    agree_on_tags();
    if (drop_messages()) return Progress::kDone;
    wire_->refusal = Refusal::kProtocol;
    return Progress::kFailed;
  }
  const int error = SSL_get_error(ssl_, result);
  const unsigned long detail = ERR_peek_error();
  ERR_clear_error();
  if (error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE) return Progress::kUnderWay;
  if (ERR_GET_REASON(detail) == SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE) wire_->refusal = Refusal::kNoCertificate;
  if (wire_->refusal == Refusal::kNone) wire_->refusal = Refusal::kProtocol;
  return Progress::kFailed;
}

void DtlsSession::agree_on_tags() {
  std::array<std::uint8_t, 2 * kTagSize> tags{};  // to the machine, to the operator
  must(SSL_export_keying_material(ssl_, tags.data(), tags.size(), kTagLabel, sizeof kTagLabel - 1, nullptr, 0, 0) == 1,
       "exporting the tags");
  tags[0] |= kTagMark;
  if (purpose() == Purpose::kObserve) tags[0] = static_cast<std::uint8_t>(tags[0] & 0x3FU) | kObserverTagMark;
  tags[kTagSize] |= kTagMark;
  const bool machine = context_.role() == Role::kMachine;
  const auto middle = tags.begin() + kTagSize;
  std::copy(tags.begin(), middle, machine ? receive_tag_.begin() : send_tag_.begin());
  std::copy(middle, tags.end(), machine ? send_tag_.begin() : receive_tag_.begin());
}

Refusal DtlsSession::refusal() const noexcept {
  return wire_->refusal;
}

Certificate DtlsSession::peer_certificate() const {
  return Certificate(SSL_get1_peer_certificate(ssl_));
}

const std::string& DtlsSession::peer_name() const noexcept {
  return wire_->peer_name;
}

const std::string& DtlsSession::peer_expires_utc() const noexcept {
  return wire_->peer_expires_utc;
}

Purpose DtlsSession::purpose() const noexcept {
  return purpose_of(ssl_);
}

const std::optional<Fingerprint>& DtlsSession::peer() const noexcept {
  return wire_->peer;
}

bool DtlsSession::mine(std::span<const std::uint8_t> datagram) const noexcept {
  return datagram.size() > kTagSize && std::equal(receive_tag_.begin(), receive_tag_.end(), datagram.begin());
}

bool DtlsSession::seal(Inner kind, std::span<const std::uint8_t> plain, Sealed& sealed) noexcept {
  if (plain.size() > kMaxDatagram) return false;
  std::array<std::uint8_t, kMaxDatagram + 1> text;
  text[0] = static_cast<std::uint8_t>(kind);
  if (!plain.empty()) std::memcpy(text.data() + 1, plain.data(), plain.size());
  sealed.size = 0;
  std::copy(send_tag_.begin(), send_tag_.end(), sealed.bytes.begin());
  wire_->sealed = &sealed;
  const int written = SSL_write(ssl_, text.data(), static_cast<int>(plain.size() + 1));
  wire_->sealed = nullptr;
  if (written <= 0) ERR_clear_error();
  return written > 0 && sealed.size > 0;
}

bool DtlsSession::seal_farewell(Sealed& sealed) noexcept {
  sealed.size = 0;
  std::copy(send_tag_.begin(), send_tag_.end(), sealed.bytes.begin());
  wire_->sealed = &sealed;
  (void)SSL_shutdown(ssl_);
  wire_->sealed = nullptr;
  ERR_clear_error();
  return sealed.size > 0;
}

std::optional<DtlsSession::Opened> DtlsSession::open(std::span<const std::uint8_t> datagram, Datagram& plain) noexcept {
  // One record a datagram, as seal() makes them: OpenSSL never sees a header that contradicts its datagram.
  constexpr std::uint8_t kAlert = 21, kData = 23;
  if (datagram.size() < kTagSize + kRecordHeader || datagram.size() > kMaxDatagram + kSealOverhead) return std::nullopt;
  const auto record = datagram.subspan(kTagSize);
  const bool known = (record[0] == kData || record[0] == kAlert) && may_be_authentic(record);
  if (!known || record.size() != kRecordHeader + length_of(record)) return std::nullopt;
  std::uint64_t number = 0;
  for (const std::uint8_t byte : record.subspan(3, 8)) number = number << 8 | byte;
  std::array<std::uint8_t, kMaxDatagram + 1> text;
  wire_->in = record;
  wire_->waiting = true;
  wire_->out = nullptr;
  const int got = SSL_read(ssl_, text.data(), static_cast<int>(text.size()));
  wire_->waiting = false;
  if (got <= 0) {
    closed_ = closed_ || SSL_get_error(ssl_, got) == SSL_ERROR_ZERO_RETURN;
    if (ERR_peek_error() != 0) ERR_clear_error();
    return std::nullopt;
  }
  const bool newest = number > newest_record_;
  if (newest) newest_record_ = number;
  plain.size = static_cast<std::uint16_t>(got - 1);
  std::memcpy(plain.bytes.data(), text.data() + 1, plain.size);
  return Opened{static_cast<Inner>(text[0]), newest};
}

}  // namespace knuckle::secure
