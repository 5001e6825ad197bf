#include "transport/ice/heartbeat.h"

#include <algorithm>
#include <utility>

#include "transport/ice/signal.h"

namespace knuckle::ice {
namespace {

constexpr std::uint8_t kQuestion = 0, kQuestionInUse = 1, kAnswer = 2;
constexpr std::size_t kNumberAt = 2;

Beat beat_of(std::uint8_t what, std::span<const std::uint8_t> number) {
  Beat beat{kBeatMark, what};
  std::copy(number.begin(), number.end(), beat.begin() + kNumberAt);
  return beat;
}

}  // namespace

std::optional<Beat> Heartbeat::question(Clock::time_point now, bool in_use) {
  if (now - asked_at_ < kEvery) return std::nullopt;
  asked_at_ = now;
  Asked& asked = asked_[next_++ % asked_.size()];
  const Nonce random = random_nonce();
  std::copy_n(random.begin(), asked.number.size(), asked.number.begin());
  asked.at = now;
  asked.open = true;
  return beat_of(in_use ? kQuestionInUse : kQuestion, asked.number);
}

std::optional<Beat> Heartbeat::hear(std::span<const std::uint8_t> datagram, Clock::time_point now) {
  if (!is_beat(datagram) || datagram[1] > kAnswer) return std::nullopt;
  const auto number = datagram.subspan(kNumberAt);
  if (datagram[1] != kAnswer) {
    heard_at_ = now;
    far_end_uses_ = far_end_uses_ || datagram[1] == kQuestionInUse;
    return beat_of(kAnswer, number);
  }
  for (Asked& asked : asked_) {
    if (!asked.open || !std::equal(number.begin(), number.end(), asked.number.begin())) continue;
    asked.open = false;
    answered_at_ = now;
    round_trip_ = now - asked.at;
  }
  return std::nullopt;
}

std::optional<Heartbeat::Clock::duration> Heartbeat::take_round_trip() noexcept {
  return std::exchange(round_trip_, std::nullopt);
}

}  // namespace knuckle::ice
