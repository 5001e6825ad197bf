// What the encoders of the joints say, as lengths of the cylinders: above the wire it does not matter which kind they
// are.
#pragma once

#include <limits>
#include <optional>

#include "core/joints.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle {

/// The length of a wire encoder is its cylinder's. For the angle of a rotary one it is what the file's drawing has
/// there, also where the geometry is calibrated: what a survey finds is found for these lengths.
class EncoderLengths {
 public:
  explicit EncoderLengths(const MachineDescription& machine);

  /// @param reading value of the encoder's field (machine/bus_frames.h): m, or rad in any turn.
  /// @return nullopt for an angle that the joint cannot have, or that is none of the encoder's.
  [[nodiscard]] std::optional<double> length_m(int joint, double reading) const noexcept;
  /// The other way round. @return of a rotary encoder within its first turn; nullopt where no angle has this length.
  [[nodiscard]] std::optional<double> reading(int joint, double length_m) const noexcept;

 private:
  struct Shaft {
    bool is_there = false;  ///< A rotary encoder.
    double sign = 1, zero_rad = 0, middle_rad = 0;
    double range_rad = std::numeric_limits<double>::infinity();
  };
  PerJoint<Shaft> shafts_{};
  std::optional<Kinematics> drawing_;  ///< Where a joint has a rotary encoder.
};

/// Smallest difference of each length: the step of a wire encoder, or that of a rotary one at the joint's longest
/// lever.
[[nodiscard]] JointVector length_steps_m(const MachineDescription& machine);

}  // namespace knuckle
