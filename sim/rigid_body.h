// Equations of motion of boom, arm, bucket, their cylinders, rocker, coupler and a load, planar, on a hull at rest.
// Newton-Euler over lumps that ride on a link and move along it; formulation and geometry independent of estimation/.
#pragma once

#include "core/joints.h"
#include "machine/description.h"
#include "sim/linkage.h"

namespace knuckle::sim {

inline constexpr double kGravity_mps2 = 9.80665;

/// Mass moments of everything that rides on one link (about the link's origin, in its axes), partly moving with the
/// next joint's angle s. Primes are derivatives by s.
struct Lump {
  double mass = 0;
  PlanarVector first = PlanarVector::Zero(), first1 = PlanarVector::Zero(), first2 = PlanarVector::Zero();
  double second = 0, second1 = 0;  ///< sum m |c|^2 + I
  double mixed = 0, mixed1 = 0;    ///< sum m c x c' + I psi'
  double own = 0, own1 = 0;        ///< sum m |c'|^2 + I psi'^2
  /// Adds a rigid body of the link itself.
  void add_fixed(double m, double inertia, const PlanarVector& c) noexcept {
    mass += m;
    first += m * c;
    second += m * c.squaredNorm() + inertia;
  }
};

/// A load in the bucket: moments about the bucket pin in bucket axes.
struct BucketLoad {
  double mass_kg = 0;
  PlanarVector first_kgm = PlanarVector::Zero();
  double second_kgm2 = 0;
  void add(double mass, const PlanarVector& at) noexcept {
    mass_kg += mass;
    first_kgm += mass * at;
    second_kgm2 += mass * at.squaredNorm();
  }
};

/// Everything the equations of motion need at one pose.
struct PoseGeometry {
  JointVector length_m, lever_m;         ///< Cylinders.
  PlanarVector boom_m, arm_m, bucket_m;  ///< Links as vectors in M, joint to joint (bucket: to the tip).
  Turn boom, arm, bucket;                ///< Link axes to M.
  PlanarVector linkage_m, linkage1_m;  ///< Pin between rocker and coupler from the arm's joint, and by bucket angle; M.
  Lump on_hull, on_boom, on_arm;
};

struct MassMatrix {  ///< Symmetric, joint angles.
  double m00, m01, m02, m11, m12, m22;
  [[nodiscard]] JointVector solve(const JointVector& torque) const noexcept;  ///< By cofactors: one division.
  [[nodiscard]] double kinetic_energy(const JointVector& rate) const noexcept;
};

/// How the hull moves and what the arm does to it, axes M.
struct BaseMotion {
  PlanarVector pin_mps2 =
      PlanarVector::Zero();  ///< Of the boom pin, with gravity as the upward acceleration it equals.
  double rate_radps = 0, rate_radps2 = 0;
};
struct ArmForces {
  JointVector torque_Nm;
  PlanarVector force_N;  ///< That the hull puts on the arm, its cylinders included, to move it so,
  double moment_Nm;      ///< and its moment about the boom pin.
};

class RigidBody {
 public:
  RigidBody(const MachineDescription& machine, double hull_pitch_rad);

  [[nodiscard]] PoseGeometry pose(const JointVector& joint_rad) const noexcept;
  /// To angles a hair away: positions and lengths move to first order; levers, lumps and linkage1_m stay.
  static void shift(PoseGeometry& pose, const JointVector& by_rad) noexcept;
  [[nodiscard]] MassMatrix mass(const PoseGeometry& pose, const BucketLoad& load) const noexcept;
  /// Joint torques that hold gravity and velocity terms: mass * acceleration + bias = applied torque.
  [[nodiscard]] JointVector bias(const PoseGeometry& pose, const JointVector& rate_radps,
                                 const BucketLoad& load) const noexcept;
  /// Everything that a motion of arm and hull takes.
  [[nodiscard]] ArmForces inverse_dynamics(const PoseGeometry& pose, const JointVector& rate_radps,
                                           const JointVector& acceleration_radps2, const BucketLoad& load,
                                           const BaseMotion& base) const noexcept;
  /// Against gravity as an upward acceleration, axes M; zero with the boom pin's height.
  [[nodiscard]] double potential_energy(const PoseGeometry& pose, const BucketLoad& load,
                                        const PlanarVector& lift_mps2) const noexcept;
  /// Of all that moves with the arm, cylinders and load included.
  [[nodiscard]] double arm_mass_kg(const PoseGeometry& pose, const BucketLoad& load) const noexcept {
    return pose.on_hull.mass + pose.on_boom.mass + pose.on_arm.mass + links_[kBucket].mass + load.mass_kg;
  }
  [[nodiscard]] static PlanarVector tip(const PoseGeometry& pose) noexcept {
    return pose.boom_m + pose.arm_m + pose.bucket_m;
  }
  [[nodiscard]] static PlanarVector tip_rate(const PoseGeometry& pose, const JointVector& rate_radps) noexcept;
  /// Velocity of the bucket pin, and of the pin between rocker and coupler; frame M.
  [[nodiscard]] static PlanarVector bucket_pin_rate(const PoseGeometry& pose, const JointVector& rate_radps) noexcept;
  [[nodiscard]] static PlanarVector linkage_rate(const PoseGeometry& pose, const JointVector& rate_radps) noexcept;
  /// J^T f of a force on the bucket with its moment about the bucket pin; of a force on the linkage's pin. Frame M.
  [[nodiscard]] static JointVector bucket_torque(const PoseGeometry& pose, const PlanarVector& force_N,
                                                 double moment_Nm) noexcept;
  [[nodiscard]] static JointVector linkage_torque(const PoseGeometry& pose, const PlanarVector& force_N) noexcept;
  /// M to W.
  [[nodiscard]] const Turn& hull() const noexcept { return hull_; }
  /// Gravity as the upward acceleration of the hull that it equals, frame M.
  [[nodiscard]] const PlanarVector& lift_mps2() const noexcept { return lift_; }

 private:
  /// Cylinder body and rod as slender rods, each reaching from its pin along the line between the pins.
  struct RodPair {
    double mass, body_first, rod_mass, rod_centre;  ///< body_first: mass times distance from the base pin
    double turning;                                 ///< Moment of inertia that does not change with the stroke.
  };
  static void add_cylinder(Lump& lump, const RodPair& rods, const PlanarVector& fixed, const MovingPoint& moving,
                           const PinLine& line) noexcept;
  void add_rocker(Lump& lump, const FourBar& bars) const noexcept;

  MachineDescription machine_;
  Turn hull_;
  PlanarVector lift_;
  PerJoint<RodPair> rods_{};
  PerJoint<Lump> links_{};  // each link's own mass, rigid; the bucket's with its half of the coupler
};

}  // namespace knuckle::sim
