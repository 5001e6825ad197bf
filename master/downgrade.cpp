#include "master/downgrade.h"

namespace knuckle::master {
namespace {

Reason reason(ReasonCode code, double value, double limit, double unit) noexcept {
  return {code, 0, static_cast<float>(unit * value), static_cast<float>(unit * limit)};
}

}  // namespace

void Downgrade::Cause::step(double value, const Bounds& bounds, double dt_s) noexcept {
  const bool turning = on ? value < bounds.off : value > bounds.on;
  for_s = turning ? for_s + dt_s : 0;
  if (for_s <= (on ? bounds.off_s : bounds.on_s)) return;
  on = !on;
  for_s = 0;
}

Reason Downgrade::step(const FeltInputs& in, double dt_s) noexcept {
  if (!in.engaged) {
    round_trip_ = silence_ = lost_ = doubt_ = {};
    return {};
  }
  round_trip_.step(in.round_trip_s, kRoundTrip_s, dt_s);
  silence_.step(in.silence_s, kSilence_s, dt_s);
  lost_.step(in.lost_share, kLost, dt_s);
  doubt_.step(1 - in.confidence, kDoubt, dt_s);
  constexpr double kMs = 1e3, kPercent = 100;
  if (silence_.on) return reason(ReasonCode::kCuesSilence, in.silence_s, kSilence_s.on, kMs);
  if (round_trip_.on) return reason(ReasonCode::kCuesDelay, in.round_trip_s, kRoundTrip_s.on, kMs);
  if (lost_.on) return reason(ReasonCode::kCuesLoss, in.lost_share, kLost.on, kPercent);
  if (doubt_.on) return reason(ReasonCode::kCuesEstimate, in.confidence, 1 - kDoubt.on, kPercent);
  return {};
}

}  // namespace knuckle::master
