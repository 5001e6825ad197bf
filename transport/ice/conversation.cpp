#include "transport/ice/conversation.h"

namespace knuckle::ice {

Conversation::Conversation(const Signer& signer, const secure::Fingerprint& far)
    : signer_(signer), far_(far), session_(random_nonce()), challenge_(random_nonce()) {}

Bytes Conversation::say(Signal signal, const Nonce& echo) {
  signal.to = far_;
  signal.session = session_;
  signal.challenge = challenge_;
  signal.echo = echo;
  signal.counter = ++counter_;
  return signer_.sign(encode(signal));
}

Conversation::Heard Conversation::hear(std::span<const std::uint8_t> bytes, bool open_to_others) {
  const auto message = verified(bytes, far_);
  auto signal = message ? decode(*message) : std::nullopt;
  if (!signal || !(signal->to == signer_.fingerprint())) return {};
  Heard heard{Verdict::kFresh, false, std::move(*signal)};
  if (far_session_ == heard.signal.session) {
    if (heard.signal.counter <= far_counter_) return {};
  } else if (heard.signal.echo == challenge_ && far_session_ && !open_to_others) {
    heard.verdict = Verdict::kOther;
    return heard;
  } else if (heard.signal.echo == challenge_) {
    heard.new_session = true;
    far_session_ = heard.signal.session;
    challenge_ = random_nonce();  // what echoes the old one and comes later was kept by somebody
  } else {
    heard.verdict = Verdict::kUnproven;
    return heard;
  }
  far_counter_ = heard.signal.counter;
  far_challenge_ = heard.signal.challenge;
  return heard;
}

}  // namespace knuckle::ice
