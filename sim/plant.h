// The simulated machine: valves, chambers, pump, friction, linkages, links and the world at the bucket, stepped in
// steps of up to a millisecond inside the tick. Knows no wire; the CAN nodes read its state and set its valves.
#pragma once

#include <array>
#include <memory>

#include "core/joints.h"
#include "core/time.h"
#include "sim/truth.h"
#include "sim/world.h"

namespace knuckle::sim {

/// Running integrals [J] since the start, and what is stored now. Each element obeys in = out + lost + change of
/// stored.
struct EnergyLedger {
  struct Element {
    double in = 0, out = 0, lost = 0;  ///< Integrals.
    double stored = 0;                 ///< Now.
  };
  Element pump;                  ///< in: pump work; out: to the valves; lost: main relief
  PerJoint<Element> valve{};     ///< in: from pump and from the emptying chamber; out: to the filling chamber and tank
  PerJoint<Element> chambers{};  ///< in: oil from valve and tank checks; out: piston work; lost: port reliefs
  PerJoint<Element> piston{};    ///< in: piston work; out: to the links; lost: friction, cushions; stored: bristle,
                                 ///< stops, compliant pins
  Element links;    ///< in: pistons; out: to the world; lost: joint stops, ground; stored: kinetic, potential, ground
  Element contact;  ///< in: work of the bucket on world and test rig; nothing is split further
};

/// SI units; forces are of the world on the machine.
struct PlantState {
  double t_s = 0;
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero();
  JointVector joint_radps2 = JointVector::Zero();
  JointVector cylinder_m = JointVector::Zero(), cylinder_mps = JointVector::Zero();  ///< Pin-to-pin length and rate.
  JointVector lever_m = JointVector::Zero();                                         ///< dL/dtheta
  JointVector cylinder_N = JointVector::Zero();  ///< Pressure force p_A A_A - p_B A_B, friction not taken off.
  JointVector friction_N = JointVector::Zero();  ///< Opposes cylinder_mps.
  JointVector spool = JointVector::Zero();       ///< Actual position, [-1, 1]
  JointVector opening = JointVector::Zero();     ///< Of the edges behind the dead band; 1: nominal area.
  std::array<double, 6> chamber_Pa{};            ///< boom A, B, arm A, B, bucket A, B
  std::array<double, 6> transmitter_Pa{};        ///< At the valve's end of the hose; sensor errors not included.
  PlanarVector tip_m = PlanarVector::Zero(), tip_mps = PlanarVector::Zero();  ///< Frame M.
  PlanarVector tip_world_m = PlanarVector::Zero();                            ///< Frame W.
  /// All contact and the test rig's pull, frame M; payload not included.
  PlanarVector contact_N = PlanarVector::Zero();
  /// Where it acts on the bucket, bucket axes: the mean of the places weighted with the norms of their forces.
  PlanarVector contact_m = PlanarVector::Zero();
  PlanarVector wall_N = PlanarVector::Zero(), soil_N = PlanarVector::Zero(),
               pipe_N = PlanarVector::Zero();     ///< Frame M.
  double payload_kg = 0;                          ///< In or on the bucket.
  PlanarVector weight_N = PlanarVector::Zero();   ///< Of the payload, axes M.
  PlanarVector payload_m = PlanarVector::Zero();  ///< Its centre, bucket axes.
  double warmth_K = 0;                            ///< Of the oil, over the start.
  double pump_Pa = 0, pump_m3ps = 0;
  double pump_share = 1;                        ///< Delivered over asked flow; below 1 where the pump is short.
  double tilt_hull_rad = 0;                     ///< What an ideal slope sensor on the hull says.
  double hull_heave_m = 0, hull_pitch_rad = 0;  ///< Over the start, where the ground under the tracks yields.
  std::array<double, 2> track_N{};  ///< Pushes of that ground on rear and front end; one at 0: the machine tips.
  double tilt_boom_rad = 0;  ///< On the boom at mid-length: slope of the specific force, so it feels acceleration.
  double valve_work_J = 0;   ///< Cumulative work of the valves' ports on the machine.
  EnergyLedger energy;
  WorldEventRing events;
};

class Plant {
 public:
  /// Starts at rest in static equilibrium: spools closed, chambers hold the load.
  /// @throws InputError for a truth that breaks the numerics, a start outside the cylinders' reach or inside the world.
  Plant(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad);
  ~Plant();
  Plant(Plant&&) noexcept;
  Plant& operator=(Plant&&) noexcept;

  /// @param demand spool set-point in [-1, 1], positive = extend; clamped, a non-finite one is 0.
  void set_valve_demand(int joint, double demand) noexcept;
  /// Without pilot pressure every spool springs to neutral whatever its demand.
  void set_pilot(bool energised) noexcept;
  /// A test rig pulls at the tip from the next step on: a chain with a load cell, frame M; a non-finite force is none.
  void set_pull(const PlanarVector& force_N) noexcept;
  /// The same anywhere on the bucket: `at_m` in bucket axes.
  void set_pull(const PlanarVector& force_N, const PlanarVector& at_m) noexcept;
  /// Hangs a weight where loads lie in the bucket, in place of the one hung before; 0 takes it off. It comes and goes
  /// within 0.3 s like any DeadWeightDescription. Not for loops: allocates.
  void hang(double mass_kg);
  /// @param tick a multiple of 0.25 ms; allocates nothing.
  void step(Duration tick) noexcept;

  [[nodiscard]] const PlantState& state() const noexcept;
  [[nodiscard]] const MachineTruth& truth() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace knuckle::sim
