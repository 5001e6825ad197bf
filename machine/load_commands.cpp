#include "machine/load_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/joints.h"
#include "core/units.h"
#include "machine/bus_budget.h"
#include "machine/load_frames.h"
#include "machine/signal_units.h"
#include "transport/j1939.h"

namespace knuckle {
namespace {

constexpr double kMost = 1e9;
constexpr double kLeastSteps = 100;  // from neutral to full: what a gate lets pass is said to a hundredth

/// The unit of a value that moves a joint says what kind of command it is.
struct CommandUnit {
  Unit unit;
  CommandKind kind;
};
constexpr std::array kCommandUnits{CommandUnit{{"rad/s", 1}, CommandKind::kJointRate},
                                   CommandUnit{{"deg/s", kDegree}, CommandKind::kJointRate},
                                   CommandUnit{{"bar", kBar}, CommandKind::kPilotPressure},
                                   CommandUnit{{"Pa", 1}, CommandKind::kPilotPressure},
                                   CommandUnit{{"kPa", 1e3}, CommandKind::kPilotPressure},
                                   CommandUnit{{"MPa", 1e6}, CommandKind::kPilotPressure},
                                   CommandUnit{{"mA", kMilli}, CommandKind::kCurrent},
                                   CommandUnit{{"A", 1}, CommandKind::kCurrent},
                                   CommandUnit{{"mV", kMilli}, CommandKind::kVoltage},
                                   CommandUnit{{"V", 1}, CommandKind::kVoltage},
                                   CommandUnit{{"%", 0.01}, CommandKind::kFlow}};

/// ISO 11783-7: the valve's state in a command of an auxiliary valve. Float, 3, is never sent.
constexpr BitField kValveState{.start_bit = 16, .bits = 4};
constexpr std::uint64_t kBlocked = 0, kExtends = 1, kRetracts = 2, kFloats = 3;

CommandField constant(const char* name, std::uint8_t start_bit, std::uint8_t bits, double value) {
  return {.name = name, .bits = {.start_bit = start_bit, .bits = bits}, .neutral = value, .led = value};
}

class CommandReader {
 public:
  CommandReader(const TomlTable& file, BusDescription& bus) : file_(file), bus_(bus) {
    for (const BroadcastFrame& frame : bus.broadcasts)
      heads_.push_back({frame.name, frame.id, frame.mask, frame.source});
  }

  void read(TomlTable& file, std::uint32_t bus) {
    if (file.has("iso11783_valve")) return read_valve(file, bus);
    const BroadcastFrame head = read_frame_head(file, heads_, bus, false, bus_.j1939_address);
    CommandFrame frame{
        .name = head.name, .id = head.id, .mask = head.mask, .bytes = head.bytes, .period_s = head.period_s};
    frame.always = file.choice("send", {"always", "while_led"}) == 0;
    std::vector<UsedBits> used;
    TomlTable fields = file.table("fields");
    read_fields(fields, frame, used);
    check_period(file, frame);
    frame.closing = read_frame_closing(file, frame.bytes, used);
    refuse_float(fields, frame);
    heads_.push_back(head);
    bus_.commands.push_back(std::move(frame));
  }

  /// The command of an auxiliary valve (ISO 11783-7) in short: how much of its flow, and which way.
  void read_valve(TomlTable& file, std::uint32_t bus) {
    const auto valve = static_cast<std::uint32_t>(file.integer("iso11783_valve", 0, j1939::kMostValve));
    file.require(bus_.j1939_address.has_value(), "iso11783_valve",
                 "needs bus.j1939_address, which the command goes out from", {".bus.j1939_address"});
    constexpr std::uint32_t kPriority = 3;
    const std::uint32_t id =
        j1939::identifier(j1939::kValveCommand + valve, bus_.j1939_address.value_or(0), j1939::kEverybody, kPriority);
    const BroadcastFrame head{
        .name = fmt::format("iso11783_valve_{}", valve), .id = id | bus, .mask = j1939::kAllButPriorityAndSource};
    check_frame_head(file, head, heads_, "iso11783_valve", "iso11783_valve");
    // The standard repeats it every 100 ms; here no joint's frame may be so old.
    CommandFrame frame{.name = head.name,
                       .id = head.id,
                       .mask = head.mask,
                       .period_s = file.has("period_ms") ? file.number("period_ms", 1, 1000, kMilli) : kSlowestJoint_s,
                       .always = false};
    const int joint = file.choice("joint", kJointNames);
    CommandField flow{.name = std::string(kJointNames[static_cast<std::size_t>(joint)]) + "_flow",
                      .bits = {.bits = 8, .scale = 0.004},
                      .joint = joint};
    const bool reversed = file.has("reversed") && file.boolean("reversed");
    flow.direction = CommandDirection{.bits = kValveState,
                                      .neutral = kBlocked,
                                      .extend = reversed ? kRetracts : kExtends,
                                      .retract = reversed ? kExtends : kRetracts};
    set_kind(file, CommandKind::kFlow, "iso11783_valve");
    for (auto [key, full] : {std::pair("extend", &flow.extend), {"retract", &flow.retract}}) {
      *full = read_value(file, key, flow.bits, 0.01);
      file.require(**full > 0.4 - 1e-9 && **full < 1 + 1e-9, key, "must be within [40, 100]");
    }
    check_ways(file, flow);
    check_beside(file, "joint", flow, frame);
    frame.fields = {std::move(flow), constant("reserved_2", 8, 8, 0xFF), constant("reserved_3", 20, 2, 3),
                    constant("fail_safe_blocked", 22, 2, 0), constant("reserved_4_to_8", 24, 40, 0xFF'FFFF'FFFF)};
    check_period(file, frame);
    heads_.push_back(head);
    bus_.commands.push_back(std::move(frame));
  }

  void check_period(const TomlTable& file, const CommandFrame& frame) const {
    file.require(2 * frame.period_s <= bus_.valve_watchdog_s * (1 + 1e-9), "period_ms",
                 fmt::format("must be at most {}, half of bus.valve_watchdog_ms",
                             number_text(bus_.valve_watchdog_s / kMilli / 2)),
                 {".bus.valve_watchdog_ms"});
    file.require(frame.period_s * bus_.sync_Hz >= 1 - 1e-9, "period_ms",
                 fmt::format("must be at least {}, the loop's period", number_text(1 / bus_.sync_Hz / kMilli)),
                 {".bus.sync_Hz"});
    file.require(
        !moves_joint(frame) || frame.period_s <= kSlowestJoint_s * (1 + 1e-9), "period_ms",
        fmt::format("must be at most {} of a frame that moves a joint", number_text(kSlowestJoint_s / kMilli)));
  }

  /// All that the module has, so that each has a neutral.
  void read_outputs(TomlTable outputs, NodeDescription& node) {
    const std::vector<int> numbers = analog_numbers(outputs);
    outputs.require(
        !numbers.empty() && numbers.back() == static_cast<int>(numbers.size()), "",
        "must say all outputs that the module has, from 1 on: those that nothing hangs on with their neutral");
    const double period_s = bus_.set_point_every_nth_sync / bus_.sync_Hz;
    file_.require(period_s <= kSlowestJoint_s * (1 + 1e-9), "set_point_every_nth_sync",
                  fmt::format("is {} ms: must be at most {} with outputs that move a joint",
                              number_text(period_s / kMilli), number_text(kSlowestJoint_s / kMilli)),
                  {"sync_Hz"});
    CommandFrame frame;
    for (const int number : numbers) {
      const std::uint8_t pdo = analog_pdo(static_cast<unsigned>(number));
      if (!frame.fields.empty() && pdo != frame.pdo) bus_.commands.push_back(std::exchange(frame, {}));
      const BitField bits{.type = BitField::Type::kSigned,
                          .start_bit = analog_start_bit(static_cast<unsigned>(number)),
                          .bits = kAnalogBits};
      if (frame.fields.empty())
        frame = {
            .name = fmt::format("{}_rpdo{}", node.name, pdo + 1), .period_s = period_s, .module = node.id, .pdo = pdo};
      frame.bytes = bytes_of(bits);
      const std::string key = std::to_string(number);
      CommandField field = read_field(outputs.table(key), bits);
      field.name = fmt::format("{}_{}", node.name, number);
      if (outputs.sound({key})) check_beside(outputs, key, field, frame);
      frame.fields.push_back(std::move(field));
    }
    if (!frame.fields.empty()) bus_.commands.push_back(std::move(frame));
    outputs.require(bus_.command_kind != CommandKind::kJointRate, "", "say voltages, currents or pressures, no speeds");
    node.outputs = static_cast<std::uint8_t>(numbers.size());
  }

  /// Once all frames are known.
  void check_joints() {
    const char* const key = file_.has("command") ? "command" : "node";
    if (!file_.sound({key})) return;
    for (int joint = 0; joint < kJoints; ++joint) {
      for (const bool extend : {true, false}) {
        if (bus_.command(joint, extend) != nullptr) continue;
        file_.require(false, key,
                      fmt::format("no field {} the {}: one must have joint = \"{}\" with {}",
                                  extend ? "extends" : "retracts", kJointNames[static_cast<std::size_t>(joint)],
                                  kJointNames[static_cast<std::size_t>(joint)], extend ? "extend" : "retract"));
      }
    }
  }

 private:
  void read_fields(TomlTable& fields, CommandFrame& frame, std::vector<UsedBits>& used) {
    const std::vector<std::string> keys = fields.keys();
    if (keys.empty()) fields.require(false, "", "must have at least one field");
    for (const std::string& key : keys) {
      check_name(fields, key);
      TomlTable file = fields.table(key);
      const BitField bits = read_bits(file, frame.bytes);
      std::optional<CommandDirection> direction;
      if (file.has("direction")) direction = read_direction(file.table("direction"), frame.bytes);
      CommandField field = read_field(file, bits, direction);
      field.name = key;
      std::vector<UsedBits> own{{field.bits, key}};
      if (direction) own.push_back({direction->bits, key + ".direction"});
      if (fields.sound({key})) {
        for (const UsedBits& other : used)
          for (const UsedBits& one : own)
            fields.require(!overlap(one.bits, other.bits), key, "has bits of " + other.whose);
        fields.require(!direction || !overlap(field.bits, direction->bits), key, "has bits of its own direction");
        check_beside(fields, key, field, frame);
      }
      used.insert(used.end(), own.begin(), own.end());
      frame.fields.push_back(std::move(field));
    }
  }

  static CommandDirection read_direction(TomlTable file, std::uint8_t frame_bytes) {
    CommandDirection direction{.bits = read_bits(file, frame_bytes)};
    const std::int64_t most = most_raw(file, direction.bits, 8);
    for (auto [key, raw] :
         {std::pair("neutral", &direction.neutral), {"extend", &direction.extend}, {"retract", &direction.retract}})
      *raw = static_cast<std::uint64_t>(file.integer(key, 0, most));
    file.require(direction.extend != direction.neutral, "extend", "must not be that of neutral", {"neutral"});
    file.require(direction.retract != direction.neutral && direction.retract != direction.extend, "retract",
                 "must not be that of neutral or extend", {"neutral", "extend"});
    return direction;
  }

  /// Of a command of an auxiliary valve.
  static void refuse_float(const TomlTable& fields, const CommandFrame& frame) {
    const std::uint32_t group = j1939::group_of(frame.id);
    if ((frame.id & kExtendedId) == 0 || group < j1939::kValveCommand ||
        group > j1939::kValveCommand + j1939::kMostValve)
      return;
    constexpr const char* kWhy = "can let the valve float: state 3 of ISO 11783-7, bits 16 to 19, is never sent";
    for (const bool led : {false, true}) {
      CanFrame constants;
      for (const CommandField& field : frame.fields)
        if (!field.joint) write_value(field.bits, led ? field.led : field.neutral, constants);
      fields.require(read_raw(kValveState, constants) != kFloats, "", kWhy);
    }
    const auto& [counter, checksum] = frame.closing;
    const bool counts =
        (counter && overlap(counter->field, kValveState)) || (checksum && overlap(checksum->field, kValveState));
    fields.require(!counts, "", kWhy);
    for (const CommandField& field : frame.fields) {
      if (!field.joint) continue;
      bool floats = overlap(field.bits, kValveState);
      if (const auto& way = field.direction; way && overlap(way->bits, kValveState))
        floats = floats || way->bits != kValveState || way->neutral == kFloats || way->extend == kFloats ||
                 way->retract == kFloats;
      fields.require(!floats, field.name, kWhy);
    }
  }

  static void check_name(const TomlTable& fields, const std::string& name) {
    constexpr std::size_t kLongest = 32;  // of a signal in a DBC
    fields.require(is_plain_name(name, kLongest), name, "its name must be a letter and up to 31 letters, digits and _");
  }

  /// What moves a joint is one thing each way, and one kind everywhere.
  void check_beside(const TomlTable& fields, const std::string& key, const CommandField& field,
                    const CommandFrame& frame) const {
    if (!field.joint) return;
    const auto look = [&](const CommandFrame& at) {
      for (const CommandField& other : at.fields) {
        fields.require(&at == &frame || other.joint != field.joint, key,
                       fmt::format("moves the {} as {} of '{}' does: a joint's two ways must be in one frame",
                                   kJointNames[static_cast<std::size_t>(*field.joint)], other.name, at.name));
        const bool same =
            other.joint == field.joint && ((other.extend && field.extend) || (other.retract && field.retract));
        fields.require(!same, key, fmt::format("moves the joint as {} of '{}' does", other.name, at.name));
      }
    };
    look(frame);
    for (const CommandFrame& at : bus_.commands) look(at);
  }

  CommandField read_field(TomlTable file, const BitField& bits,
                          const std::optional<CommandDirection>& direction = std::nullopt) {
    CommandField field;
    field.bits = bits;
    field.direction = direction;
    file.require(!direction || file.has("joint"), "direction", "is for a field with joint");
    double unit = 1;
    if (file.has("joint")) {
      field.joint = file.choice("joint", kJointNames);
      unit = read_unit(file);
    }
    field.bits.scale = (file.has("scale") ? file.number("scale", -kMost, kMost) : 1) * unit;
    file.require(field.bits.scale != 0, "scale", "must not be 0");
    if (file.has("offset")) field.bits.offset = file.number("offset", -kMost, kMost) * unit;
    field.neutral = read_value(file, "neutral", field.bits, unit);
    field.led = field.neutral;
    if (!field.joint) {
      if (file.has("led")) field.led = read_value(file, "led", field.bits, unit);
      return field;
    }
    if (file.has("extend")) field.extend = read_value(file, "extend", field.bits, unit);
    if (file.has("retract")) field.retract = read_value(file, "retract", field.bits, unit);
    check_ways(file, field);
    return field;
  }

  double read_unit(TomlTable& file) {
    std::vector<const char*> names;
    for (const CommandUnit& one : kCommandUnits) names.push_back(one.unit.name);
    const CommandUnit& unit = kCommandUnits[static_cast<std::size_t>(file.choice("unit", names))];
    if (!file.sound({"unit"})) return unit.unit.si;
    set_kind(file, unit.kind, "unit");
    return unit.unit.si;
  }

  void set_kind(const TomlTable& file, CommandKind kind, const char* key) {
    file.require(bus_.command_kind == CommandKind::kSpool || bus_.command_kind == kind, key,
                 "is another kind of command than that of another joint's field");
    bus_.command_kind = kind;
  }

  /// In the file's unit; noted where the field's bits cannot say it. A speed that is nearly 0 is no neutral.
  static double read_value(TomlTable& file, const char* key, const BitField& bits, double unit) {
    constexpr double kExact = 1e-6, kExactSteps = 1e-3;  // number_text() says the nearest so exactly
    const double value = file.number(key, -kMost, kMost) * unit;
    if (bits.scale == 0 || !file.sound({"start", "bits", "order", "type", "scale", "offset"})) return value;
    const double said = value_of(bits, raw_of(bits, value));
    const bool is_float = bits.type == BitField::Type::kFloat;
    const double most = is_float ? kExact * std::max(1.0, std::abs(value)) : kExactSteps * std::abs(bits.scale);
    file.require(std::abs(said - value) <= most, key,
                 fmt::format("cannot be said by these bits: nearest is {}", number_text(said / unit)),
                 {"start", "bits", "order", "type", "scale", "offset"});
    return value;
  }

  void check_ways(TomlTable& file, const CommandField& field) const {
    const double extend = field.extend.value_or(field.neutral) - field.neutral,
                 retract = field.retract.value_or(field.neutral) - field.neutral;
    file.require(field.extend || field.retract, "joint", "moves it no way: must have extend or retract, or both");
    const double least = field.bits.type == BitField::Type::kFloat ? 0 : kLeastSteps * std::abs(field.bits.scale);
    const auto far = [&](const std::optional<double>& full, double way, const char* key) {
      file.require(!full || (way != 0 && std::abs(way) >= least * (1 - 1e-9)), key,
                   fmt::format("must be at least {} steps of scale from neutral", number_text(kLeastSteps)),
                   {"neutral", "scale", "unit"});
    };
    far(field.extend, extend, "extend");
    far(field.retract, retract, "retract");
    const bool both = field.extend && field.retract;
    file.require(!field.direction || both, "direction", "needs extend and retract");
    file.require(!both || field.direction || extend * retract < 0, "retract",
                 "must be on neutral's other side than extend", {"neutral", "extend"});
    file.require(!both || !field.direction || extend * retract > 0, "retract",
                 "must be on the same side of neutral as extend: direction says the way", {"neutral", "extend"});
    const bool rate = bus_.command_kind == CommandKind::kJointRate;
    file.require(!rate || both, "joint", "of a speed it must have extend and retract", {"unit"});
    file.require(!rate || field.neutral == 0, "neutral", "of a speed must be 0", {"unit"});
  }

  const TomlTable& file_;
  BusDescription& bus_;
  std::vector<BroadcastFrame> heads_;  // as far as another frame may not have the same
};

}  // namespace

void read_commands(const TomlTable& file, std::vector<TomlTable> files, std::vector<TomlTable> on_second,
                   BusDescription& bus) {
  if (files.empty() && on_second.empty()) return;
  CommandReader reader(file, bus);
  for (TomlTable& one : files) reader.read(one, 0);
  for (TomlTable& one : on_second) reader.read(one, kSecondBus);
}

void read_outputs(const TomlTable& file, TomlTable outputs, NodeDescription& node, BusDescription& bus) {
  CommandReader(file, bus).read_outputs(std::move(outputs), node);
}

void check_commands(const TomlTable& file, BusDescription& bus) {
  if (bus.by_frames()) CommandReader(file, bus).check_joints();
}

}  // namespace knuckle
