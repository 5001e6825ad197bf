// One word for how well the machine is reached, from what the last ten seconds measured: round trip, loss, jitter, and
// how much of the time to neutral the newest silence has used up. The worst of them decides.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/console/console_view.h"

namespace knuckle::console {

enum class LinkQuality : std::uint8_t { kGood, kFair, kPoor, kBad };
[[nodiscard]] const char* name(LinkQuality quality) noexcept;  ///< "good", "fair", "poor", "bad"

/// Up to `fair` good, up to `poor` fair, up to `bad` poor.
struct QualityBounds {
  double fair, poor, bad;
};
// Felt contacts hold to 10 % in 9 sessions of 10 up to 0.1 s, become soft up to 0.4 s (docs/evaluation.md); beyond
// 0.45 s no force is felt.
inline constexpr QualityBounds kRoundTripBounds_s{0.1, 0.2, 0.4};
inline constexpr QualityBounds kLossBounds{0.02, 0.1, 0.3};
inline constexpr QualityBounds kJitterBounds_s{0.015, 0.04, 0.1};  ///< p95 of arrivals, off the machine's period.
inline constexpr QualityBounds kSilenceBounds{0.4, 0.7, 1};        ///< Of the time to neutral.

struct LinkVerdict {
  LinkQuality quality = LinkQuality::kBad;
  std::string words;  ///< Of what decides, such as "180 ms round trip".
};
/// @param later_s since the view was made. @return nothing where nothing of it was measured: not heard, or the
/// recording of one side alone.
[[nodiscard]] std::optional<LinkVerdict> link_verdict(const LinkSide& link, double later_s);

}  // namespace knuckle::console
