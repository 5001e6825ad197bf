// Where the links are and what lever each cylinder has, from the nominal machine description. Allocation-free.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>

#include "core/joints.h"
#include "machine/arm_description.h"
#include "machine/description_fwd.h"
#include "machine/planar_jacobian.h"

namespace knuckle {

// How small a cylinder's lever may be asks three questions.
/// Below it the cylinder no longer says where the joint is (0.1 mm would be 1 deg): a machine file whose working range
/// comes below is refused, so that nothing divides by less.
inline constexpr double kLeastLever_m = 0.005;
/// Below it a millimetre of length is three degrees of the joint: a force found from that joint's torque has no
/// direction any more.
inline constexpr double kNearToggle_m = 0.02;
/// A joint's torque is no surer than through a lever of this length: below it what two millimetres of the pins make of
/// some kN in the cylinder outweighs noise and friction, which shrink with the lever.
inline constexpr double kLeastSureLever_m = 0.05;

/// Cylinder pin-to-pin length and its lever about the joint.
struct CylinderState {
  double length_m;
  double
      lever_m;  ///< dL/dtheta, signed: joint torque [N m] = lever * cylinder force; length rate = lever * joint rate.
};

class Kinematics {
 public:
  /// @throws InputError where a cylinder cannot reach its joint's working range, a linkage passes a toggle in it, or
  /// a stroke is not monotone in it; names file, key, value and bound.
  explicit Kinematics(const MachineDescription& machine);

  /// @return nullopt beyond a toggle.
  [[nodiscard]] std::optional<CylinderState> cylinder_at(int joint, double joint_rad) const noexcept;
  /// Inverse of cylinder_at(...).length_m on the working range and beyond it, as far as the cylinder's stroke goes
  /// (with 10 mm of tolerance) and the lever keeps 5 mm; round trip <= 1e-10 rad.
  /// @return nullopt for lengths that no angle of that range gives, or a non-finite one.
  [[nodiscard]] std::optional<double> joint_at(int joint, double length_m) const noexcept;

  /// From an angle by steps of one sign as far as the cylinder's stroke and this margin go, short of a toggle.
  [[nodiscard]] double outermost(const MachineDescription& machine, int joint, double from_rad, double step_rad,
                                 double margin_m) const noexcept;

  /// Tip position in M for joint angles, hull pitch not included.
  [[nodiscard]] PlanarVector tip(const JointVector& joints_rad) const noexcept;
  /// d tip / d joints, rows x and z. Joint torque of a tip force f is J^T f.
  [[nodiscard]] PlanarJacobian tip_jacobian(const JointVector& joints_rad) const noexcept;
  /// Joint angles that put the tip at `tip_m` with absolute bucket angle (sum of joints), elbow up.
  /// @return nullopt out of reach; the working range is not checked here.
  [[nodiscard]] std::optional<JointVector> inverse(const PlanarVector& tip_m,
                                                   double bucket_absolute_rad) const noexcept;

 private:
  /// Law of cosines: L^2 = sum_squares - 2 product cos(theta + offset).
  struct Triangle {
    double sum_squares, product, offset_rad;
    double side;  ///< Sign of theta + offset, wrapped, over the working range.
  };
  /// All points in arm axes, from the arm pin.
  struct FourBar {
    PlanarVector cylinder_pin, rocker_pin, bucket_joint;
    PlanarVector bucket_pin;  ///< K in bucket axes.
    double bucket_pin_radius, rocker, coupler;
    double branch;        ///< Side of H seen from J to K.
    double rocker_side;   ///< Side of H seen from G to J, over the working range.
    double coupler_side;  ///< Side of K seen from H to the bucket joint, over the working range.
  };
  /// Where joint_at answers: the working range and what lies beyond it.
  struct Span {
    double min_rad, max_rad;
    double min_length, max_length;
  };

  [[nodiscard]] CylinderState triangle_at(const Triangle& triangle, double joint_rad) const noexcept;
  [[nodiscard]] std::optional<CylinderState> four_bar_at(double bucket_rad) const noexcept;
  [[nodiscard]] std::optional<double> four_bar_inverse(double length_m) const noexcept;
  /// Refuses what cannot reach or passes a toggle; sets the span and the triangle's side.
  void scan(const MachineDescription& machine, int joint);

  std::array<Triangle, 2> triangles_{};
  FourBar four_bar_{};
  PerJoint<Span> spans_{};
  JointVector lengths_m_;
};

// Where the parts of the arm are at given joint angles: what every picture of the machine is drawn from.

using Frame2 = Eigen::Isometry2d;  ///< (x forward, z up) in the arm's plane.

/// All in frame M. Letters as in the machine file: boom cylinder to D, arm cylinder E-F, bucket cylinder G-H, rocker
/// J-H, coupler H-K.
struct MachinePose {
  struct Cylinder {
    PlanarVector base_m, rod_end_m;
    [[nodiscard]] double length_m() const { return (rod_end_m - base_m).norm(); }
  };
  Frame2 boom, arm, bucket;  ///< Link axes.
  PerJoint<Cylinder> cylinders;
  PlanarVector rocker_pin_m;   ///< J
  PlanarVector linkage_pin_m;  ///< H
  PlanarVector bucket_pin_m;   ///< K
  PlanarVector tip_m;
};

/// Any angles: where the bucket linkage cannot reach, H lies on the line from J to K.
[[nodiscard]] MachinePose pose_of(const MachineDescription& machine, const JointVector& joints_rad);

/// From the base pin to where the rod comes out, at this pin-to-pin length; the description does not say, so it is
/// what cylinders usually leave for the rod's eye.
[[nodiscard]] double barrel_length_m(const CylinderDescription& cylinder, double length_m);

/// Corners of the bucket's outline in bucket axes, counter-clockwise from the tip.
[[nodiscard]] std::array<PlanarVector, 6> bucket_outline(const MachineDescription& machine);

/// The middle of each joint's range.
[[nodiscard]] JointVector middle_of_range(const MachineDescription& machine) noexcept;

}  // namespace knuckle
