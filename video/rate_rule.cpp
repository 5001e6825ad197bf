#include "video/rate_rule.h"

#include <algorithm>
#include <cmath>

#include "video/sender.h"

namespace knuckle::video {
namespace {

constexpr Duration kQueue = 100ms;
constexpr Duration kHalveEvery = 1s, kWellFor = 5s, kRaiseEvery = 2s;
constexpr double kRaise = 1.1;
/// A path that has become longer for good must not starve the picture for ever.
constexpr double kForget_s_per_s = 2e-3;

}  // namespace

int RateRule::step(Time now, Duration round_trip, bool silent) noexcept {
  if (least_ == Duration::max()) {
    least_ = round_trip;
    stepped_at_ = now;
  }
  const Duration forgotten = from_seconds(kForget_s_per_s * to_seconds(now - stepped_at_));
  stepped_at_ = now;
  if (!silent) least_ = std::min(round_trip, least_ + forgotten);
  if (silent || round_trip - least_ > kQueue) {
    suffered_at_ = now;
    if (now - changed_at_ >= kHalveEvery) {
      rate_kbps_ /= 2;
      changed_at_ = now;
    }
  } else if (now - suffered_at_ >= kWellFor && now - changed_at_ >= kRaiseEvery) {
    rate_kbps_ *= kRaise;
    changed_at_ = now;
  }
  rate_kbps_ = std::clamp(rate_kbps_, static_cast<double>(std::min(kLeastRate_kbps, most_kbps_)),
                          static_cast<double>(most_kbps_));
  return static_cast<int>(std::lround(rate_kbps_));
}

}  // namespace knuckle::video
