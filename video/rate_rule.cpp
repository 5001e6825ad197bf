#include "video/rate_rule.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "video/sender.h"

namespace knuckle::video {
namespace {

constexpr Duration kQueue = 100ms, kStands = 300ms;  // a message that comes late alone is no queue
constexpr Duration kHalveEvery = 1s, kWellFor = 5s, kRaiseEvery = 2s;
constexpr double kRaise = 1.1;
/// A path that has become longer for good must not starve the picture for ever.
constexpr double kForget_s_per_s = 2e-3;

}  // namespace

int RateRule::step(Time now, Time heard_at, Duration round_trip, bool silent) noexcept {
  if (std::exchange(begins_, false)) {
    begun_at_ = now;
    least_ = Duration::max();
    longer_since_.reset();
  }
  const Duration forgotten = from_seconds(kForget_s_per_s * to_seconds(now - stepped_at_));
  stepped_at_ = now;
  if (heard_at <= begun_at_) {  // heard_at and round_trip still are those of the operator before
    if (now - begun_at_ < kHalveEvery) return static_cast<int>(std::lround(rate_kbps_));
    silent = true;
  }
  if (!silent) {
    least_ = least_ == Duration::max() ? round_trip : std::min(round_trip, least_ + forgotten);
    if (round_trip - least_ <= kQueue)
      longer_since_.reset();
    else if (!longer_since_)
      longer_since_ = now;
  }
  if (silent || (longer_since_ && now - *longer_since_ >= kStands)) {
    suffered_at_ = now;
    if (now - halved_at_ >= kHalveEvery) {
      rate_kbps_ /= 2;
      halved_at_ = now;
    }
  } else if (!longer_since_ && now - suffered_at_ >= kWellFor && now - raised_at_ >= kRaiseEvery) {
    rate_kbps_ *= kRaise;
    raised_at_ = now;
  }
  rate_kbps_ = std::clamp(rate_kbps_, static_cast<double>(std::min(kLeastRate_kbps, most_kbps_)),
                          static_cast<double>(most_kbps_));
  return static_cast<int>(std::lround(rate_kbps_));
}

}  // namespace knuckle::video
