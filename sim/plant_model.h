// The plant's differential equation: one state vector in, its derivative and everything seen on the way out. Constants
// are worked out once; nothing here moves on by itself (spools, anchors and loads are held by the caller per substep).
#pragma once

#include <Eigen/Core>
#include <limits>

#include "sim/hull.h"
#include "sim/hydraulics.h"
#include "sim/rigid_body.h"
#include "sim/truth.h"
#include "sim/world_model.h"

namespace knuckle::sim {

inline constexpr double kSubstep_s = 0.25e-3;

/// Offsets in the state vector; three entries each up to kPump.
enum StateIndex : Eigen::Index {
  kAngle = 0,        ///< [rad]
  kRate = 3,         ///< [rad/s]
  kHead = 6,         ///< Chamber A [Pa]
  kRod = 9,          ///< Chamber B [Pa]
  kBristle = 12,     ///< LuGre z [m]
  kHeadRelief = 15,  ///< Port relief flow [m^3/s]
  kRodRelief = 18,
  kPump = 21,    ///< Pump pressure [Pa]
  kSense = 22,   ///< Load-sensing set-point of the pump, lagged [Pa]
  kHull = 23,    ///< Heave [m], pitch over that at the start [rad], and their rates
  kRodEnd = 27,  ///< Where pins yield: cylinder lengths at the rod's end [m] and their rates [m/s], three each
  kRodEndRate = 30,
  kSenseRate = 33,  ///< Of kSense, where the regulator swings [Pa/s]
  kStates = 34      // even: for the vector unit
};
using StateVector = Eigen::Matrix<double, kStates, 1>;

/// What stays constant over a substep.
struct HeldInputs {
  PerJoint<double> opening{};  ///< Valves, behind the dead band.
  BucketLoad load;
  PlanarVector pull_N = PlanarVector::Zero();     ///< Of a test rig on the bucket, frame M,
  PlanarVector pull_at_m = PlanarVector::Zero();  ///< and where, bucket axes.
};

/// Where the hull is and how it moves: M in W.
struct HullFrame {
  Turn turn;
  PlanarVector pin_m = PlanarVector::Zero(), pin_mps = PlanarVector::Zero();  ///< Origin of M.
  double rate_radps = 0, rate_radps2 = 0;
  PlanarVector lift_mps2 = PlanarVector::Zero();  ///< Acceleration of the pin less gravity, axes M.
};

/// Seen while evaluating the derivative; SI.
struct PlantDetail {
  JointVector joint_rad = JointVector::Constant(std::numeric_limits<double>::quiet_NaN());
  PoseGeometry pose;
  HullFrame hull;
  Hull::Ground ground;
  MassMatrix mass;
  Eigen::Matrix<double, 3, 2> hull_coupling;  ///< Of joints with the hull's heave and pitch, where it yields,
  Eigen::Matrix2d hull_mass;                  ///< and of those two.
  JointVector length_m, speed;                ///< Cylinders, at their rods' ends.
  JointVector pin_N;                          ///< What a cylinder pushes its link with;
  JointVector rod_damping_Ns_per_m;           ///< of all that slows a rod on a compliant pin, by its speed;
  JointVector pin_loss_W;                     ///< part of its power that is heat.
  PerJoint<double> head_flow, rod_flow;       ///< From the valve into the chambers.
  PerJoint<double> head_suck, rod_suck;       ///< Anti-cavitation checks, from tank.
  PerJoint<double> feed;                      ///< From the pump.
  PerJoint<double> leakage;                   ///< From head to rod side.
  JointVector pressure_force, friction, stop_force;
  JointVector bristle_decay_1ps;  ///< What |v| lets go of z, over z.
  JointVector bristle_loss_W;     ///< Friction power that is heat.
  JointVector joint_stop_torque;
  BucketMotion bucket;
  ContactForces contact;  ///< Of the world and the test rig.
  JointVector acceleration;
  double pump_flow, main_relief_flow;
  bool pump_at_limit;
};

class PlantModel {
 public:
  explicit PlantModel(const MachineTruth& truth);

  enum class Geometry {
    kNew,   ///< Computed for these angles.
    kNear,  ///< Of the last evaluation, whose angles were nearly these, moved to first order (RigidBody::shift).
  };
  /// @param detail out: everything at x. In, for kNear: what an earlier call has left there.
  [[nodiscard]] StateVector derivative(const StateVector& x, const HeldInputs& held, const WorldModel& world,
                                       PlantDetail& detail, Geometry geometry = Geometry::kNew) const noexcept;
  /// Of derivative() what changes with the valves' openings alone, at the same state.
  void reopen(const StateVector& x, const HeldInputs& held, PlantDetail& detail, StateVector& slope) const noexcept {
    flows(x, held, detail, slope);
  }
  [[nodiscard]] BucketMotion bucket_motion(const StateVector& x, const PoseGeometry& pose) const noexcept;
  /// At rest, spools closed, chamber pressures that hold the load; the ground then bears the hull.
  [[nodiscard]] StateVector equilibrium(const JointVector& joint_rad, const BucketLoad& load);
  /// Oil that is so much warmer than at the start.
  void warm(double warmth_K) noexcept;
  /// Of the oil now, over that at the nominal temperature.
  [[nodiscard]] double viscosity() const noexcept { return viscosity_; }
  /// After each substep: ground under the tracks that gives way. @return energy lost in it [J].
  double settle(const StateVector& x, double dt) noexcept;
  /// Kinetic and potential energy of arm and hull, and what the ground's springs store.
  [[nodiscard]] double mechanical_energy(const StateVector& x, const PlantDetail& detail,
                                         const BucketLoad& load) const noexcept;
  /// The state a step of length h later. @param slope, detail derivative() at x; out: detail at nearly the new state.
  [[nodiscard]] StateVector stepped(const StateVector& x, const StateVector& slope, PlantDetail& detail,
                                    const HeldInputs& held, const WorldModel& world, double h) const noexcept;
  /// Of the bucket where `detail` was seen.
  [[nodiscard]] Mobility mobility(const PlantDetail& detail) const noexcept;
  [[nodiscard]] const Hull& hull() const noexcept { return hull_; }
  [[nodiscard]] const RigidBody& body() const noexcept { return body_; }
  [[nodiscard]] const MachineTruth& truth() const noexcept { return truth_; }
  [[nodiscard]] const Oil& oil() const noexcept { return oil_; }
  [[nodiscard]] const AxisConstants& axis(std::size_t i) const noexcept { return axes_[i]; }
  [[nodiscard]] double head_volume(std::size_t i, double length_m) const noexcept;
  [[nodiscard]] double rod_volume(std::size_t i, double length_m) const noexcept;
  /// Spring energies of bristle, end stop and joint stop.
  [[nodiscard]] double bristle_energy(std::size_t i, double z_m) const noexcept;
  [[nodiscard]] double stop_energy(std::size_t i, double length_m) const noexcept;
  [[nodiscard]] double joint_stop_energy(std::size_t i, double joint_rad) const noexcept;
  /// The springs' part of the stop forces [N], [N m]; the rest of a stop's force is damping.
  [[nodiscard]] double stop_spring(std::size_t i, double length_m) const noexcept;
  [[nodiscard]] double joint_stop_spring(std::size_t i, double joint_rad) const noexcept;
  /// Of a compliant pin's spring, and of the rod's own motion.
  [[nodiscard]] double pin_energy(const StateVector& x, const PoseGeometry& pose, std::size_t i) const noexcept;
  /// Whether any pin yields: then a step of a millisecond is too long.
  [[nodiscard]] bool pins_compliant() const noexcept { return pins_compliant_; }
  /// Flow that the openings ask for at the load-sensing pressure.
  [[nodiscard]] double asked_flow(const StateVector& x, const HeldInputs& held) const noexcept;

 private:
  /// How fast states decay by themselves [1/s], none above 0: chambers A, chambers B, bristles, as from kHead on; pump;
  /// rods on compliant pins.
  using Decays = std::array<double, 3 * kJoints + 1 + kJoints>;
  /// Of a valve's flow, what the others' openings leave.
  [[nodiscard]] double left_by_others(std::size_t i, const HeldInputs& held) const noexcept;
  [[nodiscard]] Decays decays(const StateVector& x, const HeldInputs& held, const PlantDetail& detail) const noexcept;
  struct BristleConstants {
    double stiffness, extend_N, retract_N, rise, inverse_stribeck2, damping, viscous, seal_N_per_Pa, pin_share;
  };
  void flows(const StateVector& x, const HeldInputs& held, PlantDetail& detail, StateVector& dx) const noexcept;
  [[nodiscard]] static HullState hull_state(const StateVector& x) noexcept;
  [[nodiscard]] HullFrame hull_frame(const StateVector& x) const noexcept;
  void accelerate(const StateVector& x, const JointVector& torque, const BucketLoad& load, PlantDetail& detail,
                  StateVector& dx) const noexcept;
  void friction(const StateVector& x, std::size_t i, PlantDetail& detail, StateVector& dx) const noexcept;
  void rod_ends(const StateVector& x, PlantDetail& detail) const noexcept;
  void push_link(const StateVector& x, std::size_t i, PlantDetail& detail, StateVector& dx) const noexcept;
  /// Force of cushion and stop on the rod, and by how much its speed makes it.
  struct EndStop {
    double force_N = 0, damping_Ns_per_m = 0;
  };
  [[nodiscard]] EndStop end_stop(std::size_t i, double length_m, double speed_mps) const noexcept;
  [[nodiscard]] double joint_stop(std::size_t i, double joint_rad, double rate_radps) const noexcept;

  MachineTruth truth_;
  RigidBody body_;
  Hull hull_;
  double viscosity_ = 1;
  bool pins_compliant_ = false;
  Oil oil_;
  PerJoint<AxisConstants> axes_{};
  PerJoint<BristleConstants> bristles_{};
  double relief_gain_, main_relief_gain_, suck_gain_, regulator_gain_;
  double thinner_ = 1;  ///< Than at the start: gaps leak so many times as much.
};

}  // namespace knuckle::sim
