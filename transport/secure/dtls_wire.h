// What sessions and their context share with OpenSSL's callbacks; for this folder's own sources.
#pragma once

#include <openssl/bio.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "transport/secure/dtls_session.h"

namespace knuckle::secure {

inline constexpr int kHandshakeMtu = 1200;

/// @throws std::runtime_error naming what failed.
inline void must(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string("OpenSSL: ") + what + " failed");
}

/// As the hello names it, once it is known.
[[nodiscard]] Purpose purpose_of(const SSL* ssl);

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

struct DtlsContext::Impl {
  using Secret = std::array<unsigned char, 32>;

  SSL_CTX* ssl = nullptr;
  BIO_METHOD* wire = nullptr;
  std::array<Secret, 2> cookie_secrets{};  // of now, of before

  ~Impl();
  /// Whose address it is is all that a cookie says.
  bool cookie(const Secret& secret, const SocketAddress& from, std::array<unsigned char, 32>& cookie) const;
  void renew_cookies();
};

}  // namespace knuckle::secure
