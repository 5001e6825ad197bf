// What two paired ends tell each other over a rendezvous so as to find a path: candidates and credentials of ICE (RFC
// 8445). Each message is signed with its sender's device key and named for one receiver, so that whoever passes it on
// can read addresses, but neither make nor change one.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
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

// Which signal of a paired far end counts: only one that its present process has made for this one. A rendezvous that
// keeps, repeats or reorders signals can delay them, nothing else.

class Conversation {
 public:
  /// The signer outlives it.
  Conversation(const Signer& signer, const secure::Fingerprint& far);

  /// Ready to be sent.
  [[nodiscard]] Bytes say(Signal signal) { return say(std::move(signal), far_challenge_); }
  /// A hello that lets the sender of an unproven signal prove that it is there.
  [[nodiscard]] Bytes answer(const Signal& unproven) { return say({}, unproven.challenge); }

  enum class Verdict : std::uint8_t {
    kRefused,   ///< Not from there, not for here, malformed, or old.
    kUnproven,  ///< Authentic, but perhaps recorded: answer() it, and use nothing of it.
    kOther,     ///< Proven, but of another process of the far end than the present one, and none is wanted.
    kFresh,
  };
  struct Heard {
    Verdict verdict = Verdict::kRefused;
    bool new_session = false;  ///< The far end's process is another than before.
    Signal signal;
  };
  /// @param open_to_others another process of the far end may take the place of the present one.
  [[nodiscard]] Heard hear(std::span<const std::uint8_t> bytes, bool open_to_others = true);
  /// A process of the far end has proven that it is there.
  [[nodiscard]] bool knows_far_end() const noexcept { return far_session_.has_value(); }

 private:
  [[nodiscard]] Bytes say(Signal signal, const Nonce& echo);

  const Signer& signer_;
  secure::Fingerprint far_;
  Nonce session_, challenge_;
  std::uint64_t counter_ = 0;
  std::optional<Nonce> far_session_;
  Nonce far_challenge_{};
  std::uint64_t far_counter_ = 0;
};

}  // namespace knuckle::ice
