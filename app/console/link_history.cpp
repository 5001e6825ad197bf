#include "app/console/link_history.h"

#include <algorithm>
#include <cmath>

namespace knuckle::console {

const QualityBounds& bounds_of(LinkMeasure measure) noexcept {
  static constexpr std::array<const QualityBounds*, kLinkMeasures> kBounds{
      &kRoundTripBounds_s, &kLossBounds, &kJitterBounds_s, &kSilenceBounds, &kRoundTripBounds_s};
  return *kBounds[static_cast<std::size_t>(measure)];
}

void LinkHistory::watch(const ConsoleView& view) noexcept {
  const std::int64_t second = view.now.time_since_epoch() / Duration(1s);
  if (second < second_) *this = {};
  const std::int64_t passed = second_ < 0 ? 1 : std::min(second - second_, static_cast<std::int64_t>(kSeconds));
  for (std::int64_t i = 0; i < passed; ++i) {
    newest_ = (newest_ + 1) % kSeconds;
    seconds_[newest_] = {};
    count_ = std::min(count_ + 1, kSeconds);
  }
  second_ = second;
  const LinkSide& link = view.link;
  if (!link.heard || !std::isfinite(link.loss)) return;
  const double used = link.neutral_after_s > 0 ? link.silence_s / link.neutral_after_s : 0;
  const std::array<double, kLinkMeasures> values{to_seconds(link.round_trip.quantile(0.5)), link.loss,
                                                 to_seconds(link.arrival_jitter.quantile(0.95)), used,
                                                 link.round_trip_s};
  // What came last is no measure of a link on which nothing comes any more.
  const bool silent = used > kSilenceBounds.bad;
  for (std::size_t i = 0; i < kLinkMeasures; ++i) {
    const auto measure = static_cast<LinkMeasure>(i);
    if (silent && measure != LinkMeasure::kLoss && measure != LinkMeasure::kSilence) continue;
    Range& range = seconds_[newest_][i];
    const auto value = static_cast<float>(values[i]);
    range.least = std::fmin(range.least, value);
    range.most = std::fmax(range.most, value);
  }
}

}  // namespace knuckle::console
