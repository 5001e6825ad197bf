#include "transport/secure/dtls_session.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "transport/secure/dtls_wire.h"

namespace knuckle::secure {
namespace {

constexpr unsigned kFirstTimeout_us = 300'000, kLongestTimeout_us = 2'000'000;
// RFC 5705
constexpr std::string_view kTagLabel = "EXPORTER-knuckle-tag", kVideoLabel = "EXPORTER-knuckle-video";

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

}  // namespace

bool is_hello(std::span<const std::uint8_t> bytes) noexcept {
  constexpr std::size_t kTypeOfMessage = 13;
  constexpr std::uint8_t kHandshakeRecord = 22, kClientHello = 1;
  return bytes.size() > kTypeOfMessage && bytes[0] == kHandshakeRecord && bytes[3] == 0 && bytes[4] == 0 &&
         bytes[kTypeOfMessage] == kClientHello;
}

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
    export_secrets();
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

void DtlsSession::export_secrets() {
  const auto take = [this](std::span<std::uint8_t> secret, std::string_view label) {
    must(SSL_export_keying_material(ssl_, secret.data(), secret.size(), label.data(), label.size(), nullptr, 0, 0) == 1,
         "exporting what both ends know");
  };
  take(video_secret_, kVideoLabel);
  std::array<std::uint8_t, 2 * kTagSize> tags{};  // to the machine, to the operator
  take(tags, kTagLabel);
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
