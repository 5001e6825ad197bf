// Who an end of the link is: a key of its own and a certificate that it signed itself. Ends know each other by the
// fingerprint of the certificate alone; no authority vouches for anybody.
#pragma once

#include <openssl/types.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace knuckle::secure {

/// SHA-256 of a certificate (DER).
struct Fingerprint {
  std::array<std::uint8_t, 32> bytes{};
  friend bool operator==(const Fingerprint&, const Fingerprint&) = default;
};
[[nodiscard]] std::string hex(const Fingerprint& fingerprint);  ///< 64 digits.
/// For people to compare: the first 80 bits, "QF3K-7HZ2-M4AB-XW6T".
[[nodiscard]] std::string short_text(const Fingerprint& fingerprint);
/// nullopt where it is not 64 hexadecimal digits.
[[nodiscard]] std::optional<Fingerprint> fingerprint_of_hex(std::string_view digits);
[[nodiscard]] Fingerprint fingerprint_of(const X509* certificate);
/// What both ends of a pairing show: the same where each has the other's certificate and nobody is between them,
/// in whichever order they are given; 120 bits, because who stands between them may choose two certificates, one for
/// each end, so that half of the bits count.
[[nodiscard]] std::string pairing_code(const Fingerprint& one, const Fingerprint& other);

struct CertificateDeleter {
  void operator()(X509* certificate) const noexcept;
};
struct KeyDeleter {
  void operator()(EVP_PKEY* key) const noexcept;
};
using Certificate = std::unique_ptr<X509, CertificateDeleter>;
using Key = std::unique_ptr<EVP_PKEY, KeyDeleter>;

inline constexpr int kIdentityDays = 5 * 365;
inline constexpr std::size_t kMostNameLength = 40;

/// Letters, digits, space and . _ - , 1 to kMostNameLength: it is printed and written wherever the far end is named.
[[nodiscard]] bool is_name(std::string_view name) noexcept;
/// As its owner wrote it; "unnamed" where it is no name.
[[nodiscard]] std::string common_name(const X509* certificate);
/// "2031-11-24T05:00:00Z"
[[nodiscard]] std::string expires_utc(const X509* certificate);

struct Identity {
  Key key;
  Certificate certificate;
  std::string name;  ///< Common name of the certificate.

  [[nodiscard]] Fingerprint fingerprint() const { return fingerprint_of(certificate.get()); }
  [[nodiscard]] std::string expires_utc() const { return secure::expires_utc(certificate.get()); }
  [[nodiscard]] bool expired() const;
  /// It begins in the future: this computer's clock is behind that of the day when it was made.
  [[nodiscard]] bool not_yet_valid() const;
  /// Key and certificate, PEM.
  [[nodiscard]] std::string pem() const;
};

/// A new P-256 key with its certificate, valid from a day ago (clocks differ) for so many days.
/// @throws InputError where the name is not one.
[[nodiscard]] Identity make_identity(const std::string& name, int days = kIdentityDays);
/// @throws InputError, one line, where the file cannot be read, may be read or written by anybody but its owner, or has
/// no P-256 key with a certificate that this key has signed.
[[nodiscard]] Identity load_identity(const std::string& file);

/// An end that this one knows.
struct Peer {
  Fingerprint fingerprint;
  std::string name;  ///< As it was called here when it was paired.
  bool revoked = false;
  bool observer = false;         ///< May observe the machine, not control it.
  std::string expires_utc = {};  ///< Of its certificate, where it is known.
};
using Peers = std::vector<Peer>;

}  // namespace knuckle::secure
