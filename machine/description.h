// What a machine and a haptic device *are*, as their files say: plain data in SI units, no behaviour. The simulator
// reads these types and nothing else of this folder.
//
// Frames: M machine base, origin at the boom pin, x forward in the arm's plane, z up. Link i has its origin at its
// joint, x along the link to the next joint (bucket: to the tip), z to the left of x. Angles counter-clockwise seen
// with x right and z up; theta_boom from M's x, theta_arm and theta_bucket relative to the previous link.
#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>

#include "core/joints.h"
#include "machine/calibration.h"

namespace knuckle {

struct LinkDescription {
  double length_m = 0;
  double mass_kg = 0;
  PlanarVector com_m = PlanarVector::Zero();  ///< Centre of mass in link axes.
  double inertia_kgm2 = 0;                    ///< About the centre of mass.
  double min_rad = 0, max_rad = 0;            ///< Working range of the joint.
  double max_rate_radps = 0;                  ///< Commanded speed limit.
};

/// Boom and arm: a cylinder between a pin on the parent link and a pin on the moved link.
struct TriangleMount {
  PlanarVector parent_pin_m = PlanarVector::Zero();  ///< In parent axes (boom: M).
  PlanarVector child_pin_m = PlanarVector::Zero();   ///< In the moved link's axes.
};

/// Bucket: cylinder from G on the arm to H; rocker J-H on the arm; coupler H-K to the bucket.
struct BucketLinkage {
  PlanarVector cylinder_pin_m = PlanarVector::Zero();  ///< G, arm axes.
  PlanarVector rocker_pin_m = PlanarVector::Zero();    ///< J, arm axes.
  PlanarVector bucket_pin_m = PlanarVector::Zero();    ///< K, bucket axes.
  double rocker_length_m = 0;                          ///< |HJ|
  double coupler_length_m = 0;                         ///< |HK|
  int branch = 1;                                      ///< +1: H to the left of the ray from J to K, -1: to its right.
  double rocker_mass_kg = 0, coupler_mass_kg = 0;
};

struct FrictionDescription {
  double coulomb_N = 0;         ///< F_c
  double static_ratio = 1;      ///< F_s / F_c
  double stribeck_mps = 0.01;   ///< v_s
  double viscous_Ns_per_m = 0;  ///< F_v
};

struct ValveDescription {
  double nominal_flow_m3ps = 0;  ///< At full opening and nominal_drop_Pa over one metering edge.
  double nominal_drop_Pa = 0;
  double dead_band_extend = 0, dead_band_retract = 0;  ///< Fraction of spool stroke.
  double hysteresis = 0;                               ///< Fraction of spool stroke.
  double delay_s = 0;
  double natural_frequency_Hz = 0;
  double damping_ratio = 0;
  double full_stroke_s = 0;  ///< Fastest centre-to-end time of the spool.
};

struct CylinderDescription {
  double bore_m = 0, rod_m = 0;
  double min_length_m = 0, max_length_m = 0;  ///< Pin to pin, retracted and extended.
  double body_mass_kg = 0, rod_mass_kg = 0;
  FrictionDescription friction;
  ValveDescription valve;
  [[nodiscard]] double head_area_m2() const noexcept { return std::numbers::pi / 4 * bore_m * bore_m; }
  [[nodiscard]] double rod_side_area_m2() const noexcept {
    return std::numbers::pi / 4 * (bore_m * bore_m - rod_m * rod_m);
  }
};

struct HydraulicsDescription {
  double pump_flow_m3ps = 0;
  double pump_power_W = 0;
  double load_sensing_margin_Pa = 0;
  double load_sensing_lag_s = 0;
  double main_relief_Pa = 0, port_relief_Pa = 0, tank_Pa = 0;
  double bulk_modulus_Pa = 0;
  double hose_volume_m3 = 0;         ///< Per line.
  double hose_drop_Pa_per_m3ps = 0;  ///< Between transmitter and chamber.
};

struct SensorDescription {
  double pressure_range_Pa = 0, pressure_step_Pa = 0, pressure_noise_Pa = 0;
  double encoder_step_m = 0;
  double tilt_step_rad = 0, tilt_noise_rad = 0;
  enum class TiltMount : std::uint8_t { kOnHull, kOnBoom } tilt_mount = TiltMount::kOnHull;
  JointVector encoder_offset_m = JointVector::Zero();  ///< Reading minus true length, as calibrated.
};

/// Identity a node must show (objects 0x1000 and 0x1018:01, :02) before anything moves, and what its process data are
/// sent under.
struct NodeDescription {
  std::uint8_t id = 0;
  std::uint32_t device_type = 0, vendor = 0, product = 0;
  std::uint16_t tpdo = 0, rpdo = 0;  ///< COB-ID of its first PDO from and to it; 0: pre-defined connection set.
  [[nodiscard]] constexpr std::uint32_t tpdo_id() const noexcept { return tpdo != 0 ? tpdo : 0x180U + id; }
  [[nodiscard]] constexpr std::uint32_t rpdo_id() const noexcept { return rpdo != 0 ? rpdo : 0x200U + id; }
};

/// How values are written on the wire where devices differ.
struct WireDescription {
  double valve_full_stroke = 16384;      ///< Set-point and actual value (CiA 408) at 100 % of spool stroke.
  bool pressure_float = false;           ///< 0x6130:01 (float32, bar) instead of 0x9130:01 (integer).
  int pressure_digits = 2;               ///< Of the integer, in bar (0x6132:01).
  double encoder_speed_step_mps = 1e-4;  ///< 0x6005:02
};

/// CANopen side of the machine.
struct BusDescription {
  std::uint32_t bit_rate = 500000;
  double sync_Hz = 200;  ///< The slave loop's rate.
  int valve_every_nth_sync = 2;
  double controller_heartbeat_s = 0.05;
  double node_heartbeat_s = 0.1;  ///< What nodes are told to produce.
  double node_heartbeat_timeout_s = 0.25;
  double valve_watchdog_s = 0.05;      ///< RPDO event timer of the valve nodes.
  double controller_timeout_s = 0.15;  ///< Consumer time of the nodes for the controller's heartbeat.
  double sensor_age_limit_s = 0.025;
  // Patience of the start-up.
  double sdo_timeout_s = 0.25;      ///< For an SDO answer; asked twice.
  double boot_timeout_s = 1;        ///< Boot-up message after a reset; some nodes calibrate first.
  double start_timeout_s = 1;       ///< "Operational" after NMT start.
  double activate_timeout_s = 0.5;  ///< Valves ACTIVE after the control words.
  std::uint8_t controller_id = 1;
  WireDescription wire;
  PerJoint<NodeDescription> valves{};
  std::array<NodeDescription, 6> pressures{};  ///< boom A, B, arm A, B, bucket A, B
  PerJoint<NodeDescription> encoders{};
  NodeDescription tilt, enable;
};

struct LimitsDescription {
  double tip_speed_mps = 0;               ///< Commanded tip speed limit.
  double joint_soft_margin_rad = 0;       ///< Where soft walls begin, inside the working range.
  double chamber_pressure_Pa = 0;         ///< Gate: beyond it no command that raises it.
  double power_W = 0;                     ///< Gate: hydraulic power.
  double floor_m = -1e9;                  ///< Virtual wall: tip z in M stays above.
  double ceiling_m = 1e9, reach_m = 1e9;  ///< Likewise tip z below, tip x below.
};

struct MachineDescription {
  std::string name;
  std::string source;  ///< File it was read from.
  PerJoint<LinkDescription> links{};
  TriangleMount boom_mount, arm_mount;
  BucketLinkage bucket_linkage;
  PerJoint<CylinderDescription> cylinders{};
  HydraulicsDescription hydraulics;
  SensorDescription sensors;
  BusDescription bus;
  LimitsDescription limits;
  double payload_full_scale_kg = 0;
  PlanarVector payload_com_m = PlanarVector::Zero();  ///< Where a full bucket's load sits, bucket axes.
  // What identification has found out; nothing of it is in the values above until calibrated() has put it there.
  std::optional<DynamicsCalibration> dynamics_calibration;
  std::optional<GeometryCalibration> geometry_calibration;
  std::optional<PerJoint<ValveCalibration>> valve_calibration;
  std::optional<CalibrationProvenance> calibration_provenance;
  /// Force scale etc. of the bilateral law live with the device; the slave's contact law in ControlDescription.
  struct Control {
    double position_gain_1ps = 3;                                 ///< Kp
    double tip_stiffness_N_per_m = 1e5;                           ///< Ks
    JointVector stiffness_radius_m = JointVector(2.4, 1.3, 1.0);  ///< L_i in Kq_i = Ks L_i^2
    double feed_forward_fade_N = 500;                             ///< F1
    double bucket_position_gain_1ps = 3;                          ///< Kp of the bucket joint
    double dither = 0.0075;                                       ///< Fraction of spool stroke; 0 = off.
    double learning_limit = 0.015;                                ///< Of the dead band, fraction of spool stroke.
    double dead_band_fill = 0.95;                                 ///< Compensated fraction of the dead band.
  } control;
};

/// The machine as controller and estimator are to see it: geometry, encoder offsets and valves replaced by what was
/// calibrated. The simulator's machine is drawn around the description as it was read.
[[nodiscard]] MachineDescription calibrated(const MachineDescription& machine);

/// Haptic device: three revolute joints shaped like the machine's arm (forearm, wrist, finger).
struct DeviceDescription {
  std::string name;
  std::string source;
  JointVector link_m = JointVector::Zero();   ///< forearm, hand, finger
  PerJoint<double> min_rad{}, max_rad{};      ///< Machine-like joint angles.
  PerJoint<std::uint32_t> counts_per_turn{};  ///< At the motor.
  PerJoint<double> gear_ratio{};
  PerJoint<double> torque_constant_Nm_per_A{};
  PerJoint<double> rated_current_A{}, peak_current_A{};
  PerJoint<double> rotor_inertia_kgm2{};          ///< At the motor.
  PerJoint<double> link_inertia_kgm2{};           ///< At the joint.
  PerJoint<double> friction_Nm{}, viscous_Nms{};  ///< At the joint.
  PerJoint<double> cogging_Nm{};                  ///< At the joint, amplitude.
  PerJoint<int> cogging_periods{};                ///< Per motor turn.
  PerJoint<double> thermal_time_constant_s{};     ///< For I^2 t.
  PerJoint<int> joint_sign{};
  PerJoint<std::int32_t> zero_counts{};
  /// The one device that signs and zeros were measured on; 0: any, and the device's own word for its zeros counts.
  std::uint32_t serial = 0;
  double watchdog_s = 0.02;
  /// Values of the bilateral law on the hand's side (docs of the echo spring).
  struct Feel {
    double position_scale = 10;    ///< mu
    double force_scale = 1e-3;     ///< lambda
    double spring_N_per_m = 1000;  ///< K_l = lambda mu Ks
    double anchor_time_s = 0.15;   ///< t_w
    double bias_time_s = 3;        ///< tau_b at RTT 0
    double bias_time_per_rtt = 4;
    double damping_Ns_per_m = 60;  ///< b_c
    double bias_limit_N = 2.5;
    double force_limit_N = 8;  ///< At the hand.
    double slew_N_per_ms = 0.4;
    double on_N = 0.3, off_N = 0.1;  ///< R_on floor, R_off
  } feel;
};

}  // namespace knuckle
