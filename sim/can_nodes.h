// The machine's CANopen nodes: valves of one or several axes (CiA 408), pressure transmitters of one or several
// channels (404), wire or rotary encoders (406), a tilt sensor (410), the machine enable and modules with analogue
// inputs and outputs (401); and the controller that the machine has by itself, with the frames that it sends. They know
// plain signals and frames, and nothing of the plant.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "core/joints.h"
#include "core/time.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "sim/broadcast_faults.h"
#include "sim/lss_node.h"
#include "sim/own_controller.h"
#include "sim/packet_sender.h"
#include "transport/can_bus.h"
#include "transport/canopen.h"

namespace knuckle::sim {

// The CANopen side that all simulated nodes share (CiA 301): network state, heartbeats, SDO server over an object
// table, up to four transmit PDOs and receive PDOs with honoured parameters. Devices put process values in and take
// them out by handle.

/// Frames that nodes want to send in one step.
struct Outbox {
  std::array<CanFrame, 128> frames{};
  std::size_t count = 0;
  void push(const CanFrame& frame) noexcept {
    if (count < frames.size()) frames[count++] = frame;
  }
};

enum class Access : std::uint8_t { kReadOnly, kReadWrite };

/// An object of a device that is sold.
struct DeviceObject {
  canopen::Object object;
  std::uint8_t size = 4;  ///< Bytes.
  Access access = Access::kReadOnly;
  std::uint32_t value = 0;  ///< As delivered.
};

class NodeProtocol {
 public:
  using Handle = std::size_t;
  static constexpr std::size_t kTpdos = 4;
  using TpdoMaps = std::array<canopen::PdoMap, kTpdos>;
  /// Identifiers follow the pre-defined connection set; PDOs start with these maps, disabled where a map is empty,
  /// producer heartbeat and timers off, as a device does before it is configured.
  /// @param tpdo_type of all: every n-th SYNC, or kEventDriven. @param rpdos of all that it has.
  NodeProtocol(const NodeDescription& identity, const TpdoMaps& tpdos, std::uint8_t tpdo_type,
               const std::vector<canopen::PdoMap>& rpdos = {canopen::PdoMap{}});

  /// Adds a device object before the first step; little-endian value of 1, 2 or 4 bytes.
  Handle add(canopen::Object object, std::uint8_t size, Access access, std::uint32_t value = 0);
  [[nodiscard]] std::uint32_t value(Handle handle) const noexcept { return entries_[handle].value; }
  void set(Handle handle, std::uint32_t value) noexcept { entries_[handle].value = value; }
  /// Any object by its address; 0 where there is none. For tests and set-up.
  [[nodiscard]] std::uint32_t value(canopen::Object object) const noexcept;
  void replace(canopen::Object object, std::uint32_t value) noexcept;
  /// From its next reset on it has these objects as they are delivered and no others, whatever this kind of node has.
  /// What the kind does not know is a number without effect.
  void become(const std::vector<DeviceObject>& dictionary);
  /// Object 0x1018:04, which a node does not have by itself.
  void set_serial(std::uint32_t serial);
  /// Switched on with this node id instead of the one it was made with; lss::kNoNodeId: with none, so that it is there
  /// for LSS alone. The identifiers of its PDOs follow its id.
  void start_as(std::uint8_t id) noexcept;
  /// Its node id cannot be set by LSS, but is what all these objects say, from its next reset on.
  void keep_id_in(std::vector<canopen::Object> objects) { id_objects_ = std::move(objects); }
  /// As a device without LSS.
  void remove_lss() noexcept { has_lss_ = false; }
  [[nodiscard]] LssNode& lss() noexcept { return lss_; }
  /// As some devices: without this object; refusing every write to it; silent for so long from each reset on.
  void remove(canopen::Object object) noexcept;
  void refuse(canopen::Object object, canopen::SdoAbort abort) noexcept;
  void set_boot_time(Duration time) noexcept { boot_time_ = time; }
  /// Heartbeat or set-points are missed: an operational node with object 0x1029:01 does what that says (CiA 301).
  void communication_error() noexcept;
  /// The device itself has an error that is not over: until then its error register (0x1001) says so.
  void set_error(bool is_there) noexcept { device_error_ = is_there; }

  void receive(const CanFrame& frame, Time now, Outbox& out) noexcept;
  /// Boot-up message, heartbeat, EMCY once where the watched heartbeat is lost and once where no error is left, and the
  /// TPDOs that are due, from the values of this moment.
  void step(Time now, Outbox& out) noexcept;
  void emergency(std::uint16_t code, Outbox& out) noexcept;

  [[nodiscard]] std::uint8_t id() const noexcept { return id_; }
  [[nodiscard]] canopen::NmtState state() const noexcept { return state_; }
  [[nodiscard]] bool operational() const noexcept { return state_ == canopen::NmtState::kOperational; }
  /// Whether this step's values can go out: the moment to sample.
  [[nodiscard]] bool samples_now() const noexcept;
  /// True once after something was written to the objects of this axis, from 0, by PDO or SDO.
  [[nodiscard]] bool take_written_axis(std::size_t axis) noexcept;
  /// True once after this very object was written by SDO.
  [[nodiscard]] bool take_written(canopen::Object object) noexcept;
  /// True once after a reset of node or power-on.
  [[nodiscard]] bool take_reset() noexcept;
  /// The watched producer was heard and has been silent for longer than 0x1016:01 allows.
  [[nodiscard]] bool heartbeat_lost(Time now) const noexcept;
  /// This RPDO, from 0, was heard while operational and has been missing for longer than its timer (0x1400:05) allows.
  [[nodiscard]] bool rpdo_lost(Time now, std::size_t rpdo = 0) const noexcept;

 private:
  static constexpr std::size_t kMapSlots = std::tuple_size_v<decltype(canopen::PdoMap::entries)>;
  static constexpr Handle kDummy = ~Handle{0};  ///< Mapped, but no object of this node: so many bytes of nothing.
  struct Entry {
    canopen::Object object;
    std::uint8_t size = 0;
    Access access = Access::kReadOnly;
    std::uint32_t value = 0, at_power_on = 0;
    canopen::SdoAbort refusal = canopen::SdoAbort::kNone;  ///< Of every write.
  };
  /// Where a PDO's parameters live in the table, and what its map says, resolved.
  struct Pdo {
    Handle cob_id = 0, type = 0, timer = 0, count = 0;  ///< Map entries follow count.
    std::array<Handle, kMapSlots> mapped{};
    std::array<std::size_t, kMapSlots> mapped_bytes{};
    std::size_t length = 0, bytes = 0;
  };
  struct Tpdo {
    Pdo pdo;
    std::uint32_t syncs = 0;
    bool sync_due = false;
    Time sent = kNever;
    CanFrame last;
  };
  struct Rpdo {
    Pdo pdo;
    Time heard = kNever;
  };
  [[nodiscard]] Entry* find(canopen::Object object) noexcept;
  Pdo add_pdo(std::uint16_t parameters, std::uint32_t cob_id, std::uint8_t type, const canopen::PdoMap& map,
              Access map_access = Access::kReadWrite);
  void resolve(Pdo& pdo) noexcept;
  /// To be called when one may have been enabled or disabled.
  void count_tpdos() noexcept;
  [[nodiscard]] bool enabled(const Pdo& pdo) const noexcept;
  /// Whose parameters (0x1800 and up) or map (0x1A00 and up) this is; nullptr where it is neither.
  [[nodiscard]] Tpdo* tpdo_with(std::uint16_t index, std::uint16_t first) noexcept;
  /// Likewise (0x1400, 0x1600).
  [[nodiscard]] Rpdo* rpdo_with(std::uint16_t index, std::uint16_t first) noexcept;
  /// That is on and takes frames under this identifier.
  [[nodiscard]] Rpdo* rpdo_under(std::uint32_t id) noexcept;
  void note_written(canopen::Object object) noexcept;
  void obey(canopen::NmtCommand command) noexcept;
  void hear_lss(const CanFrame& frame, Outbox& out) noexcept;
  /// The one it was given since it was started.
  void take_node_id(bool all) noexcept;
  /// Whatever can be written is kept over a reset from now on.
  void save() noexcept;
  void power_on(std::uint16_t first_index, std::uint16_t last_index) noexcept;
  void serve(const CanFrame& frame, Outbox& out) noexcept;
  [[nodiscard]] canopen::SdoAbort missing(canopen::Object object) const noexcept;
  [[nodiscard]] canopen::SdoAbort write(canopen::Object object, std::uint32_t value, std::uint8_t size) noexcept;
  [[nodiscard]] canopen::SdoAbort check(const Entry& entry, std::uint32_t value) noexcept;
  [[nodiscard]] canopen::SdoAbort check_map(const Pdo& pdo, const Entry& entry, std::uint32_t value) noexcept;
  [[nodiscard]] canopen::SdoAbort check_mapped(std::uint32_t mapping) noexcept;
  void take_rpdo(Rpdo& rpdo, const CanFrame& frame, Time now, Outbox& out) noexcept;
  void hear_sync() noexcept;
  void send(Tpdo& tpdo, Time now, Outbox& out) noexcept;

  std::uint8_t id_;
  std::uint8_t cob_id_of_;  ///< Node id that the identifiers of its PDOs are for.
  LssNode lss_;
  bool has_lss_ = true;
  std::vector<canopen::Object> id_objects_;
  std::vector<Entry> entries_;
  Handle error_register_ = 0, consumer_ = 0, producer_ = 0;
  std::array<Tpdo, kTpdos> tpdos_;
  std::size_t used_tpdos_ = 1;  ///< The first, and all up to the last that is enabled: none else is due.
  std::vector<Rpdo> rpdos_;
  canopen::NmtState state_ = canopen::NmtState::kBootUp;
  Time heartbeat_due_{}, producer_heard_ = kNever;
  std::array<bool, 8> written_{};  // axes
  bool reset_ = true, loss_told_ = false, device_error_ = false;
  Duration boot_time_{};
  Time boots_since_ = kNever;
  canopen::Object last_written_;
};

/// What the machine is doing, as ideal sensors would say.
struct MachineSignals {
  JointVector spool = JointVector::Zero();  ///< Actual, fraction of stroke.
  std::array<double, 6> pressure_Pa{};      ///< boom A, B, arm A, B, bucket A, B
  JointVector cylinder_m = JointVector::Zero(), cylinder_mps = JointVector::Zero();
  double slope_rad = 0;                         ///< At the tilt sensor.
  JointVector shaft_rad = JointVector::Zero();  ///< Joint angles, as rotary encoders' shafts turn with them.
  JointVector lever_m = JointVector::Zero();    ///< Of the cylinders on their joints.
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
  double rotary_lever_m = 1;  ///< Of a rotary encoder both are seen at this lever.
  double tilt_offset_rad = 0, tilt_noise_rad = 0;
};

enum class NodeFault : std::uint8_t {
  kNone,
  kSilent,      ///< Its cable is off: it neither sends nor hears, and its own watchdogs run out.
  kFrozen,      ///< Goes on sending its last values.
  kInvalid,     ///< Sends the impossible value devices have for "broken" (largest integer; pressure status bit); the
                ///< wire of a module's first input is broken.
  kSpike,       ///< One PDO far off, then well again.
  kBrokenWire,  ///< Encoder: the wire snaps and winds back at 1.5 m/s; a rotary one breaks off and turns at 5 rad/s.
  kStuck,       ///< Valve: the spool stays where it is as long as there is pilot pressure.
  kDeadGuard,   ///< Valve, enable node or module: it misses neither set-points nor heartbeat.
};

/// CiA 408 proportional valve with one or several axes. An injected fault is the whole node's, an axis that misses its
/// set-points alone in fault.
class ValveNode {
 public:
  static constexpr std::size_t kMostAxes = NodeDescription::kMostPdos;
  /// Of all axes up to the last that is named. As delivered its PDOs carry the first alone.
  explicit ValveNode(const NodeDescription& identity, double full_stroke = canopen::kFullStroke);
  using Spools = std::array<double, kMostAxes>;
  void step(Time now, const Spools& spools, Outbox& out) noexcept;
  /// Zero unless operational, ACTIVE, without fault and set from the bus. @param axis from 0
  [[nodiscard]] double demand(std::size_t axis) const noexcept { return axes_[axis].demand; }
  [[nodiscard]] NodeProtocol& protocol() noexcept { return protocol_; }
  void inject(NodeFault fault, const Spools& spools) noexcept {
    fault_ = fault;
    stuck_at_ = spools;
  }

 private:
  struct Axis {
    NodeProtocol::Handle control = 0, status = 0, mode = 0, set_point = 0, actual = 0;
    canopen::ValveState state = canopen::ValveState::kInit;
    bool faulted = false, reset_bit = false;
    std::uint32_t last_word = 0;  ///< kPved
    double demand = 0;
  };
  void obey_control_word(Axis& axis) noexcept;
  static void obey_pved(Axis& axis, std::uint32_t word) noexcept;
  void watch(Time now, Outbox& out) noexcept;
  void put(Axis& axis, double spool) noexcept;

  ValveProfile profile_;
  NodeProtocol protocol_;
  std::vector<Axis> axes_;
  double full_stroke_;
  Spools stuck_at_{};
  NodeFault fault_ = NodeFault::kNone;
};

/// Pressure transmitter of one or more channels, wire or rotary encoder, or tilt sensor. A fault is the whole node's.
class SensorNode {
 public:
  struct Sample {
    double value = 0, rate = 0;  ///< Pa, m and m/s, or rad, sensor errors included; rate for wire encoders only.
  };
  enum class Kind : std::uint8_t { kPressure, kEncoder, kRotary, kTilt };
  static constexpr std::size_t kMostChannels = 8;
  /// @param resolution smallest difference the sensor itself can tell, in SI.
  /// @param channels of a pressure transmitter: its objects have sub-indices 1 to so many. As delivered it sends the
  /// first channel alone.
  SensorNode(Kind kind, const NodeDescription& identity, double resolution, double range,
             const WireDescription& wire = {}, unsigned channels = 1);
  /// @param samples one a channel.
  void step(Time now, std::span<const Sample> samples, Outbox& out) noexcept;
  void step(Time now, const Sample& sample, Outbox& out) noexcept { step(now, {&sample, 1}, out); }
  [[nodiscard]] NodeProtocol& protocol() noexcept { return protocol_; }
  [[nodiscard]] bool is_rotary() const noexcept { return kind_ == Kind::kRotary; }
  void inject(NodeFault fault, Time now) noexcept;

 private:
  using Handle = NodeProtocol::Handle;
  struct PressureChannel {
    Handle value = 0, short_value = 0, float_value = 0, status = 0, digits = 0;
  };
  [[nodiscard]] bool is_encoder() const noexcept { return kind_ == Kind::kEncoder || is_rotary(); }
  void add_pressure(std::uint8_t channel, const WireDescription& wire);
  void put(std::size_t channel, const Sample& sample) noexcept;
  void put_pressure(const PressureChannel& channel, double pressure_Pa) noexcept;
  void put_encoder(const Sample& sample) noexcept;
  void put_rotary(double shaft_rad) noexcept;
  void obey_preset() noexcept;
  void put_tilt(double slope_rad) noexcept;
  void put_invalid() noexcept;
  [[nodiscard]] Sample disturbed(const Sample& sample, Time now) const noexcept;

  Kind kind_;
  double resolution_, range_;
  RotaryDescription rotary_;  ///< How it is mounted.
  NodeProtocol protocol_;
  std::vector<PressureChannel> pressures_;
  std::array<Handle, 4> objects_{};  ///< Of the others: value, second value, and the two step objects of the kind.
  Handle preset_ = 0, offset_ = 0;   ///< Of an encoder.
  NodeFault fault_ = NodeFault::kNone;
  Time fault_at_ = kNever;
};

/// CiA 401 machine enable: gives pilot pressure, and takes it away by itself.
class EnableNode {
 public:
  explicit EnableNode(const BusDescription& bus);
  /// Every frame on the bus: it compares the valves' set-points with their actual positions, where they tell these.
  void observe(const CanFrame& frame) noexcept;
  void step(Time now, Outbox& out) noexcept;
  [[nodiscard]] bool pilot() const noexcept { return pilot_; }
  [[nodiscard]] const NodeProtocol& protocol() const noexcept { return protocol_; }
  [[nodiscard]] NodeProtocol& protocol() noexcept { return protocol_; }
  void set_estop(bool pressed) noexcept { estop_ = pressed; }
  /// A plain output module: what it took away is there again as soon as the cause is gone.
  void set_plain() noexcept { latches_ = false; }
  void inject(NodeFault fault) noexcept { fault_ = fault; }

 private:
  static constexpr std::size_t kDemands = 8;
  [[nodiscard]] bool following(Time now) noexcept;
  [[nodiscard]] bool allowed(Time now, Outbox& out) noexcept;

  NodeProtocol protocol_;
  NodeProtocol::Handle inputs_, outputs_;
  static constexpr std::uint32_t kNoId = ~0U;
  PerJoint<std::uint32_t> set_point_ids_{kNoId, kNoId, kNoId}, spool_ids_ = set_point_ids_;
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
  bool latches_ = true;
  NodeFault fault_ = NodeFault::kNone;
};

/// CiA 401 module with analogue inputs, outputs or both. As delivered it sends no inputs, and its error values are 0.
class ModuleNode {
 public:
  ModuleNode(const NodeDescription& node, const BusDescription& bus);
  /// What its inputs say, by frames. Each has a sensor on it.
  [[nodiscard]] const std::vector<BroadcastFrame>& inputs() const noexcept { return inputs_; }
  void sense(const BroadcastFrame& frame, const BroadcastField& field, double value) noexcept;
  void step(Time now, Outbox& out) noexcept;
  [[nodiscard]] std::size_t output_frames() const noexcept { return outputs_.size(); }
  /// What its outputs do now, as the frame would say it that tells them so; neutral until it was first started.
  [[nodiscard]] CanFrame output_frame(std::size_t which) const noexcept;
  [[nodiscard]] NodeProtocol& protocol() noexcept { return protocol_; }
  /// False where it cannot have this fault.
  bool inject(NodeFault fault) noexcept;

 private:
  struct Output {
    NodeProtocol::Handle value = 0, mode = 0, error = 0;
    std::uint32_t now = 0;
  };
  NodeProtocol protocol_;
  std::uint8_t error_value_shift_;
  std::vector<BroadcastFrame> inputs_;
  std::vector<CommandFrame> outputs_;
  NodeProtocol::Handle sends_ = 0;
  std::vector<NodeProtocol::Handle> read_;
  std::vector<Output> told_;
  bool started_ = false, missed_ = false;
  NodeFault fault_ = NodeFault::kNone;
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
  /// Of a frame that the machine sends by itself. @param frame place in BusDescription::broadcasts @param signals as
  /// BroadcastFaults::inject() has them.
  void inject_broadcast(std::size_t frame, BroadcastFault fault, std::uint64_t signals) noexcept {
    broadcast_faults_.inject(frame, fault, signals);
  }
  /// Of a pilot valve; false where frames tell the machine nothing.
  bool inject_pilot(int joint, bool extend, PilotFault fault) noexcept;
  bool send_emcy(std::uint8_t node, std::uint16_t code) noexcept;
  /// The node answers with another identity from its next start on.
  bool set_product(std::uint8_t node, std::uint32_t product) noexcept;
  void set_estop(bool pressed) noexcept;
  /// Edges of the valves, as the makers of the machine's own controller measured them.
  void measured(const PerJoint<ValveRoughness>& valves) noexcept;
  void set_plain_enable() noexcept { enable_.set_plain(); }
  /// This packet of each message of several is not sent; 0: all are.
  void lose_packet(std::uint8_t number) noexcept { packets_.lose(number); }
  /// nullptr where there is none.
  [[nodiscard]] NodeProtocol* node(std::uint8_t id) noexcept;

 private:
  [[nodiscard]] double noise(double sigma) noexcept { return sigma > 0 ? sigma * normal_(random_) : 0.0; }
  void hear(Time now) noexcept;
  void hear_request(const CanFrame& frame, Time now) noexcept;
  [[nodiscard]] double sensed(const SignalInfo& signal, const MachineSignals& signals) const noexcept;
  [[nodiscard]] std::uint64_t raw_status(const BroadcastField& field) const noexcept;
  void write(const BroadcastField& field, const MachineSignals& signals, CanFrame& frame) noexcept;
  void send_in_packets(std::size_t broadcast, const MachineSignals& signals) noexcept;
  [[nodiscard]] double noise_of(const SignalInfo& signal) noexcept;
  void step_sensors(const MachineSignals& signals) noexcept;
  void step_broadcasts(const MachineSignals& signals) noexcept;
  void step_modules(const MachineSignals& signals) noexcept;
  template <typename Node, typename... Arguments>
  void step_node(std::size_t index, Node& node, const Arguments&... arguments) noexcept;
  [[nodiscard]] ValveNode::Spools spools_of(std::size_t valve) const noexcept;
  /// Place in all_: valves, pressures, encoders, tilt, enable, modules; its size where there is none.
  [[nodiscard]] std::size_t index_of(std::uint8_t id) const noexcept;

  CanBus& port_;
  SensorErrors errors_;
  std::mt19937_64 random_;
  std::normal_distribution<> normal_;
  std::vector<ValveNode> valves_;
  std::vector<SensorNode> pressures_;
  std::vector<std::vector<NodeChannel>> valve_channels_, pressure_channels_;  // of each
  std::vector<SensorNode> encoders_, tilts_;  // of what the machine does not send by itself
  std::vector<NodeChannel> encoder_signals_;
  NodeChannel tilt_signal_;
  EnableNode enable_;
  std::vector<ModuleNode> modules_;
  std::optional<OwnController> own_;  // of a machine that is told by frames; pilot valves behind modules, too
  bool estop_ = false;
  std::vector<BroadcastFrame> broadcasts_;
  std::vector<Time> broadcast_due_;
  std::vector<std::uint64_t> broadcast_count_;  // of the first of each identifier
  BroadcastFaults broadcast_faults_;
  PacketSender packets_;
  std::vector<std::size_t> packets_of_;  // place there, of those of several packets
  std::vector<NodeProtocol*> all_;       // sized once, at construction, as the next
  std::vector<char> silent_;
  std::size_t first_pressure_ = 0, first_encoder_ = 0, first_tilt_ = 0, enable_at_ = 0;
  Outbox out_;
  Time now_{};
  JointVector spool_ = JointVector::Zero();
};

}  // namespace knuckle::sim
