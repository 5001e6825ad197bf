// Whether two recordings are one: what is held out must not have been identified from, and nothing counts twice.
#pragma once

#include "estimation/identification/recording.h"

namespace knuckle::identify {

/// Share of b's usable samples that are in a, every signal to the last digit; pressures never repeat by themselves.
[[nodiscard]] double shared_samples(const estimation::Recording& a, const estimation::Recording& b);

}  // namespace knuckle::identify
