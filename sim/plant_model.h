// The plant's differential equation: one state vector in, its derivative and everything seen on the way out. Constants
// are worked out once; nothing here moves on by itself (spools, anchors and loads are held by the caller per substep).
#pragma once

#include <Eigen/Core>

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
  kPump = 21,   ///< Pump pressure [Pa]
  kSense = 22,  ///< Load-sensing set-point of the pump, lagged [Pa]
  kStates = 23
};
using StateVector = Eigen::Matrix<double, 24, 1>;  // one spare entry, always 0: even size for the vector unit

/// What stays constant over a substep.
struct HeldInputs {
  PerJoint<double> opening{};  ///< Valves, behind the dead band.
  BucketLoad load;
  PlanarVector tip_load_N = PlanarVector::Zero();  ///< A test rig's pull on the tip, frame M.
};

/// Seen while evaluating the derivative; SI.
struct PlantDetail {
  PoseGeometry pose;
  MassMatrix mass;
  JointVector speed;                     ///< Cylinders.
  PerJoint<double> head_flow, rod_flow;  ///< From the valve into the chambers.
  PerJoint<double> head_suck, rod_suck;  ///< Anti-cavitation checks, from tank.
  PerJoint<double> feed;                 ///< From the pump.
  JointVector pressure_force, friction, stop_force;
  JointVector bristle_loss_W;  ///< Friction power that is heat.
  JointVector joint_stop_torque;
  PlanarVector tip, tip_rate;  ///< Frame M.
  ContactForces contact;       ///< Frame W.
  PlanarVector tip_force;      ///< Contact and test rig, frame M.
  JointVector acceleration;
  double pump_flow, main_relief_flow;
  bool pump_at_limit;
};

class PlantModel {
 public:
  explicit PlantModel(const MachineTruth& truth);

  [[nodiscard]] StateVector derivative(const StateVector& x, const HeldInputs& held, const WorldModel& world,
                                       PlantDetail& detail) const noexcept;
  /// At rest, spools closed, chamber pressures that hold the load.
  [[nodiscard]] StateVector equilibrium(const JointVector& joint_rad, const BucketLoad& load) const;
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
  /// Flow that the openings ask for at the load-sensing pressure.
  [[nodiscard]] double asked_flow(const StateVector& x, const HeldInputs& held) const noexcept;

 private:
  struct BristleConstants {
    double stiffness, extend_N, retract_N, rise, inverse_stribeck2, damping, viscous;
  };
  void flows(const StateVector& x, const HeldInputs& held, PlantDetail& detail, StateVector& dx) const noexcept;
  void friction(const StateVector& x, std::size_t i, PlantDetail& detail, StateVector& dx) const noexcept;
  [[nodiscard]] double end_stop(std::size_t i, double length_m, double speed_mps) const noexcept;
  [[nodiscard]] double joint_stop(std::size_t i, double joint_rad, double rate_radps) const noexcept;

  MachineTruth truth_;
  RigidBody body_;
  Oil oil_;
  PerJoint<AxisConstants> axes_{};
  PerJoint<BristleConstants> bristles_{};
  double relief_gain_, main_relief_gain_, suck_gain_, regulator_gain_;
};

}  // namespace knuckle::sim
