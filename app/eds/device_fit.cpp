// Whether start-up of a node would come to its end with a device that is sold.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/eds/bus_command.h"
#include "machine/bus_description.h"
#include "machine/bus_frames.h"
#include "machine/toml_reader.h"
#include "slave/node_setup.h"
#include "transport/canopen.h"

namespace knuckle::eds {
namespace {

constexpr std::uint16_t kBoolean = 1;

/// The limits that the device gives for this object, where the value is not within them; else empty. Not of a PDO's
/// identifier: what switches it off lies beyond the limits that files give.
std::string limits_against(const slave::SdoStep& step, const Entry& entry) {
  const DataType* const type = data_type(entry.data_type);
  const bool cob_id = step.object.index >= 0x1400 && step.object.index < 0x1C00 && step.object.subindex == 1;
  const bool nothing_fits = entry.lowest && entry.most && *entry.most <= *entry.lowest;  // left as the tool made them
  if (type == nullptr || cob_id || nothing_fits) return "";
  const std::int64_t value =
      type->type == BitField::Type::kSigned ? signed_value(step.value, type->bytes) : std::int64_t{step.value};
  if (entry.lowest.value_or(value) <= value && value <= entry.most.value_or(value)) return "";
  return fmt::format("start-up writes {} to {}, which takes {}{}{}", value, object_text(step.object, &entry),
                     entry.lowest ? fmt::format("{} (LowLimit)", *entry.lowest) : "",
                     entry.lowest && entry.most ? " to " : "",
                     entry.most ? fmt::format("{} (HighLimit)", *entry.most) : "");
}

/// The key by which the machine file takes what the device is delivered with; empty where none does.
std::string or_in_file(canopen::Object object, std::uint32_t delivered) {
  struct KeyOf {
    canopen::Object object;
    const char *table, *key;
    double unit, least, most;  ///< Of the object in the file's unit; what the file takes.
    bool of_all;               ///< The key is also that of other nodes.
  };
  constexpr std::array kKeys{
      KeyOf{canopen::kTiltResolution, "[sensors]", "tilt_step_deg", 1e-3, 0.006, 2, false},
      KeyOf{canopen::kEncoderStep, "[sensors]", "encoder_step_mm", 1e-6, 1e-4, 5, true},
      KeyOf{canopen::kEncoderSpeedStep, "[bus.wire]", "encoder_speed_step_mmps", 1e-2, 0.01, 10, true},
      KeyOf{canopen::kPressureDigits, "[bus.wire]", "pressure_digits", 1, 0, 4, true},
      KeyOf{canopen::kEncoderStepsPerTurn, "its table", "steps_per_turn", 1, 1 << 9, 1 << 24, false}};
  for (const KeyOf& one : kKeys) {
    const bool is_it = one.object.index == object.index &&
                       (one.object.subindex == object.subindex || one.object.index == canopen::kPressureDigits.index);
    const double value = one.unit * delivered;
    if (!is_it || value < one.least || value > one.most) continue;
    return fmt::format("; or in {} of the machine file {} = {}{}", one.table, one.key, number_text(value),
                       one.of_all ? ", where that is so of all such nodes" : "");
  }
  return "";
}

/// Why start-up would fail at this part; empty where it would not.
std::string obstacle_of(const DeviceFile& device, const slave::SetupPart& part, std::uint8_t id) {
  bool as_wanted = true;
  for (const slave::SdoStep& step : part.asked) {
    const Entry* entry = device.find(step.object);
    if (entry == nullptr)
      return fmt::format("start-up reads {}, which the device does not have", object_text(step.object, entry));
    if (entry->access == Access::kWriteOnly)
      return fmt::format("start-up reads {}, which can only be written", object_text(step.object, entry));
    const bool holds = entry->value && step.holds(entry->value->of(id));
    as_wanted = as_wanted && holds;
    if (part.written.empty() && !holds && entry->value && !entry->may_be_written()) {
      return fmt::format("{} must be {} and is always {}{}", object_text(step.object, entry), step.value,
                         entry->value->of(id), or_in_file(step.object, entry->value->of(id)));
    }
  }
  if (as_wanted) return "";
  for (const slave::SdoStep& step : part.written) {
    const Entry* entry = device.find(step.object);
    if (step.match == slave::SdoStep::Match::kPeriod && entry != nullptr && !entry->may_be_written() && entry->value)
      return fmt::format("{} must be {} and is always {} ms", object_text(step.object, entry), slave::period_text(step),
                         entry->value->of(id));
    if (entry == nullptr || !entry->may_be_written())
      return fmt::format("start-up writes {}, which can only be read", object_text(step.object, entry));
    if (std::string limits = limits_against(step, *entry); !limits.empty()) return limits;
  }
  return "";
}

/// Whether a PDO of the device has it as delivered.
bool is_mapped(const DeviceFile& device, std::uint32_t mapping) {
  return std::any_of(device.entries.begin(), device.entries.end(), [mapping](const auto& one) {
    return is_mapping(one.first) && one.second.value && one.second.value->number == std::int64_t{mapping};
  });
}

/// Why an object of the node's process data cannot be that; empty where it can.
std::string obstacle_of(const DeviceFile& device, const FrameField& mapped, bool to_node) {
  const Entry* entry = device.find(mapped.object);
  const std::string object = object_text(mapped.object, entry);
  if (entry == nullptr) return fmt::format("start-up maps {}, which the device does not have", object);
  if (to_node && !entry->may_be_written())
    return fmt::format(
        "{}: line {}: AccessType of {} is that of what can only be read; it must be told by process data",
        device.source, entry->line, object);
  if (!to_node && entry->access == Access::kWriteOnly)
    return fmt::format(
        "{}: line {}: AccessType of {} is that of what can only be written; it must be sent in process "
        "data",
        device.source, entry->line, object);
  if (!entry->mappable.value_or(true) && !is_mapped(device, canopen::mapping(mapped.object, mapped.bits.bits)))
    return fmt::format("{}: line {}: PDOMapping of {} is 0: start-up could not map it", device.source, entry->line,
                       object);
  const auto is_wanted = [&](const DataType& one) {
    return one.bytes * 8 == mapped.bits.bits && one.type == mapped.bits.type && one.number != kBoolean;
  };
  const DataType* const type = data_type(entry->data_type);
  const bool position = mapped.object == canopen::kEncoderPosition;  // signed or not: both are sold
  if (type != nullptr && (is_wanted(*type) || (position && type->bytes == 4 && type->type != BitField::Type::kFloat)))
    return "";
  const auto wanted = std::find_if(kDataTypes.begin(), kDataTypes.end(), is_wanted);
  return fmt::format("{}: line {}: DataType of {} is {}{}; start-up maps it as {} ({})", device.source,
                     entry->type_line, object, entry->data_type,
                     type != nullptr ? fmt::format(" ({})", type->name) : "", wanted->number, wanted->name);
}

}  // namespace

Fit fit_of(const DeviceFile& device, const MachineDescription& machine, const std::string& node) {
  const NodeDescription& named = named_node(machine.bus, node, machine.source);
  Fit fit;
  const int kbps = static_cast<int>(machine.bus.bit_rate / 1000);
  if (const auto& rates = device.bit_rates_kbps;
      !rates.empty() && std::find(rates.begin(), rates.end(), kbps) == rates.end())
    fit.obstacles.push_back(fmt::format("the bus has {} kbit/s, which the device does not know", kbps));
  const auto scripts = slave::node_scripts(machine);
  const auto script =
      std::find_if(scripts.begin(), scripts.end(), [&](const auto& one) { return one.node.name == named.name; });
  int guards = 0;
  bool guarded = false, by_timer = false;
  std::vector<std::string> not_set;
  for (const slave::SetupPart& part : script->script) {
    using Kind = slave::SetupPart::Kind;
    if (part.kind == Kind::kIdentity || part.kind == Kind::kOptional || part.kind == Kind::kProof) continue;
    if (part.kind == Kind::kTimer && !by_timer) continue;
    const std::string obstacle = obstacle_of(device, part, named.id);
    if (part.kind == Kind::kTransmission) {
      const Entry* type = device.find(part.asked[0].object);
      by_timer = !obstacle.empty() && type != nullptr && type->value && slave::by_own_timer(type->value->of(named.id));
      if (by_timer) continue;
    }
    if (part.kind == Kind::kGuard) {
      ++guards;
      guarded = guarded || obstacle.empty();
      if (!obstacle.empty()) not_set.push_back(obstacle);
    } else if (!obstacle.empty()) {
      fit.obstacles.push_back(obstacle);
    }
    if (part.kind != Kind::kRequire) continue;
    for (const slave::SdoStep& step : part.asked) {
      const Entry* entry = device.find(step.object);
      if (!obstacle.empty() || entry == nullptr || !entry->value || step.holds(entry->value->of(named.id))) continue;
      const std::uint32_t delivered = entry->value->of(named.id);
      fit.to_set.push_back(fmt::format("with its maker's tool set {} of the device to {}: it is delivered with {}{}",
                                       object_text(step.object, entry), step.value, delivered,
                                       or_in_file(step.object, delivered)));
    }
  }
  for (const BusFrame& frame : bus_frames(machine.bus, machine.sensors)) {
    if (machine.bus.nodes[frame.node].name != named.name) continue;
    for (const FrameField& field : frame.fields)
      if (const std::string obstacle = obstacle_of(device, field, frame.to_node); !obstacle.empty())
        fit.obstacles.push_back(obstacle);
  }
  if (guards > 0 && !guarded)
    fit.obstacles.push_back(
        fmt::format("it has no guard that start-up knows: without its controller it would not stop ({})",
                    fmt::join(not_set, "; ")));
  for (const std::string& obstacle : not_set)
    if (guarded) fit.notes.push_back("one of its two guards is not used: " + obstacle);
  return fit;
}

}  // namespace knuckle::eds
