// When a recording shows forces that free motion has not: the bucket in soil, on something, or loaded.
#pragma once

#include <string>
#include <vector>

#include "estimation/identification/recording.h"
#include "machine/description_fwd.h"

namespace knuckle::identify {

/// Of a recording, from its first sample.
struct Seconds {
  double from_s, to_s;
};

/// Where cylinders carry so much more or less than the drawing's weight and friction, averaged over half a second, that
/// something else must push. Wrong labels and units look so nearly all the time.
[[nodiscard]] std::vector<Seconds> contact_seconds(const MachineDescription& machine,
                                                   const estimation::Recording& recording);

/// The same recording with those samples unusable.
[[nodiscard]] estimation::Recording without(const std::vector<Seconds>& stretches, estimation::Recording recording);

/// Of the bucket: "seems to touch or carry something at 12.5 to 15.0 s (14 % of the recording): ..."
[[nodiscard]] std::string contact_text(const std::vector<Seconds>& stretches, const estimation::Recording& recording);

}  // namespace knuckle::identify
