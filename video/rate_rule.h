// How much a camera may send over a path that the machine is led over: it yields before set-points suffer.
#pragma once

#include <optional>

#include "core/time.h"

namespace knuckle::video {

/// A queue that builds up on the path shows in the link's round trip long before packets are lost: where the round trip
/// has stood a tenth of a second above the least there was for 0.3 s, or nobody answers, the rate is halved, every
/// second anew; where it has been well for five seconds, it rises by a tenth every two.
class RateRule {
 public:
  /// @param most_kbps what was asked for; it is also what is sent at first.
  explicit RateRule(int most_kbps) : most_kbps_(most_kbps), rate_kbps_(most_kbps) {}

  /// Another operator, another path: only round trips of messages that come after the next step count.
  void begin() noexcept { begins_ = true; }
  /// At any pace. @param heard_at when the newest message of the far end came in. @param round_trip as it says.
  /// @param silent that is too long ago.
  /// @return the rate from now on, within [kLeastRate_kbps, most].
  int step(Time now, Time heard_at, Duration round_trip, bool silent) noexcept;

 private:
  const int most_kbps_;
  double rate_kbps_;
  Duration least_ = Duration::max();
  Time begun_at_ = kNever, stepped_at_{}, suffered_at_ = kNever, halved_at_ = kNever, raised_at_ = kNever;
  bool begins_ = false;
  std::optional<Time> longer_since_;  ///< The round trip has been well above the least.
};

}  // namespace knuckle::video
