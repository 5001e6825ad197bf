// Do cylinder forces carry the arm's weight and does friction brake? What a recording's labels are judged by.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "app/recordings/recording_reader.h"
#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::identify {

/// Fit of joint torque = s * (drawing's gravity torque) + friction to means over a second.
struct WeightFit {
  JointVector ratio = JointVector::Zero();  ///< s: about 1, negative for swapped sides, 1e-5 for bar taken as Pa.
  JointVector error = JointVector::Zero();  ///< RMS of what is left, over that of gravity torque.
  std::array<bool, kJoints> decisive{};     ///< Enough data, moved about or with much more weight than friction holds.
  std::size_t samples = 0;

  /// Loads, oil and an inexact drawing leave much room; so does what is not known.
  [[nodiscard]] bool believable(int joint) const;
  /// What all three ratios are off by alike, such as transmitters of another range make them; 1 where they are not.
  [[nodiscard]] double common_scale() const;
  /// 0 is perfect. To compare two readings of one recording.
  [[nodiscard]] double misfit() const;
};
[[nodiscard]] WeightFit weigh(const MachineDescription& machine, const estimation::Recording& recording);

/// Another reading of the same numbers.
struct Relabelling {
  std::vector<std::size_t> channels;  ///< Concerned.
  std::string what;                   ///< "look swapped", "looks like bar"
};
/// The relabelling that turns an unbelievable recording into a believable one; none where no single one does.
[[nodiscard]] std::optional<Relabelling> better_reading(const MachineDescription& machine,
                                                        const estimation::Recording& recording);

}  // namespace knuckle::identify
