// The machine's CANopen nodes: three valves (CiA 408), six pressure transmitters (404), three wire encoders (406), a
// tilt sensor (410) and the machine enable (401). They know plain signals and frames, and nothing of the plant.
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "core/joints.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "sim/can_nodes_protocol.h"
#include "transport/can_bus.h"

namespace knuckle::sim {

/// What the machine is doing, as ideal sensors would say.
struct MachineSignals {
  JointVector spool = JointVector::Zero();  ///< Actual, fraction of stroke.
  std::array<double, 6> pressure_Pa{};      ///< boom A, B, arm A, B, bucket A, B
  JointVector cylinder_m = JointVector::Zero(), cylinder_mps = JointVector::Zero();
  double slope_rad = 0;  ///< At the tilt sensor.
};
/// What the nodes ask of the machine.
struct NodeOutputs {
  JointVector spool_demand = JointVector::Zero();  ///< Fraction of stroke, positive = extend.
  bool pilot = false;                              ///< Pilot pressure energised.
};
/// Reading = gain * signal + offset + noise, then the wire's steps.
struct SensorErrors {
  std::array<double, 6> pressure_gain{1, 1, 1, 1, 1, 1}, pressure_offset_Pa{}, pressure_noise_Pa{};
  JointVector encoder_offset_m = JointVector::Zero();
  double encoder_noise_m = 0;
  double tilt_offset_rad = 0, tilt_noise_rad = 0;
};

enum class NodeFault : std::uint8_t {
  kNone,
  kSilent,      ///< Its cable is off: it neither sends nor hears, and its own watchdogs run out.
  kFrozen,      ///< Goes on sending its last values.
  kInvalid,     ///< Sends the impossible value devices have for "broken" (largest integer; pressure status bit).
  kSpike,       ///< One PDO far off, then well again.
  kBrokenWire,  ///< Encoder: the wire snaps and winds back at 1.5 m/s.
  kStuck,       ///< Valve: the spool stays where it is as long as there is pilot pressure.
};

/// CiA 408 proportional valve.
class ValveNode {
 public:
  explicit ValveNode(const NodeDescription& identity, double full_stroke = canopen::kFullStroke);
  void step(Time now, double spool, Outbox& out) noexcept;
  /// Zero unless operational, ACTIVE, without fault and set from the bus.
  [[nodiscard]] double demand() const noexcept { return demand_; }
  [[nodiscard]] NodeProtocol& protocol() noexcept { return protocol_; }
  void inject(NodeFault fault, double spool) noexcept {
    fault_ = fault;
    stuck_at_ = spool;
  }

 private:
  void obey_control_word() noexcept;
  void watch(Time now, Outbox& out) noexcept;

  NodeProtocol protocol_;
  NodeProtocol::Handle control_, status_, mode_, set_point_, actual_;
  canopen::ValveState state_ = canopen::ValveState::kInit;
  bool faulted_ = false, reset_bit_ = false;
  double full_stroke_, demand_ = 0, stuck_at_ = 0;
  NodeFault fault_ = NodeFault::kNone;
};

/// Pressure transmitter, wire encoder or tilt sensor.
class SensorNode {
 public:
  struct Sample {
    double value = 0, rate = 0;  ///< Pa, m and m/s, or rad, sensor errors included; rate for encoders only.
  };
  enum class Kind : std::uint8_t { kPressure, kEncoder, kTilt };
  /// @param resolution smallest difference the sensor itself can tell, in SI.
  SensorNode(Kind kind, const NodeDescription& identity, double resolution, double range,
             const WireDescription& wire = {});
  void step(Time now, const Sample& sample, Outbox& out) noexcept;
  [[nodiscard]] NodeProtocol& protocol() noexcept { return protocol_; }
  void inject(NodeFault fault, Time now) noexcept;

 private:
  void put_pressure(double pressure_Pa) noexcept;
  void put_encoder(const Sample& sample) noexcept;
  void obey_preset() noexcept;
  void put_tilt(double slope_rad) noexcept;
  void put_invalid() noexcept;
  [[nodiscard]] Sample disturbed(const Sample& sample, Time now) noexcept;

  Kind kind_;
  double resolution_, range_;
  NodeProtocol protocol_;
  std::array<NodeProtocol::Handle, 4> objects_{};  ///< Value, second value, and the two step objects of the kind.
  NodeProtocol::Handle float_value_ = 0;           ///< Of a pressure.
  NodeProtocol::Handle preset_ = 0, offset_ = 0;   ///< Of an encoder.
  NodeFault fault_ = NodeFault::kNone;
  Time fault_at_ = kNever;
};

/// CiA 401 machine enable: gives pilot pressure, and takes it away by itself.
class EnableNode {
 public:
  EnableNode(const NodeDescription& identity, const PerJoint<NodeDescription>& valves,
             double full_stroke = canopen::kFullStroke);
  /// Every frame on the bus: it compares the valves' set-points with their actual positions.
  void observe(const CanFrame& frame) noexcept;
  void step(Time now, Outbox& out) noexcept;
  [[nodiscard]] bool pilot() const noexcept { return pilot_; }
  [[nodiscard]] NodeProtocol& protocol() noexcept { return protocol_; }
  void set_estop(bool pressed) noexcept { estop_ = pressed; }

 private:
  static constexpr std::size_t kDemands = 8;
  [[nodiscard]] bool following(Time now) noexcept;
  [[nodiscard]] bool allowed(Time now, Outbox& out) noexcept;

  NodeProtocol protocol_;
  NodeProtocol::Handle inputs_, outputs_;
  PerJoint<NodeDescription> valves_;
  double full_stroke_;
  PerJoint<double> demand_{};                         ///< The newest set-points on the bus ...
  PerJoint<std::array<double, kDemands>> demands_{};  ///< ... and as they were every 10 ms, a ring.
  std::size_t next_demand_ = 0;
  Time demands_at_ = kNever;
  PerJoint<double> actual_{};
  PerJoint<Time> apart_since_{Time::max(), Time::max(), Time::max()};
  PerJoint<bool> valve_fault_{};
  bool estop_ = false, pilot_ = false;
  bool latched_ = false;  ///< Taken away: the output must be off once before it can come on again.
};

/// All nodes behind one port of the bus; each has its own state.
class CanNodes {
 public:
  CanNodes(const MachineDescription& machine, const SensorErrors& errors, CanBus& port, std::uint64_t seed);
  CanNodes(const CanNodes&) = delete;
  CanNodes& operator=(const CanNodes&) = delete;
  /// Hears what has arrived, samples the signals, sends what is due.
  void step(Time now, const MachineSignals& signals) noexcept;
  [[nodiscard]] NodeOutputs outputs() const noexcept;

  /// False where no node has this id or its kind cannot have this fault.
  bool inject(std::uint8_t node, NodeFault fault) noexcept;
  bool send_emcy(std::uint8_t node, std::uint16_t code) noexcept;
  /// The node answers with another identity from its next start on.
  bool set_product(std::uint8_t node, std::uint32_t product) noexcept;
  void set_estop(bool pressed) noexcept { enable_.set_estop(pressed); }
  /// nullptr where there is none.
  [[nodiscard]] NodeProtocol* node(std::uint8_t id) noexcept;

 private:
  static constexpr std::size_t kNodes = 14;
  [[nodiscard]] double noise(double sigma) noexcept { return sigma > 0 ? sigma * normal_(random_) : 0.0; }
  void hear(Time now) noexcept;
  void step_sensors(const MachineSignals& signals) noexcept;
  template <typename Node, typename... Arguments>
  void step_node(std::size_t index, Node& node, const Arguments&... arguments) noexcept;
  /// Place in all_: valves, pressures, encoders, tilt, enable; kNodes where there is none.
  [[nodiscard]] std::size_t index_of(std::uint8_t id) const noexcept;

  CanBus& port_;
  SensorErrors errors_;
  std::mt19937_64 random_;
  std::normal_distribution<> normal_;
  PerJoint<ValveNode> valves_;
  std::array<SensorNode, 6> pressures_;
  PerJoint<SensorNode> encoders_;
  SensorNode tilt_;
  EnableNode enable_;
  std::array<NodeProtocol*, kNodes> all_;
  std::array<bool, kNodes> silent_{};
  Outbox out_;
  Time now_{};
  JointVector spool_ = JointVector::Zero();
};

}  // namespace knuckle::sim
