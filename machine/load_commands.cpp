#include "machine/load_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
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
constexpr std::array kCommandUnits{
    CommandUnit{{"rad/s", 1}, CommandKind::kJointRate},      CommandUnit{{"deg/s", kDegree}, CommandKind::kJointRate},
    CommandUnit{{"bar", kBar}, CommandKind::kPilotPressure}, CommandUnit{{"Pa", 1}, CommandKind::kPilotPressure},
    CommandUnit{{"kPa", 1e3}, CommandKind::kPilotPressure},  CommandUnit{{"MPa", 1e6}, CommandKind::kPilotPressure},
    CommandUnit{{"mA", kMilli}, CommandKind::kCurrent},      CommandUnit{{"A", 1}, CommandKind::kCurrent},
    CommandUnit{{"mV", kMilli}, CommandKind::kVoltage},      CommandUnit{{"V", 1}, CommandKind::kVoltage}};

class CommandReader {
 public:
  CommandReader(const TomlTable& file, BusDescription& bus) : file_(file), bus_(bus) {
    for (const BroadcastFrame& frame : bus.broadcasts)
      heads_.push_back({frame.name, frame.id, frame.mask, frame.source});
  }

  void read(TomlTable& file, std::uint32_t bus) {
    const FrameHead head = read_frame_head(file, heads_, bus, false);
    CommandFrame frame{.name = head.name, .id = head.id, .bytes = head.bytes, .period_s = head.period_s};
    const bool from_address = (head.id & kExtendedId) != 0 && bus_.j1939_address == j1939::source_of(head.id);
    if (from_address) frame.mask = j1939::kAllButPriorityAndSource;
    frame.always = file.choice("send", {"always", "while_led"}) == 0;
    file.require(2 * frame.period_s <= bus_.valve_watchdog_s * (1 + 1e-9), "period_ms",
                 fmt::format("must be at most {}, half of bus.valve_watchdog_ms",
                             number_text(bus_.valve_watchdog_s / kMilli / 2)),
                 {".bus.valve_watchdog_ms"});
    file.require(frame.period_s * bus_.sync_Hz >= 1 - 1e-9, "period_ms",
                 fmt::format("must be at least {}, the loop's period", number_text(1 / bus_.sync_Hz / kMilli)),
                 {".bus.sync_Hz"});
    std::vector<UsedBits> used;
    read_fields(file.table("fields"), frame, used);
    file.require(
        !moves_joint(frame) || frame.period_s <= kSlowestJoint_s * (1 + 1e-9), "period_ms",
        fmt::format("must be at most {} of a frame that moves a joint", number_text(kSlowestJoint_s / kMilli)));
    frame.closing = read_frame_closing(file, frame.bytes, used);
    heads_.push_back(head);
    bus_.commands.push_back(std::move(frame));
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
  void read_fields(TomlTable fields, CommandFrame& frame, std::vector<UsedBits>& used) {
    const std::vector<std::string> keys = fields.keys();
    if (keys.empty()) fields.require(false, "", "must have at least one field");
    for (const std::string& key : keys) {
      check_name(fields, key);
      TomlTable file = fields.table(key);
      const BitField bits = read_bits(file, frame.bytes);
      CommandField field = read_field(file, bits);
      field.name = key;
      if (fields.sound({key})) {
        for (const UsedBits& other : used)
          fields.require(!overlap(field.bits, other.bits), key, "has bits of " + other.whose);
        check_beside(fields, key, field, frame);
      }
      used.push_back({field.bits, key});
      frame.fields.push_back(std::move(field));
    }
  }

  static void check_name(const TomlTable& fields, const std::string& name) {
    constexpr std::size_t kLongest = 32;  // of a signal in a DBC
    const bool plain =
        !name.empty() && name.size() <= kLongest && std::isalpha(static_cast<unsigned char>(name.front())) != 0 &&
        std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
    fields.require(plain, name, "its name must be a letter and up to 31 letters, digits and _");
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

  CommandField read_field(TomlTable file, const BitField& bits) {
    CommandField field;
    field.bits = bits;
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
    CommandKind& kind = bus_.command_kind;
    file.require(kind == CommandKind::kSpool || kind == unit.kind, "unit",
                 "is another kind of command than that of another joint's field");
    kind = unit.kind;
    return unit.unit.si;
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
    file.require(!field.extend || !field.retract || extend * retract < 0, "retract",
                 "must be on neutral's other side than extend", {"neutral", "extend"});
    const bool rate = bus_.command_kind == CommandKind::kJointRate;
    file.require(!rate || (field.extend && field.retract), "joint", "of a speed it must have extend and retract",
                 {"unit"});
    file.require(!rate || field.neutral == 0, "neutral", "of a speed must be 0", {"unit"});
  }

  const TomlTable& file_;
  BusDescription& bus_;
  std::vector<FrameHead> heads_;
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
