#include "app/console/link_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace knuckle::console {
namespace {

LinkQuality quality_of(double value, const QualityBounds& bounds) {
  if (!(value <= bounds.bad)) return LinkQuality::kBad;
  if (value > bounds.poor) return LinkQuality::kPoor;
  return value > bounds.fair ? LinkQuality::kFair : LinkQuality::kGood;
}

}  // namespace

const char* name(LinkQuality quality) noexcept {
  constexpr std::array<const char*, 4> kNames{"good", "fair", "poor", "bad"};
  return kNames[static_cast<std::size_t>(quality)];
}

std::optional<LinkVerdict> link_verdict(const LinkSide& link, double later_s) {
  if (!link.heard || !std::isfinite(link.loss)) return std::nullopt;
  const double round_trip_s = to_seconds(link.round_trip.quantile(0.5));
  const double jitter_s = to_seconds(link.arrival_jitter.quantile(0.95));
  const double silence_s = link.silence_s + later_s;
  const double used = link.neutral_after_s > 0 ? silence_s / link.neutral_after_s : 0;
  // The round trip is what is said where all is well.
  LinkVerdict verdict{quality_of(round_trip_s, kRoundTripBounds_s),
                      fmt::format("{:.0f} ms round trip", round_trip_s * 1e3)};
  const auto worse = [&verdict](double value, const QualityBounds& bounds, const std::string& words) {
    if (const LinkQuality quality = quality_of(value, bounds); quality > verdict.quality) verdict = {quality, words};
  };
  worse(link.loss, kLossBounds, fmt::format("{:.0f} % lost", link.loss * 100));
  worse(jitter_s, kJitterBounds_s, fmt::format("{:.0f} ms jitter", jitter_s * 1e3));
  worse(used, kSilenceBounds, fmt::format("silent for {:.0f} ms", silence_s * 1e3));
  if (link.round_trip.count() == 0 && verdict.quality != LinkQuality::kBad)
    return LinkVerdict{LinkQuality::kBad, "round trip not known"};
  return verdict;
}

}  // namespace knuckle::console
