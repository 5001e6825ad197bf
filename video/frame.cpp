#include "video/frame.h"

#include <algorithm>

namespace knuckle::video {
namespace {

/// By which two computers' clocks may drift apart.
constexpr double kDrift = 100e-6;
/// A frame that takes so much longer than the quickest is late, by whatever: its stream must not count as quick again.
constexpr Duration kLate = 100ms;

}  // namespace

void FrameAge::take(const Frame& frame) noexcept {
  const Duration transit = frame.received - frame.captured;
  const bool same = frame.connection == connection_ && frame.stamp_from == stamp_from_;
  const bool may_drift = same && transit - least_transit_ < kLate;
  const Duration drift = may_drift ? from_seconds(kDrift * to_seconds(frame.received - received_)) : Duration{};
  least_transit_ = same ? std::min(transit, least_transit_ + drift) : transit;
  connection_ = frame.connection;
  received_ = frame.received;
  stamp_from_ = frame.stamp_from;
  // A source may say that a picture is due later: it was captured before it was here all the same.
  captured_ =
      std::min(frame.stamp_from == StampFrom::kHere ? frame.captured : frame.captured + least_transit_, frame.received);
}

double FrameAge::age_s(Time now) const noexcept {
  return to_seconds(now - captured_);
}

VideoState FrameAge::state(Time now) const noexcept {
  if (connection_ == 0) return VideoState::kNone;
  if (age_s(now) <= kOldestLive_s) return VideoState::kLive;
  return to_seconds(now - received_) > kOldestLive_s ? VideoState::kFrozen : VideoState::kLate;
}

}  // namespace knuckle::video
