#include "video/frame_age.h"

#include <algorithm>

namespace knuckle::video {
namespace {

/// By which two computers' clocks may drift apart. Not more: a stream that has become late, and stays so, must not
/// count as quick again.
constexpr double kDrift = 100e-6;

}  // namespace

void FrameAge::take(const Frame& frame) noexcept {
  const Duration transit = frame.received - frame.captured;
  const bool same = frame.connection == connection_;
  const Duration drift = same ? from_seconds(kDrift * to_seconds(frame.received - received_)) : Duration{};
  least_transit_ = same ? std::min(transit, least_transit_ + drift) : transit;
  connection_ = frame.connection;
  received_ = frame.received;
  stamp_from_ = frame.stamp_from;
  captured_ = frame.stamp_from == StampFrom::kHere ? frame.captured : frame.captured + least_transit_;
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
