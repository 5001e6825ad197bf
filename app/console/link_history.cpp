#include "app/console/link_history.h"

#include <algorithm>
#include <cmath>

namespace knuckle::console {

const QualityBounds& bounds_of(LinkMeasure measure) noexcept {
  static constexpr std::array<const QualityBounds*, kLinkMeasures> kBounds{
      &kRoundTripBounds_s, &kLossBounds, &kJitterBounds_s, &kSilenceBounds, &kRoundTripBounds_s};
  return *kBounds[static_cast<std::size_t>(measure)];
}

std::optional<LinkValues> link_values(const LinkSide& link) noexcept {
  if (!link.heard || !std::isfinite(link.loss)) return std::nullopt;
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  const double used = link.neutral_after_s > 0 ? link.silence_s / link.neutral_after_s : 0;
  LinkValues values{kUnknown, static_cast<float>(link.loss), kUnknown, static_cast<float>(used), kUnknown};
  // What came last is no measure of a link on which nothing comes any more.
  if (used > kSilenceBounds.bad) return values;
  const auto put = [&values](LinkMeasure measure, double value) {
    values[static_cast<std::size_t>(measure)] = static_cast<float>(value);
  };
  if (link.round_trip.count() > 0) put(LinkMeasure::kRoundTrip, to_seconds(link.round_trip.quantile(0.5)));
  put(LinkMeasure::kJitter, to_seconds(link.arrival_jitter.quantile(0.95)));
  put(LinkMeasure::kNewestRoundTrip, link.round_trip_s);
  return values;
}

void LinkHistory::watch(const ConsoleView& view) noexcept {
  pass(view.now);
  if (const auto values = link_values(view.link)) add(*values);
}

void LinkHistory::pass(Time now) noexcept {
  const std::int64_t second = now.time_since_epoch() / Duration(1s);
  if (second_ && second < *second_) *this = {};
  const std::int64_t passed = !second_ ? 1 : std::min(second - *second_, static_cast<std::int64_t>(kSeconds));
  for (std::int64_t i = 0; i < passed; ++i) {
    newest_ = (newest_ + 1) % kSeconds;
    seconds_[newest_] = {};
    count_ = std::min(count_ + 1, kSeconds);
  }
  second_ = second;
}

void LinkHistory::add(const LinkValues& values) noexcept {
  for (std::size_t i = 0; i < kLinkMeasures; ++i) {
    Range& range = seconds_[newest_][i];
    range.least = std::fmin(range.least, values[i]);
    range.most = std::fmax(range.most, values[i]);
  }
}

}  // namespace knuckle::console
