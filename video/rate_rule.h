// How much a camera may send over a path that the machine is led over: it yields before set-points suffer.
#pragma once

#include "core/time.h"

namespace knuckle::video {

/// A queue that builds up on the path shows in the link's round trip long before packets are lost: where the round trip
/// stands a tenth of a second above the least there was, or nobody answers, the rate is halved, every second anew;
/// where it has been well for five seconds, it rises by a tenth every two.
class RateRule {
 public:
  /// @param most_kbps what was asked for; it is also what is sent at first.
  explicit RateRule(int most_kbps) : most_kbps_(most_kbps), rate_kbps_(most_kbps) {}

  /// Another operator, another path: what its round trip was is forgotten.
  void begin() noexcept { least_ = Duration::max(); }
  /// At any pace. @param round_trip newest of the link. @param silent nothing is heard from the far end.
  /// @return the rate from now on, within [kLeastRate_kbps, most].
  int step(Time now, Duration round_trip, bool silent) noexcept;

 private:
  const int most_kbps_;
  double rate_kbps_;
  Duration least_ = Duration::max();
  Time stepped_at_{}, suffered_at_ = kNever, changed_at_ = kNever;
};

}  // namespace knuckle::video
