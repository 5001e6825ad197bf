// Do cylinder forces carry the arm's weight and does friction brake? What a recording's labels are judged by.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "app/recordings/recording_reader.h"
#include "core/joints.h"
#include "estimation/regressor.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::identify {

/// What the cylinders do at one moment, and what the drawing's weight asks of them.
struct WeightRow {
  JointVector gravity_Nm, torque_Nm, lever_m, speed_mps;
};
/// Reads them from a recording.
class WeightRows {
 public:
  WeightRows(const MachineDescription& machine, const estimation::Recording& recording);
  /// nullopt where a sample is missing that is needed, or a length has no angle.
  [[nodiscard]] std::optional<WeightRow> at(std::size_t sample) const;

 private:
  const MachineDescription& machine_;
  const estimation::Recording& recording_;
  Kinematics kinematics_;
  estimation::BaseParameters nominal_;
  std::size_t reach_;  // samples on either side, for speeds
};

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
