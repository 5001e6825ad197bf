// Where the links are and what lever each cylinder has, from the nominal machine description. Allocation-free.
#pragma once

#include <optional>

#include "core/joints.h"
#include "machine/description.h"

namespace knuckle {

/// Cylinder pin-to-pin length and its lever about the joint.
struct CylinderState {
  double length_m;
  double lever_m;  ///< dL/dtheta, signed: joint torque [N m] = lever * cylinder force; length rate = lever * joint rate.
};

class Kinematics {
 public:
  /// @throws InputError where a cylinder cannot reach its joint's working range, a linkage passes a toggle in it, or
  /// a stroke is not monotone in it; names file, key, value and bound.
  explicit Kinematics(const MachineDescription& machine);

  /// @return nullopt beyond a toggle.
  [[nodiscard]] std::optional<CylinderState> cylinder_at(int joint, double joint_rad) const noexcept;
  /// Inverse of cylinder_at(...).length_m on the working range (extended by a small margin); round trip <= 1e-10 rad.
  /// @return nullopt for lengths that no angle of that range gives, or a non-finite one.
  [[nodiscard]] std::optional<double> joint_at(int joint, double length_m) const noexcept;

  /// Tip position in M for joint angles, hull pitch not included.
  [[nodiscard]] PlanarVector tip(const JointVector& joints_rad) const noexcept;
  /// d tip / d joints, rows x and z. Joint torque of a tip force f is J^T f.
  [[nodiscard]] Eigen::Matrix<double, 2, 3> tip_jacobian(const JointVector& joints_rad) const noexcept;
  /// Joint angles that put the tip at `tip_m` with absolute bucket angle (sum of joints), elbow up.
  /// @return nullopt out of reach; the working range is not checked here.
  [[nodiscard]] std::optional<JointVector> inverse(const PlanarVector& tip_m, double bucket_absolute_rad) const noexcept;

 private:
  MachineDescription machine_;
};

}  // namespace knuckle
