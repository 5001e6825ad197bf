// What two paired ends tell each other over a rendezvous so as to find a path: candidates and credentials of ICE (RFC
// 8445). Each message is signed with its sender's device key and named for one receiver, so that whoever passes it on
// can read addresses, but neither make nor change one.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "transport/secure/identity.h"
#include "transport/socket_address.h"

namespace knuckle::ice {

using Bytes = std::vector<std::uint8_t>;
using Nonce = std::array<std::uint8_t, 16>;
[[nodiscard]] Nonce random_nonce();

/// Where an end may be reached (RFC 8445, 5.1).
struct Candidate {
  enum class Kind : std::uint8_t { kHost, kServerReflexive, kPeerReflexive, kRelayed, kCount } kind = Kind::kHost;
  std::string foundation;  ///< 1 to 32 ice-chars.
  std::uint32_t priority = 0;
  SocketAddress address;  ///< UDP.
};

struct Signal {
  enum class Kind : std::uint8_t {
    kHello,   ///< "I am here": carries nothing but what the next message has to echo.
    kOffer,   ///< Operator's side: a new attempt, or more candidates of the one that is under way.
    kAnswer,  ///< Machine's side, to the offer of this attempt.
    kAgain,   ///< Machine's side: its network has changed; the operator's side offers anew.
    kCount
  } kind = Kind::kHello;
  secure::Fingerprint to;
  // Freshness (Conversation).
  Nonce session{}, challenge{}, echo{};
  std::uint64_t counter = 0;
  // Of an offer or an answer.
  std::uint32_t attempt = 0;
  bool direct_only = false;  ///< Without relays.
  bool complete = false;     ///< No more candidates will come.
  std::string user, password;
  std::vector<Candidate> candidates;
};

inline constexpr std::size_t kMostCandidates = 24;
inline constexpr std::size_t kMostSignal = 3072;  ///< Bytes, signed.

/// Without signature. At most kMostCandidates are kept, those that decode() would refuse are left out.
[[nodiscard]] Bytes encode(const Signal& signal);
/// nullopt for anything that encode() does not make.
[[nodiscard]] std::optional<Signal> decode(std::span<const std::uint8_t> bytes);

/// Signs as one identity.
class Signer {
 public:
  explicit Signer(const secure::Identity& identity);
  [[nodiscard]] const secure::Fingerprint& fingerprint() const noexcept { return fingerprint_; }
  /// Message, certificate, signature (ECDSA P-256 with SHA-256).
  [[nodiscard]] Bytes sign(std::span<const std::uint8_t> message) const;

 private:
  secure::Key key_;
  Bytes certificate_;
  secure::Fingerprint fingerprint_;
};
/// What `by` has signed; nullopt where the certificate is another's, or the signature is not of this message.
[[nodiscard]] std::optional<std::span<const std::uint8_t>> verified(std::span<const std::uint8_t> bytes,
                                                                    const secure::Fingerprint& by);

}  // namespace knuckle::ice
