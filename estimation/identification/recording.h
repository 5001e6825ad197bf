// A recording of raw machine signals at a fixed period: what identification works on, whatever it was read from.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/joints.h"
#include "estimation/joint_state.h"

namespace knuckle::estimation {

struct Recording {
  std::string source;                ///< File or run, for messages.
  double step_s = 0;                 ///< Fixed period; a reader resamples what was irregular.
  std::vector<Measurement> samples;  ///< As the sensors said: encoder offsets included, nothing filtered.
  /// 0 where a sample stands for a gap or for values that cannot be; one a sample. Motion is never pieced together
  /// over such samples.
  std::vector<std::uint8_t> usable;
  std::vector<JointVector> valve;  ///< Commands [-1, 1] on the wire, one a sample, NaN: unknown; empty: not recorded.

  [[nodiscard]] double duration_s() const noexcept { return step_s * static_cast<double>(samples.size()); }
};

/// Every `every`-th sample, as if recorded slower; usable where it and those left out behind it are.
[[nodiscard]] inline Recording decimated(const Recording& recording, std::size_t every) {
  Recording result{recording.source, recording.step_s * static_cast<double>(every), {}, {}, {}};
  for (std::size_t i = 0; i < recording.samples.size(); i += every) {
    result.samples.push_back(recording.samples[i]);
    const auto first = recording.usable.begin() + static_cast<std::ptrdiff_t>(i);
    const auto length = static_cast<std::ptrdiff_t>(std::min(every, recording.usable.size() - i));
    result.usable.push_back(*std::min_element(first, first + length));
    if (!recording.valve.empty()) result.valve.push_back(recording.valve[i]);
  }
  return result;
}

/// As if recorded every `step_s`, or as it is where that is no more often.
[[nodiscard]] inline Recording thinned(const Recording& recording, double step_s) {
  return decimated(recording, static_cast<std::size_t>(std::max(1L, std::lround(step_s / recording.step_s))));
}

}  // namespace knuckle::estimation
