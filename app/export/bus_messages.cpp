#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "app/export/export_command.h"
#include "core/units.h"
#include "machine/bus_frames.h"
#include "machine/description.h"
#include "machine/signal_units.h"
#include "machine/toml_reader.h"
#include "slave/bus_map.h"
#include "slave/sensors.h"
#include "transport/canopen.h"
#include "transport/j1939.h"

namespace knuckle::exporting {

namespace {

using Type = BitField::Type;
constexpr double kAny = std::numeric_limits<double>::infinity();

/// Digits that a decimal step was written with: 0.1 * pi / 180 / (pi / 180) is to be 0.1 again.
double rounded(double factor) {
  constexpr double kDigits = 1e12;
  return std::round(factor * kDigits) / kDigits;
}

/// To the micrometre.
double millimetres(double length_m) {
  return std::round(length_m * 1e6) / 1e3;
}

Signal flag(std::string name, unsigned bit, std::string about) {
  return {.name = std::move(name), .start_bit = bit, .bits = 1, .max = 1, .about = std::move(about)};
}

/// Bounds that the wire's bits cannot hold are no bounds.
Signal number(Type type, std::string name, unsigned start_bit, unsigned bits, double factor, std::string unit,
              double min, double max, std::string about) {
  const double most = rounded(factor * (std::exp2(bits - 1) - 1));
  if (type == Type::kSigned) {
    min = std::max(min, -most);
    max = std::min(max, most);
  }
  return {.type = type,
          .name = std::move(name),
          .start_bit = start_bit,
          .bits = bits,
          .factor = factor,
          .min = min,
          .max = max,
          .unit = std::move(unit),
          .about = std::move(about)};
}

Signal whole(std::string name, unsigned start_bit, unsigned bits, std::string about = {}) {
  return {.name = std::move(name),
          .start_bit = start_bit,
          .bits = bits,
          .max = std::exp2(bits) - 1,
          .about = std::move(about)};
}

Signal nmt_state() {
  using canopen::NmtState;
  Signal state = whole("State", 0, 7);
  state.values = {{static_cast<std::uint32_t>(NmtState::kBootUp), "boot-up"},
                  {static_cast<std::uint32_t>(NmtState::kStopped), "stopped"},
                  {static_cast<std::uint32_t>(NmtState::kOperational), "operational"},
                  {static_cast<std::uint32_t>(NmtState::kPreOperational), "pre-operational"}};
  return state;
}

Signal nmt_command() {
  using canopen::NmtCommand;
  Signal command = whole("Command", 0, 8);
  command.values = {{static_cast<std::uint32_t>(NmtCommand::kStart), "start"},
                    {static_cast<std::uint32_t>(NmtCommand::kStop), "stop"},
                    {static_cast<std::uint32_t>(NmtCommand::kEnterPreOperational), "enter pre-operational"},
                    {static_cast<std::uint32_t>(NmtCommand::kResetNode), "reset node"},
                    {static_cast<std::uint32_t>(NmtCommand::kResetCommunication), "reset communication"}};
  return command;
}

/// CiA 408: bits 0 to 2 of status and control word.
Signal valve_state(std::string name, std::string about) {
  using canopen::ValveState;
  Signal state = whole(std::move(name), 0, 3, std::move(about));
  state.values = {{static_cast<std::uint32_t>(ValveState::kInit), "init"},
                  {static_cast<std::uint32_t>(ValveState::kDisabled), "disabled"},
                  {static_cast<std::uint32_t>(ValveState::kHold), "hold"},
                  {static_cast<std::uint32_t>(ValveState::kActive), "active"}};
  return state;
}

unsigned bit_of(std::uint16_t mask) {
  unsigned bit = 0;
  while ((mask >> bit & 1) == 0) ++bit;
  return bit;
}

Signal spool(const MachineDescription& machine, std::string name, std::string about) {
  constexpr double kPercent = 100;
  return number(Type::kSigned, std::move(name), 16, 16, kPercent / machine.bus.wire.valve_full_stroke, "%", -kPercent,
                kPercent, std::move(about) + ", of the spool's stroke; positive extends the cylinder");
}

/// Signals of a channel are named by what it is where the node has several.
std::string prefix_of(const FrameField& field, const NodeDescription& node) {
  return node.channels.size() > 1 ? std::string(field.channel.info().name) + "_" : "";
}

std::vector<Signal> valve_status(const BusFrame& frame, const MachineDescription& machine) {
  const FrameField &word = frame.fields[0], &actual = frame.fields[1];
  const std::string prefix = prefix_of(word, machine.bus.nodes[frame.node]);
  return {valve_state(prefix + "State", fmt::format("CiA 408, 0x{:04X}", word.object.index)),
          flag(prefix + "Ready", bit_of(canopen::kStatusReady), "0: fault"),
          flag(prefix + "Local", bit_of(canopen::kStatusLocal), "1: set-points are not taken from the bus"),
          spool(machine, prefix + "SpoolPosition", fmt::format("0x{:04X}:01, actual", actual.object.index))};
}

std::vector<Signal> valve_command(const BusFrame& frame, const MachineDescription& machine) {
  const FrameField &word = frame.fields[0], &set_point = frame.fields[1];
  const std::string prefix = prefix_of(word, machine.bus.nodes[frame.node]);
  return {valve_state(prefix + "State", fmt::format("State that is asked for (CiA 408, 0x{:04X})", word.object.index)),
          flag(prefix + "Reset", bit_of(canopen::kControlReset), "Rising edge: resets a fault"),
          spool(machine, prefix + "SpoolSetPoint", fmt::format("0x{:04X}:01, set-point", set_point.object.index))};
}

/// Value and status, where there is one, of a channel.
std::vector<Signal> pressure(const FrameField& value, const FrameField* status, const std::string& prefix,
                             const MachineDescription& machine) {
  const double most_Pa = slave::kValidity.pressure_over_range * machine.sensors.pressure_range_Pa;
  const auto bit = [&](std::uint16_t mask) { return status->bits.start_bit + bit_of(mask); };
  const auto about = [](const canopen::Object& object) {
    return fmt::format("0x{:04X}:{:02X}", object.index, object.subindex);
  };
  std::vector<Signal> all{number(value.bits.type, prefix + "Pressure", value.bits.start_bit, value.bits.bits,
                                 rounded(value.bits.scale / kBar), "bar", slave::kValidity.pressure_floor_Pa / kBar,
                                 rounded(most_Pa / kBar), about(value.object) + ", gauge")};
  if (status == nullptr) return all;
  all.push_back(flag(prefix + "Invalid", bit(canopen::kPressureInvalid), about(status->object)));
  all.push_back(flag(prefix + "Overload", bit(canopen::kPressureOverload), about(status->object)));
  all.push_back(flag(prefix + "Underload", bit(canopen::kPressureUnderload), about(status->object)));
  return all;
}

std::vector<Signal> pressures(const BusFrame& frame, const NodeDescription& node, const MachineDescription& machine) {
  std::vector<Signal> all;
  for (const FrameField& field : frame.fields) {
    if (field.part != FrameField::Part::kValue) continue;
    const FrameField* const status = find_field(frame.fields, FrameField::Part::kStatus, field.channel);
    for (Signal& one : pressure(field, status, prefix_of(field, node), machine)) all.push_back(std::move(one));
  }
  return all;
}

/// Of the shaft: a DBC cannot take whole turns off.
std::vector<Signal> rotary_encoder(const BusFrame& frame, const RotaryDescription& rotary) {
  const double step_deg = rounded(rotary.step_rad() / kDegree);
  return {number(Type::kUnsigned, "Shaft", frame.fields.front().bits.start_bit, 32, step_deg, "deg", 0,
                 step_deg * (rotary.range() - 1),
                 fmt::format("0x6004: the joint's angle is {:.6g} deg {} this, less whole turns",
                             rotary.zero_rad / kDegree, rotary.sign > 0 ? "plus" : "minus"))};
}

std::vector<Signal> encoder(const BusFrame& frame, const MachineDescription& machine, int joint) {
  const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(joint)];
  const double offset_m = machine.sensors.encoder_offset_m[joint], margin_m = slave::kValidity.length_margin_m;
  std::string about = "0x6004: the cylinder's length from pin to pin";
  if (offset_m != 0) about += fmt::format(" plus {:.3f} mm, as calibrated", offset_m / kMilli);
  std::vector<Signal> all;
  for (const FrameField& field : frame.fields) {
    const unsigned start = field.bits.start_bit;
    if (field.part == FrameField::Part::kValue)
      all.push_back(number(Type::kSigned, "Length", start, 32, rounded(machine.sensors.encoder_step_m / kMilli), "mm",
                           millimetres(cylinder.min_length_m - margin_m + offset_m),
                           millimetres(cylinder.max_length_m + margin_m + offset_m), about));
    else
      all.push_back(number(Type::kSigned, "Speed", start, 16, rounded(machine.bus.wire.encoder_speed_step_mps / kMilli),
                           "mm/s", -kAny, kAny, "0x6030:01"));
  }
  return all;
}

std::vector<Signal> tilt(const BusFrame& frame, const MachineDescription& machine) {
  const FrameField& slope = frame.fields.front();
  const bool on_boom = machine.sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom;
  const double most_deg = (on_boom ? std::numbers::pi : slave::kValidity.hull_tilt_rad) / kDegree;
  return {number(
      Type::kSigned, "Slope", slope.bits.start_bit, 16, rounded(machine.sensors.tilt_step_rad / kDegree), "deg",
      -most_deg, most_deg,
      fmt::format("0x{:04X}: the {}", slope.object.index, on_boom ? "boom against the horizontal" : "hull's pitch"))};
}

std::vector<Signal> sent_in(const BusFrame& frame, const MachineDescription& machine) {
  const NodeDescription& node = machine.bus.nodes[frame.node];
  if (frame.fields.empty()) return {};  // the device's own
  switch (node.role) {
    case NodeRole::kValve:
      return valve_status(frame, machine);
    case NodeRole::kPressure:
      return pressures(frame, node, machine);
    case NodeRole::kEncoder:
      return node.measures_angle() ? rotary_encoder(frame, node.rotary) : encoder(frame, machine, node.joint());
    case NodeRole::kTilt:
      return tilt(frame, machine);
    case NodeRole::kEnable:
    case NodeRole::kReading:
    case NodeRole::kPilot:
    case NodeRole::kModule:
      break;
  }
  return {flag("EStopClosed", bit_of(canopen::kInputEStopClosed), "The E-stop chain is closed: nobody has pressed"),
          flag("PilotOn", bit_of(canopen::kInputPilotOn), "Pilot pressure is on: valves can move")};
}

std::vector<Signal> told_in(const BusFrame& frame, const MachineDescription& machine) {
  if (machine.bus.nodes[frame.node].role == NodeRole::kValve) return valve_command(frame, machine);
  return {flag("Enable", bit_of(canopen::kOutputEnable), "Asks for pilot pressure")};
}

std::vector<Signal> emergency() {
  Signal code = whole("ErrorCode", 0, 16, "CiA 301 and the device's profile");
  for (const std::uint16_t known : {canopen::kEmcyReset, canopen::kEmcySensor, canopen::kEmcyHeartbeat,
                                    canopen::kEmcyRpdoTimeout, canopen::kEmcyExternal, canopen::kEmcyDeviceSpecific}) {
    code.values.emplace_back(known, canopen::emergency_text(known));
  }
  return {std::move(code), whole("ErrorRegister", 16, 8, "0x1001"), whole("Vendor", 24, 40, "The maker's own")};
}

std::vector<Signal> sdo() {
  return {whole("Command", 0, 8, "Command specifier (CiA 301); Knuckle uses expedited transfers only"),
          whole("Index", 8, 16, "Of the object"), whole("Subindex", 24, 8, "Of the object"),
          whole("Data", 32, 32, "Value, or abort code; unused bytes are 0")};
}

/// As DBC counts in a message of several packets, too.
unsigned first_bit(const BroadcastField& field) {
  return 8U * field.first_byte + field.bits.start_bit;
}

/// Angles with sign and zero of their installation.
Signal broadcast(const BroadcastField& field) {
  const SignalInfo& info = field.info();
  if (is_yes_or_no(info)) {
    Signal status = whole(info.name, first_bit(field), field.bits.bits, fmt::format("{}: yes", field.on));
    status.order = field.bits.order;
    return status;
  }
  const Unit& unit = shown_unit(info);
  Signal signal{.type = field.bits.type,
                .order = field.bits.order,
                .name = info.name,
                .start_bit = first_bit(field),
                .bits = field.bits.bits,
                .factor = rounded(field.bits.scale / unit.si),
                .offset = rounded(field.bits.offset / unit.si),
                .unit = unit.name};
  if (field.invalid_from) signal.about = fmt::format("No value from 0x{:X} on", *field.invalid_from);
  return signal;
}

/// In rad/s, bar, A or as the file has it.
Signal command(const CommandField& field, CommandKind kind) {
  const bool moves = field.joint.has_value(), pressure = moves && kind == CommandKind::kPilotPressure;
  const double unit = pressure ? kBar : moves && kind == CommandKind::kFlow ? 0.01 : 1;
  const char* const name = pressure                        ? "bar"
                           : kind == CommandKind::kCurrent ? "A"
                           : kind == CommandKind::kVoltage ? "V"
                           : kind == CommandKind::kFlow    ? "%"
                                                           : "rad/s";
  std::string about = fmt::format("neutral {}", number_text(field.neutral / unit));
  if (field.led != field.neutral && !moves) about += fmt::format(", {} while led", number_text(field.led));
  if (field.extend) about += fmt::format(", {} extends at full speed", number_text(*field.extend / unit));
  if (field.retract) about += fmt::format(", {} retracts at full speed", number_text(*field.retract / unit));
  return {.type = field.bits.type,
          .order = field.bits.order,
          .name = field.name,
          .start_bit = field.bits.start_bit,
          .bits = field.bits.bits,
          .factor = rounded(field.bits.scale / unit),
          .offset = rounded(field.bits.offset / unit),
          .unit = moves ? name : "",
          .about = std::move(about)};
}

/// Which way a command beside it goes.
Signal way(const CommandField& field) {
  constexpr std::size_t kLongest = 28;  // 32 of a signal
  const CommandDirection& direction = *field.direction;
  Signal signal = whole(field.name.substr(0, kLongest) + "_way", direction.bits.start_bit, direction.bits.bits);
  signal.order = direction.bits.order;
  const auto raw = [](std::uint64_t value) { return static_cast<std::uint32_t>(value); };
  signal.values = {
      {raw(direction.neutral), "neutral"}, {raw(direction.extend), "extends"}, {raw(direction.retract), "retracts"}};
  return signal;
}

void add_closing(const FrameClosing& closing, std::vector<Signal>& all) {
  const auto closes = [&](const char* name, const BitField& bits) {
    Signal signal = whole(name, bits.start_bit, bits.bits);
    signal.order = bits.order;
    all.push_back(std::move(signal));
  };
  if (closing.counter) closes("counter", closing.counter->field);
  if (closing.checksum) closes("checksum", closing.checksum->field);
}

/// Of all frames that a multiplexer tells apart, or of the only one.
std::vector<Signal> broadcast(const BroadcastFrame& first, const std::vector<BroadcastFrame>& frames) {
  std::vector<Signal> all;
  if (first.multiplexer) {
    const BitField& bits = first.multiplexer->bits;
    all.push_back(whole("multiplexer", bits.start_bit, bits.bits, "Which values the frame has"));
    all.back().order = bits.order;
    all.back().is_multiplexer = true;
  }
  for (const BroadcastFrame& frame : frames) {
    if (frame.id != first.id) continue;
    for (const BroadcastField& field : frame.fields) {
      all.push_back(broadcast(field));
      if (frame.multiplexer) all.back().with_multiplexer = frame.multiplexer->value;
    }
  }
  add_closing(first.closing, all);
  return all;
}

/// front_3 with the multiplexer's value 3 is of the message front.
std::string without_value(const BroadcastFrame& first) {
  const std::string ending = first.multiplexer ? fmt::format("_{}", first.multiplexer->value) : "";
  return first.name.substr(0, first.name.size() - (first.name.ends_with(ending) ? ending.size() : 0));
}

std::vector<Signal> command(const CommandFrame& frame, CommandKind kind) {
  std::vector<Signal> all;
  for (const CommandField& field : frame.fields) {
    all.push_back(command(field, kind));
    if (field.direction) all.push_back(way(field));
  }
  add_closing(frame.closing, all);
  return all;
}

/// Messages in the order of bus_messages(), periods and PDO sizes from the map of the bus.
class Messages {
 public:
  explicit Messages(const MachineDescription& machine)
      : machine_(machine), periodic_(slave::bus_map(machine.bus)), frames_(bus_frames(machine.bus, machine.sensors)) {}

  std::vector<Message> all() {
    if (!machine_.bus.without_nodes()) add_network();
    for (std::size_t node = 0; node < machine_.bus.nodes.size(); ++node) add_node(node);
    const std::vector<BroadcastFrame>& sent = machine_.bus.broadcasts;
    for (const BroadcastFrame& frame : sent) {
      const auto is_it = [&](const Message& message) { return message.id == frame.id; };
      if (frame.multiplexer && std::any_of(messages_.begin(), messages_.end(), is_it)) continue;
      add(frame.id, name_of(frame), own(frame.module), {kController}, frame.bytes, broadcast(frame, sent),
          frame.module != 0  ? "Analogue inputs"
          : frame.on_request ? "Sent by the machine when asked"
                             : "Sent by the machine itself");
      if (j1939::in_packets(frame.bytes)) messages_.back().period_s = frame.period_s;
    }
    for (const CommandFrame& frame : machine_.bus.commands)
      add(frame.id, frame.name, kController, {own(frame.module)}, frame.bytes,
          command(frame, machine_.bus.command_kind),
          frame.always ? "Also while nobody leads the machine" : "Only while an operator leads the machine");
    return std::move(messages_);
  }

 private:
  /// Without the multiplexer's value, unless another message has or will have that name.
  [[nodiscard]] std::string name_of(const BroadcastFrame& frame) const {
    const std::string name = without_value(frame);
    const auto has_it = [&](const auto& other) { return other.id != frame.id && other.name == name; };
    const auto taken = [&](const auto& others) { return std::any_of(others.begin(), others.end(), has_it); };
    return taken(messages_) || taken(machine_.bus.broadcasts) || taken(machine_.bus.commands) ? frame.name : name;
  }
  /// The module of this id; 0: the machine.
  [[nodiscard]] std::string own(std::uint8_t module) const {
    return module == 0 ? kMachine : machine_.bus.find(module)->name;
  }
  void add(std::uint32_t id, std::string name, std::string sender, std::vector<std::string> receivers,
           std::uint8_t size, std::vector<Signal> signals, std::string about) {
    Message message{id,   std::move(name),    std::move(sender), std::move(receivers),
                    size, std::move(signals), std::nullopt,      std::move(about)};
    if (const PeriodicFrame* frame = periodic(id)) message.period_s = 1 / frame->rate_Hz;
    messages_.push_back(std::move(message));
  }
  /// Null: comes and goes.
  [[nodiscard]] const PeriodicFrame* periodic(std::uint32_t id) const {
    const auto found =
        std::find_if(periodic_.begin(), periodic_.end(), [id](const PeriodicFrame& frame) { return frame.id == id; });
    return found == periodic_.end() ? nullptr : &*found;
  }
  void add_pdo(std::uint32_t id, std::string name, std::string sender, std::string receiver,
               std::vector<Signal> signals, std::string about) {
    add(id, std::move(name), std::move(sender), {std::move(receiver)}, periodic(id)->size, std::move(signals),
        std::move(about));
  }

  void add_network() {
    std::vector<std::string> everybody;
    for (const NodeDescription& node : machine_.bus.nodes) everybody.push_back(node.name);
    add(canopen::kNmtId, "NMT", kController, everybody, 2,
        {nmt_command(), whole("Node", 8, 7, "Whom it is for; 0: all")}, "Starts, stops and resets nodes");
    add(canopen::kSyncId, "SYNC", kController, everybody, 0, {}, "Sensors answer it with their TPDOs");
    add(canopen::heartbeat_id(machine_.bus.controller_id), std::string(kController) + "_heartbeat", kController,
        everybody, 1, {nmt_state()}, "Produced by the control loop's steps: a loop that hangs falls silent");
  }

  void add_node(std::size_t index) {
    const NodeDescription& node = machine_.bus.nodes[index];
    const std::string& name = node.name;
    const std::vector<std::string> controller{kController}, itself{name};
    for (const BusFrame& frame : frames_) {
      if (frame.node != index) continue;
      if (frame.to_node) {
        add_pdo(frame.id, fmt::format("{}_RPDO{}", name, frame.pdo + 1), kController, name, told_in(frame, machine_),
                node.role == NodeRole::kValve ? "Set-point; also at once when it drops to neutral" : "Output");
      } else {
        add_pdo(frame.id, fmt::format("{}_TPDO{}", name, frame.pdo + 1), name, kController, sent_in(frame, machine_),
                node.role == NodeRole::kEnable ? "Inputs; also at once when they change" : "");
      }
    }
    add(canopen::heartbeat_id(node.id), name + "_heartbeat", name, controller, 1, {nmt_state()}, "");
    add(canopen::emcy_id(node.id), name + "_EMCY", name, controller, 8, emergency(), "Emergency, and its reset");
    add(canopen::sdo_response_id(node.id), name + "_SDO_tx", name, controller, 8, sdo(), "Answers of the SDO server");
    add(canopen::sdo_request_id(node.id), name + "_SDO_rx", kController, itself, 8, sdo(),
        "Requests to the SDO server");
  }

  const MachineDescription& machine_;
  std::vector<PeriodicFrame> periodic_;
  std::vector<BusFrame> frames_;
  std::vector<Message> messages_;
};

}  // namespace

std::vector<Message> bus_messages(const MachineDescription& machine) {
  return Messages(machine).all();
}

}  // namespace knuckle::exporting
