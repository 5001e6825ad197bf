#include "sim/fault_kinds.h"

#include <algorithm>
#include <array>

namespace knuckle::sim {
namespace {

/// In the order of FaultKind.
constexpr std::array<const char*, kFaultKinds> kNames{
    "link_cut",      "link_cut_back",    "link_nan",       "link_slow",      "link_lossy",
    "clock_step",    "device_unplugged", "device_silent",  "device_bad_crc", "device_truncated",
    "device_wild",   "loop_hung",        "bus_off",        "can_down",       "no_acknowledge",
    "node_silent",   "node_emergency",   "emcy_storm",     "node_reset",     "wrong_identity",
    "sensor_frozen", "sensor_invalid",   "encoder_broken", "valve_stuck",    "foreign_sender",
    "node_id_twice", "e_stop",           "sync_dropped",   "bus_cut",        "other_controller",
    "babble"};

bool is_one_of(const PerJoint<NodeDescription>& nodes, std::uint8_t id) noexcept {
  return std::any_of(nodes.begin(), nodes.end(), [id](const NodeDescription& node) { return node.id == id; });
}

}  // namespace

const char* name(FaultKind kind) noexcept {
  return kNames[static_cast<std::size_t>(kind)];
}

std::optional<FaultKind> fault_named(std::string_view name) noexcept {
  const auto* const found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<FaultKind>(found - kNames.begin());
}

std::string fault_names(bool (*of)(FaultKind)) {
  std::string names;
  for (int i = 0; i < kFaultKinds; ++i) {
    const auto kind = static_cast<FaultKind>(i);
    if (of == nullptr || of(kind)) names += (names.empty() ? "" : ", ") + std::string(name(kind));
  }
  return names;
}

bool behind_bus(FaultKind kind) noexcept {
  return kind >= FaultKind::kNodeSilent;
}

bool concerns_node(FaultKind kind) noexcept {
  return kind >= FaultKind::kNodeSilent && kind <= FaultKind::kNodeIdTwice;
}

const char* why_not(FaultKind kind, std::uint8_t node, const BusDescription& bus) noexcept {
  switch (kind) {
    case FaultKind::kValveStuck:
      return is_one_of(bus.valves, node) ? nullptr : "only a valve can be stuck";
    case FaultKind::kForeignSender:
      return is_one_of(bus.valves, node) ? nullptr : "only a valve has set-points";
    case FaultKind::kEncoderBroken:
      return is_one_of(bus.encoders, node) ? nullptr : "only an encoder has a wire";
    case FaultKind::kSensorFrozen:
    case FaultKind::kSensorInvalid:
      return node != bus.enable.id ? nullptr : "the enable node cannot do that";
    default:
      return nullptr;
  }
}

}  // namespace knuckle::sim
