// Which signal of a paired far end counts: only one that its present process has made for this one. A rendezvous that
// keeps, repeats or reorders signals can delay them, nothing else.
#pragma once

#include <optional>
#include <utility>

#include "transport/ice/signal.h"

namespace knuckle::ice {

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
