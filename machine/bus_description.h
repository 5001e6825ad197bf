// The machine's CAN bus as the machine file says: nodes, rates, time limits. Plain data in SI units, no behaviour.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/joints.h"
#include "core/units.h"
#include "transport/frame_checksum.h"
#include "transport/signal_codec.h"

namespace knuckle {

/// Device profile of CiA: 408, 404, 406, 410, 401, and 401 again: a module with analogue inputs, outputs or both.
/// kReading: no node's, and nothing that moves the machine or stops it: people are told it. kPilot: no node's: the
/// pressure that moves a spool, where the machine or a module's input measures it.
enum class NodeRole : std::uint8_t { kValve, kPressure, kEncoder, kTilt, kEnable, kReading, kModule, kPilot };

/// A value that Knuckle needs from the machine, or tells it. What a node's channel is.
struct SignalInfo {
  const char* name;  ///< As machine files call it.
  const char* node;  ///< What its node is called where the file has [bus.nodes], and in scenarios.
  NodeRole role;     ///< Of the nodes that can have it.
  int index;  ///< Joint; of a pressure 2 joint for the head side, 2 joint + 1 for the rod side; of a reading its place;
              ///< of a pilot pressure 2 joint for what extends, 2 joint + 1 for what retracts.
  bool is_angle = false;  ///< Of an encoder: of the joint, in place of its cylinder's length.
};
/// All are needed, but of each joint's length and angle one, and no is_optional(); valves and enable only where no
/// CommandFrame tells the joints what to do: then there is no valve. A node's place in BusDescription::nodes is that of
/// its first signal here. Reasons in recordings and on the link name a signal by its place: new ones go to the end.
inline constexpr std::array kSignals{SignalInfo{"boom_spool", "boom_valve", NodeRole::kValve, 0},
                                     SignalInfo{"arm_spool", "arm_valve", NodeRole::kValve, 1},
                                     SignalInfo{"bucket_spool", "bucket_valve", NodeRole::kValve, 2},
                                     SignalInfo{"boom_head_pressure", "boom_head_pressure", NodeRole::kPressure, 0},
                                     SignalInfo{"boom_rod_pressure", "boom_rod_pressure", NodeRole::kPressure, 1},
                                     SignalInfo{"arm_head_pressure", "arm_head_pressure", NodeRole::kPressure, 2},
                                     SignalInfo{"arm_rod_pressure", "arm_rod_pressure", NodeRole::kPressure, 3},
                                     SignalInfo{"bucket_head_pressure", "bucket_head_pressure", NodeRole::kPressure, 4},
                                     SignalInfo{"bucket_rod_pressure", "bucket_rod_pressure", NodeRole::kPressure, 5},
                                     SignalInfo{"boom_length", "boom_encoder", NodeRole::kEncoder, 0},
                                     SignalInfo{"boom_angle", "boom_encoder", NodeRole::kEncoder, 0, true},
                                     SignalInfo{"arm_length", "arm_encoder", NodeRole::kEncoder, 1},
                                     SignalInfo{"arm_angle", "arm_encoder", NodeRole::kEncoder, 1, true},
                                     SignalInfo{"bucket_length", "bucket_encoder", NodeRole::kEncoder, 2},
                                     SignalInfo{"bucket_angle", "bucket_encoder", NodeRole::kEncoder, 2, true},
                                     SignalInfo{"slope", "tilt", NodeRole::kTilt, 0},
                                     SignalInfo{"machine_enable", "enable", NodeRole::kEnable, 0},
                                     // What the enable node's inputs say, of a machine that sends it by itself.
                                     SignalInfo{"e_stop_closed", "e_stop_closed", NodeRole::kEnable, 1},
                                     SignalInfo{"pilot_on", "pilot_on", NodeRole::kEnable, 2},
                                     // In the order of MachineReadings (transport/machine_readings.h).
                                     SignalInfo{"engine_speed", "engine_speed", NodeRole::kReading, 0},
                                     SignalInfo{"engine_running", "engine_running", NodeRole::kReading, 1},
                                     SignalInfo{"oil_temperature", "oil_temperature", NodeRole::kReading, 2},
                                     SignalInfo{"coolant_temperature", "coolant_temperature", NodeRole::kReading, 3},
                                     SignalInfo{"engine_hours", "engine_hours", NodeRole::kReading, 4},
                                     SignalInfo{"battery_voltage", "battery_voltage", NodeRole::kReading, 5},
                                     SignalInfo{"fuel_level", "fuel_level", NodeRole::kReading, 6},
                                     SignalInfo{"boom_extend_pilot", "boom_extend_pilot", NodeRole::kPilot, 0},
                                     SignalInfo{"boom_retract_pilot", "boom_retract_pilot", NodeRole::kPilot, 1},
                                     SignalInfo{"arm_extend_pilot", "arm_extend_pilot", NodeRole::kPilot, 2},
                                     SignalInfo{"arm_retract_pilot", "arm_retract_pilot", NodeRole::kPilot, 3},
                                     SignalInfo{"bucket_extend_pilot", "bucket_extend_pilot", NodeRole::kPilot, 4},
                                     SignalInfo{"bucket_retract_pilot", "bucket_retract_pilot", NodeRole::kPilot, 5}};
inline constexpr int kEStopClosedIndex = 1, kPilotOnIndex = 2;  ///< SignalInfo::index of NodeRole::kEnable.
inline constexpr int kEngineRunningIndex = 1;                   ///< Of NodeRole::kReading.
/// Whether a machine may send it by itself, and does not need it: SignalInfo::index 1 or 2 of NodeRole::kEnable.
[[nodiscard]] constexpr bool is_status(const SignalInfo& signal) noexcept {
  return signal.role == NodeRole::kEnable && signal.index > 0;
}
[[nodiscard]] constexpr bool is_optional(const SignalInfo& signal) noexcept {
  return is_status(signal) || signal.role == NodeRole::kReading || signal.role == NodeRole::kPilot;
}
/// Its raw value says yes or no.
[[nodiscard]] constexpr bool is_yes_or_no(const SignalInfo& signal) noexcept {
  return is_status(signal) || (signal.role == NodeRole::kReading && signal.index == kEngineRunningIndex);
}

/// How a device of CiA 408 is led through its states.
enum class ValveProfile : std::uint8_t {
  kCia408,
  kPved,  ///< Danfoss PVED-CC: bit 3 of the control word on in every state, off and on to leave a fault; slow to boot.
};
/// As machine files call them, in the order of ValveProfile.
inline constexpr std::array kValveProfileNames{"cia408", "cia408/pved"};

/// A part of a device that has a value of its own: a sub-index of the profile's objects, from 1; of a valve the axis,
/// which has objects of its own (canopen::of_axis()); of a tilt sensor 1 for 0x6010 and 2 for 0x6020.
struct NodeChannel {
  std::uint8_t number = 1;
  std::uint8_t signal = 0;  ///< Place in kSignals.
  [[nodiscard]] constexpr const SignalInfo& info() const noexcept { return kSignals[signal]; }
  /// Of what is told what to do: its receive PDO, and a valve's transmit PDO, from 0. CiA 301 keeps PDO 65 (0x1440) and
  /// on for the second device in a module, but has no identifiers for them; CAN drivers of several axes that are sold
  /// have the four PDOs of the pre-defined connection set in a row, and so axis k has the k-th.
  [[nodiscard]] constexpr std::uint8_t pdo() const noexcept { return static_cast<std::uint8_t>(number - 1U); }
  bool operator==(const NodeChannel&) const = default;
};

/// What commissioning has seen of a node's guard: what ends its motion when the controller falls silent.
struct GuardProof {
  bool proved = false;
  std::uint32_t serial = 0;  ///< Of the device it was seen of; 0 where that has none.
  std::string date;          ///< Empty where it was never tried.
  /// What is not as it was then: a proof holds of what was tried alone.
  enum class Changed : std::uint8_t { kNothing, kDevice, kChannels, kTimes, kNotRecorded } changed = Changed::kNothing;
  bool operator==(const GuardProof&) const = default;
};

/// How a rotary encoder (CiA 406) is mounted on its joint: angle = zero_rad + sign * steps * step_rad(), but for whole
/// turns.
struct RotaryDescription {
  std::uint32_t steps_per_turn = 0;  ///< 0x6001
  std::uint32_t turns = 1;           ///< Until it begins again at 0: 0x6002 by 0x6001.
  int sign = 1;                      ///< 1: counts up with the joint's angle; or -1.
  double zero_rad = 0;               ///< The joint's angle where it counts 0.
  [[nodiscard]] double step_rad() const noexcept { return 2 * std::numbers::pi / steps_per_turn; }
  /// All that it counts: 0x6002.
  [[nodiscard]] std::uint32_t range() const noexcept { return steps_per_turn * turns; }
  bool operator==(const RotaryDescription&) const = default;
};

/// A device on the bus: what it is called, what its channels are, the identity it must show (objects 0x1000 and
/// 0x1018:01, :02) before anything moves, and what its process data are sent under.
struct NodeDescription {
  static constexpr std::size_t kMostPdos = 4;  ///< As the pre-defined connection set has.
  std::string name;                            ///< Also in scenarios, options and reports.
  NodeRole role = NodeRole::kValve;
  std::vector<NodeChannel> channels;  ///< By number. None of a module: frames have what goes through it.
  std::uint8_t id = 0;
  std::uint32_t device_type = 0, vendor = 0, product = 0;
  ValveProfile profile = ValveProfile::kCia408;           ///< Of a valve.
  RotaryDescription rotary;                               ///< Of an encoder that measures_angle().
  std::array<std::uint16_t, kMostPdos> tpdos{}, rpdos{};  ///< COB-IDs of its PDOs; 0: pre-defined connection set.
  /// What its transmit PDOs map, of a sensor that lets nobody change it: 0x61300120 is 32 bits of 0x6130:01. Else
  /// empty.
  std::vector<std::vector<std::uint32_t>> tpdo_maps;
  std::string unguarded;  ///< Of a node that is told to move something: why it may do without a guard. Else empty.
  GuardProof guard;
  std::uint8_t outputs = 0;  ///< Of a module: how many analogue ones, all that it has.
  /// Of a module: where 0x6444 has the 16 bits of an output, 0 or 16.
  std::uint8_t error_value_shift = 0;
  /// Whether it is told what to do, so that it needs a guard.
  [[nodiscard]] constexpr bool is_told() const noexcept {
    return role == NodeRole::kValve || role == NodeRole::kEnable || outputs > 0;
  }
  [[nodiscard]] constexpr std::uint32_t tpdo_id(std::size_t pdo = 0) const noexcept { return id_of(tpdos, 0x180, pdo); }
  [[nodiscard]] constexpr std::uint32_t rpdo_id(std::size_t pdo = 0) const noexcept { return id_of(rpdos, 0x200, pdo); }
  [[nodiscard]] bool measures_angle() const noexcept { return !channels.empty() && channels.front().info().is_angle; }
  /// Joint of its first channel; -1 of a node that is the whole machine's, or of several joints.
  [[nodiscard]] int joint() const noexcept;
  bool operator==(const NodeDescription&) const = default;

 private:
  [[nodiscard]] constexpr std::uint32_t id_of(const std::array<std::uint16_t, kMostPdos>& own, std::uint32_t first,
                                              std::size_t pdo) const noexcept {
    if (pdo < kMostPdos && own[pdo] != 0) return own[pdo];
    return first + 0x100U * static_cast<std::uint32_t>(pdo) + id;
  }
};

/// "1 = boom_spool, 2 = arm_spool"
[[nodiscard]] std::string channels_text(const NodeDescription& node);

/// How a sensor on an analogue input says its value: by that a broken wire is known, or not.
struct AnalogSensor {
  enum class Range : std::uint8_t {
    k4To20mA,
    kHalfTo4AndAHalfV,  ///< Ratiometric, of 5 V.
    k0To10V             ///< A broken wire reads as 0 V, as its lowest value does.
  } range = Range::k4To20mA;
  double low = 0, high = 0;  ///< SI, at the ends of the range; high is below low where the sensor counts down.
  /// What it says with a broken wire, 0 mA or 0 V.
  [[nodiscard]] double broken() const noexcept;
  /// Whether no sound sensor and wire can say this: below 3.6 mA or 0.25 V, above 21 mA or 4.75 V (as NAMUR NE 43).
  [[nodiscard]] bool is_broken(double value) const noexcept;
  bool operator==(const AnalogSensor&) const = default;
};
/// As machine files call them, in the order of AnalogSensor::Range.
inline constexpr std::array kAnalogRangeNames{"4-20mA", "0.5-4.5V", "0-10V"};

/// A module's analogue input or output, from 1, in a process data object: CiA 401 has four a frame, from the second
/// frame on.
inline constexpr std::uint8_t kAnalogsPerFrame = 4, kMostAnalogs = 12, kAnalogBits = 16;
[[nodiscard]] constexpr std::uint8_t analog_pdo(unsigned number) noexcept {
  return static_cast<std::uint8_t>(1 + (number - 1) / kAnalogsPerFrame);
}
[[nodiscard]] constexpr std::uint8_t analog_start_bit(unsigned number) noexcept {
  return static_cast<std::uint8_t>((number - 1) % kAnalogsPerFrame * kAnalogBits);
}
[[nodiscard]] constexpr unsigned analog_number(std::uint8_t pdo, const BitField& bits) noexcept {
  return (pdo - 1U) * kAnalogsPerFrame + bits.start_bit / kAnalogBits + 1U;
}

/// A value in a frame that the machine sends by itself.
struct BroadcastField {
  std::uint8_t signal = 0;  ///< Place in kSignals.
  BitField bits;            ///< To SI; of an angle or slope with sign and zero of its installation.
  /// Raw values from here on say that there is none: 0xFB of 8 bits, 0xFB00 of 16 in J1939.
  std::optional<std::uint64_t> invalid_from{};
  std::uint64_t on = 1;                  ///< Of is_yes_or_no(): the raw value that says yes.
  std::optional<AnalogSensor> analog{};  ///< Of a module's input.
  /// Of a message of several packets: the byte from which on bits are counted.
  std::uint8_t first_byte = 0;
  // Of a pilot pressure [Pa]: up to where the spool stays shut, and from where on it is at its full stroke.
  double shut_Pa = 0, full_Pa = 0;
  [[nodiscard]] constexpr const SignalInfo& info() const noexcept { return kSignals[signal]; }
  /// What these bits say; nothing where there are none, or they say that there is no value or that a wire is broken.
  [[nodiscard]] std::optional<double> value(std::optional<std::uint64_t> raw) const noexcept;
  bool operator==(const BroadcastField&) const = default;
};

/// Which of the frames under one identifier: those in which these bits have this raw value.
struct Multiplexer {
  BitField bits;
  std::uint64_t value = 0;
  bool operator==(const Multiplexer&) const = default;
};

/// A frame that the machine's own controller sends: nobody starts its sender, but it must keep coming. Or what a
/// module's inputs say, with each SYNC.
struct BroadcastFrame {
  std::string name;
  std::uint32_t id = 0;  ///< With kExtendedId where it has 29 bits, with kSecondBus where it is on that.
  /// Bits of an identifier that it is known by: of a J1939 parameter group neither priority nor addresses.
  std::uint32_t mask = CanFilter::kWhole;
  std::optional<std::uint8_t> source{};  ///< Of a group: the only address whose values count. Else the first heard.
  /// Above 8: a message of several packets, a group's alone.
  std::uint8_t bytes = 8;
  double period_s = 0;
  std::optional<Multiplexer> multiplexer{};
  bool on_request = false;  ///< Of a group: it is asked for once a period, and need not come by itself.
  std::vector<BroadcastField> fields{};
  FrameClosing closing{};   ///< Where it has a counter or a checksum.
  std::uint8_t module = 0;  ///< Id of the node that sends it; 0: the machine's own controller does.
  std::uint8_t pdo = 0;     ///< Which of its transmit PDOs, from 0.
  [[nodiscard]] constexpr CanFilter filter() const noexcept { return {id, mask}; }
  [[nodiscard]] constexpr bool is_group() const noexcept { return mask != CanFilter::kWhole; }
  /// Whether it is for people alone.
  [[nodiscard]] bool only_readings() const noexcept;
  /// Whether a frame of this identifier is this one.
  [[nodiscard]] bool is_in(const CanFrame& frame) const noexcept {
    return !multiplexer || read_raw(multiplexer->bits, frame) == multiplexer->value;
  }
  bool operator==(const BroadcastFrame&) const = default;
};

/// How the joints are told what to do.
enum class CommandKind : std::uint8_t {
  kSpool,          ///< CANopen valves, which tell where their spools are.
  kPilotPressure,  ///< By frames of the machine's own bus: the pressure that moves a spool. Nobody tells where it is.
  kCurrent,        ///< Likewise the current of the magnet that makes that pressure.
  kVoltage,        ///< Likewise the voltage that a valve's electronics make it from.
  kFlow,           ///< Likewise the flow through the valve, as a share of its most.
  kJointRate,      ///< Likewise the joint's speed: the machine's own controller moves the spool.
};

/// Where a field says how far and not which way: the bits beside it that say that, by raw values.
struct CommandDirection {
  BitField bits;
  std::uint64_t neutral = 0, extend = 0, retract = 0;
  bool operator==(const CommandDirection&) const = default;
};

/// A value in a frame that the machine's own controller is told what to do by. SI by its unit in the file: Pa, A, V,
/// rad/s, a share; of a constant as the file has it.
struct CommandField {
  std::string name;
  BitField bits;
  double neutral = 0;                         ///< Nothing moves by it. What is not used is sent as this.
  double led = 0;                             ///< Of a constant: its value while an operator leads the machine.
  std::optional<int> joint{};                 ///< The one that it moves; else it is a constant.
  std::optional<double> extend{}, retract{};  ///< Values at the full command; neutral where there is none.
  std::optional<CommandDirection> direction{};
  /// @param command [-1, 1], positive extends the joint's cylinder; of a constant anything.
  [[nodiscard]] double value(double command, bool is_led) const noexcept {
    if (!joint) return is_led ? led : neutral;
    const double full = (command > 0 ? extend : retract).value_or(neutral);
    return neutral + std::abs(command) * (full - neutral);
  }
  bool operator==(const CommandField&) const = default;
};

/// A frame that tells the machine's own controller, or a module's outputs, what to do. When they stop, it ends all
/// motion by itself.
struct CommandFrame {
  std::string name;
  std::uint32_t id = 0;  ///< With kExtendedId where it has 29 bits, with kSecondBus where it is on that.
  /// Bits by which another sender's is known: where it goes out from BusDescription::j1939_address, whatever its
  /// priority and source.
  std::uint32_t mask = CanFilter::kWhole;
  std::uint8_t bytes = 8;
  double period_s = 0;
  bool always = true;  ///< Also while nobody leads the machine.
  std::vector<CommandField> fields{};
  FrameClosing closing{};
  std::uint8_t module = 0;  ///< Id of the node that it is for; 0: the machine's own controller.
  std::uint8_t pdo = 0;     ///< Which of its receive PDOs, from 0.
  [[nodiscard]] constexpr CanFilter filter() const noexcept { return {id, mask}; }
  bool operator==(const CommandFrame&) const = default;
};

[[nodiscard]] bool moves_joint(const CommandFrame& frame) noexcept;

/// How values are written on the wire where devices differ.
struct WireDescription {
  double valve_full_stroke = 16384;  ///< Set-point and actual value (CiA 408) at 100 % of spool stroke.
  /// Of a pressure: object 0x9130, 0x6130 in bar, or 0x7130.
  enum class Pressure : std::uint8_t { kInteger, kFloat, kInteger16 } pressure = Pressure::kInteger;
  int pressure_digits = 2;               ///< Of an integer, in bar (0x6132).
  double encoder_speed_step_mps = 1e-4;  ///< 0x6005:02
  [[nodiscard]] double pressure_unit_Pa() const noexcept {
    return pressure == Pressure::kFloat ? kBar : kBar / std::pow(10, pressure_digits);
  }
  bool operator==(const WireDescription&) const = default;
};

/// What each bus has of its own.
struct BusLine {
  std::string name;  ///< In options, reasons and scenarios; may be empty where there is one bus.
  std::uint32_t bit_rate = 500000;
  double foreign_load = 0;  ///< Share of its time that frames take which the file does not have.
  bool operator==(const BusLine&) const = default;
};

/// The machine's bus: its CANopen nodes, and frames from and to a controller that the machine has by itself.
struct BusDescription {
  static constexpr int kEnableEveryNthSync = 10;  ///< The enable output is repeated: 20 Hz.
  // As BusLine says: of the first bus, on which all nodes are.
  std::string name;
  std::uint32_t bit_rate = 500000;
  double foreign_load = 0;
  std::optional<BusLine> second;  ///< Where there are two: frames with kSecondBus are on it.
  double sync_Hz = 200;           ///< The slave loop's rate.
  int set_point_every_nth_sync = 1, valve_status_every_nth_sync = 4, tilt_every_nth_sync = 2;
  double controller_heartbeat_s = 0.05;
  double node_heartbeat_s = 0.1;  ///< What nodes are told to produce.
  double node_heartbeat_timeout_s = 0.25;
  /// After so long without set-points a valve closes by itself: RPDO event timer of the valve nodes, or what the
  /// machine's own controller waits for command frames.
  double valve_watchdog_s = 0.05;
  double controller_timeout_s = 0.15;  ///< Consumer time of the nodes for the controller's heartbeat.
  double sensor_age_limit_s = 0.025;
  // Patience of the start-up.
  double sdo_timeout_s = 0.25;      ///< For an SDO answer; asked twice.
  double boot_timeout_s = 1;        ///< Boot-up message after a reset; some nodes calibrate first.
  double start_timeout_s = 1;       ///< "Operational" after NMT start.
  double activate_timeout_s = 0.5;  ///< Valves ACTIVE after the control words.
  std::uint8_t controller_id = 1;
  std::optional<std::uint8_t> j1939_address{};  ///< That Knuckle claims, to ask for groups or command from it.
  WireDescription wire;
  std::vector<NodeDescription> nodes;  ///< In the order of kSignals.
  std::vector<BroadcastFrame> broadcasts;
  std::vector<CommandFrame> commands;  ///< Empty: valves are nodes.
  CommandKind command_kind = CommandKind::kSpool;
  GuardProof commands_guard;  ///< That the machine's own controller ends all motion when command frames stop.

  // The one that has this signal; of no id where it is none's: a broadcast, or a command.
  [[nodiscard]] const NodeDescription& node_of(NodeRole role, int index) const noexcept;
  [[nodiscard]] const NodeDescription& valve(std::integral auto joint) const noexcept {
    return node_of(NodeRole::kValve, static_cast<int>(joint));
  }
  /// @param chamber boom A, B, arm A, B, bucket A, B
  [[nodiscard]] const NodeDescription& pressure(std::integral auto chamber) const noexcept {
    return node_of(NodeRole::kPressure, static_cast<int>(chamber));
  }
  [[nodiscard]] const NodeDescription& encoder(std::integral auto joint) const noexcept {
    return node_of(NodeRole::kEncoder, static_cast<int>(joint));
  }
  [[nodiscard]] const NodeDescription& tilt() const noexcept { return node_of(NodeRole::kTilt, 0); }
  [[nodiscard]] const NodeDescription& enable() const noexcept { return node_of(NodeRole::kEnable, 0); }
  [[nodiscard]] bool has_enable() const noexcept { return enable().id != 0; }
  // Identifiers of the frames of a joint's valve: what it is told (by a command frame, what extends it), and its status
  // with the spool's position.
  [[nodiscard]] std::uint32_t set_point_id(std::integral auto joint) const noexcept {
    if (!commands.empty()) return command_id(static_cast<int>(joint));
    return valve(joint).rpdo_id(valve_channel(static_cast<int>(joint)).pdo());
  }
  [[nodiscard]] std::uint32_t spool_id(std::integral auto joint) const noexcept {
    return valve(joint).tpdo_id(valve_channel(static_cast<int>(joint)).pdo());
  }
  /// Which axis of valve(joint) it is.
  [[nodiscard]] NodeChannel valve_channel(int joint) const noexcept;

  /// The value that moves a joint this way; null where its valve is a node.
  [[nodiscard]] const CommandField* command(int joint, bool extend) const noexcept;
  /// Of CommandKind::kJointRate: the joint's speed at the full command [rad/s]; else 0.
  [[nodiscard]] double full_rate_radps(int joint, bool extend) const noexcept;

  /// The frame that the machine sends this signal in by itself, and where; nulls where it is a node's.
  struct Broadcast {
    const BroadcastFrame* frame = nullptr;
    const BroadcastField* field = nullptr;
  };
  [[nodiscard]] Broadcast broadcast(NodeRole role, int index) const noexcept;
  /// Whether a joint's encoder measures its angle, and not its cylinder's length.
  [[nodiscard]] bool measures_angle(int joint) const noexcept;

  /// The node of this name, else the one that has the signal of this name or SignalInfo::node, or of this id; null
  /// where there is none.
  [[nodiscard]] const NodeDescription* find(const std::string& name) const noexcept;
  [[nodiscard]] const NodeDescription* find(std::uint8_t id) const noexcept;
  /// "boom_valve, arm_valve, ...": for the line that refuses another name.
  [[nodiscard]] std::string node_names() const;
  /// Whether nobody needs SYNC, heartbeat or NMT.
  [[nodiscard]] bool without_nodes() const noexcept { return nodes.empty(); }
  /// Whether the machine's own controller or a module's outputs are told what to do, and no valve node.
  [[nodiscard]] bool by_frames() const noexcept { return !commands.empty(); }
  /// kSecondBus where j1939_address is claimed on that: the bus of the frames that are sent from it.
  [[nodiscard]] std::uint32_t j1939_line() const noexcept;
  /// Whether command frames go out from j1939_address.
  [[nodiscard]] bool commands_by_address() const noexcept;
  /// The longest period of a command frame that moves a joint; 0 where there is none.
  [[nodiscard]] double joint_period_s() const noexcept;
  /// @param bus 0 or, where there are two, 1
  [[nodiscard]] BusLine line(std::size_t bus) const {
    return bus == 0 ? BusLine{name, bit_rate, foreign_load} : second.value_or(BusLine());
  }
  [[nodiscard]] std::size_t lines() const noexcept { return second ? 2 : 1; }
  /// What is on the first bus or on the second, as if there were no other.
  [[nodiscard]] BusDescription alone(std::size_t bus) const;
  /// "valves, machine"
  [[nodiscard]] std::string line_names() const { return second ? name + ", " + second->name : name; }
  /// The bus of this name; nullopt where there is none.
  [[nodiscard]] std::optional<std::size_t> line_named(const std::string& bus) const noexcept;
  bool operator==(const BusDescription&) const = default;

 private:
  [[nodiscard]] std::uint32_t command_id(int joint) const noexcept;
};

inline constexpr std::uint8_t kOwnController = 0;  ///< In place of a module's id.
/// Whether what this module's outputs, or the machine's own controller, are told moves the joint, or any: only of those
/// can be tried, and must be proved, what ends a motion.
[[nodiscard]] bool moves_joint(const BusDescription& bus, std::uint8_t module, int joint) noexcept;
[[nodiscard]] bool moves_joints(const BusDescription& bus, std::uint8_t module) noexcept;

}  // namespace knuckle
