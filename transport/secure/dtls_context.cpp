#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509_vfy.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "transport/secure/dtls_wire.h"

namespace knuckle::secure {
namespace {

// Application protocols (RFC 7301) in the order of Purpose, as they travel: length, name.
constexpr std::array<std::string_view, 4> kPurposes{"\x0Fknuckle-control", "\x0Fknuckle-observe", "\x0Bknuckle-try",
                                                    "\x0Cknuckle-pair"};

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

}  // namespace

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

DtlsContext::Impl::~Impl() {
  SSL_CTX_free(ssl);
  BIO_meth_free(wire);
}

bool DtlsContext::Impl::cookie(const Secret& secret, const SocketAddress& from,
                               std::array<unsigned char, 32>& cookie) const {
  const std::string address = knuckle::text(from);
  unsigned size = 0;
  return HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
              reinterpret_cast<const unsigned char*>(address.data()), address.size(), cookie.data(), &size) != nullptr;
}

void DtlsContext::Impl::renew_cookies() {
  cookie_secrets[1] = cookie_secrets[0];
  must(RAND_bytes(cookie_secrets[0].data(), static_cast<int>(cookie_secrets[0].size())) == 1, "random number");
}

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

}  // namespace knuckle::secure
