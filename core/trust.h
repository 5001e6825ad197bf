// How far control acts on an estimate of a given confidence.
#pragma once

#include <algorithm>

namespace knuckle {

/// Nothing up to a confidence of 0.1, everything from 0.4 on; a NaN is no trust. The same for what is felt, given way
/// to and pressed: what one of them believed alone would be felt without being complied with, or the other way round.
[[nodiscard]] constexpr double trust(double confidence) noexcept {
  constexpr double kNone = 0.1, kFull = 0.4;
  const double share = (confidence - kNone) / (kFull - kNone);
  return share > 0 ? std::min(share, 1.0) : 0.0;
}

}  // namespace knuckle
