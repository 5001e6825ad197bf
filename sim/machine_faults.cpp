#include "sim/machine_faults.h"

#include <algorithm>

#include "transport/can_load.h"
#include "transport/canopen.h"

namespace knuckle::sim {
namespace {

/// In the order of FaultKind.
constexpr std::array<const char*, kFaultKinds> kNames{
    "link_cut",         "link_cut_back",  "link_nan",       "link_slow",        "link_lossy",     "clock_step",
    "device_unplugged", "device_silent",  "device_bad_crc", "device_truncated", "device_wild",    "loop_hung",
    "bus_off",          "can_down",       "no_acknowledge", "node_silent",      "node_emergency", "emcy_storm",
    "node_reset",       "wrong_identity", "sensor_frozen",  "sensor_invalid",   "encoder_broken", "valve_stuck",
    "guard_dead",       "foreign_sender", "node_id_twice",  "e_stop",           "sync_dropped",   "bus_cut",
    "other_controller", "babble",         "frame_silent",   "frame_frozen",     "values_frozen",  "values_invalid",
    "values_spike",     "frame_checksum", "frame_short"};

bool is(NodeRole role, std::uint8_t id, const BusDescription& bus) noexcept {
  const NodeDescription* const node = bus.find(id);
  return node != nullptr && node->role == role;
}

}  // namespace

std::optional<FrameSubject> subject_at(std::size_t number, const BusDescription& bus) noexcept {
  for (std::size_t frame = 0; frame < bus.broadcasts.size(); ++frame) {
    const BroadcastFrame& sent = bus.broadcasts[frame];
    if (sent.module != 0) continue;
    if (number == kSignals.size() + frame) return FrameSubject{.frame = frame};
    for (const BroadcastField& field : sent.fields)
      if (field.signal == number) return FrameSubject{frame, std::uint64_t{1} << number};
  }
  return std::nullopt;
}

namespace {

const char* name_of(std::size_t number, const BusDescription& bus) noexcept {
  return number < kSignals.size() ? kSignals[number].name : bus.broadcasts[number - kSignals.size()].name.c_str();
}
static_assert(kSignals.size() <= 64);

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

bool concerns_frame(FaultKind kind) noexcept {
  return kind >= FaultKind::kFrameSilent;
}

BroadcastFault broadcast_fault(FaultKind kind) noexcept {
  constexpr int kFirst = static_cast<int>(FaultKind::kFrameSilent);
  return static_cast<BroadcastFault>(static_cast<int>(kind) - kFirst + static_cast<int>(BroadcastFault::kSilent));
}

std::optional<std::uint8_t> frame_subject(const std::string& name, const BusDescription& bus) noexcept {
  for (std::size_t number = 0; number < kSignals.size() + bus.broadcasts.size(); ++number)
    if (subject_at(number, bus) && name == name_of(number, bus)) return static_cast<std::uint8_t>(number);
  return std::nullopt;
}

std::string frame_subject_names(const BusDescription& bus) {
  std::string all;
  for (std::size_t number = 0; number < kSignals.size() + bus.broadcasts.size(); ++number)
    if (subject_at(number, bus)) all += (all.empty() ? "" : ", ") + std::string(name_of(number, bus));
  return all.empty() ? "none: this machine sends no frames by itself" : all;
}

bool concerns_bus(FaultKind kind) noexcept {
  return kind == FaultKind::kBusOff || kind == FaultKind::kCanDown || kind == FaultKind::kNoAcknowledge ||
         kind == FaultKind::kBusCut || kind == FaultKind::kBabble;
}

const char* why_not(FaultKind kind, std::uint8_t node, const BusDescription& bus) noexcept {
  switch (kind) {
    case FaultKind::kValveStuck:
      return is(NodeRole::kValve, node, bus) ? nullptr : "only a valve can be stuck";
    case FaultKind::kGuardDead:
      return bus.find(node) != nullptr && bus.find(node)->is_told() ? nullptr : "only a node that is told has guards";
    case FaultKind::kForeignSender:
      return is(NodeRole::kValve, node, bus) ? nullptr : "only a valve has set-points";
    case FaultKind::kEncoderBroken:
      return is(NodeRole::kEncoder, node, bus) ? nullptr : "only an encoder has a wire";
    case FaultKind::kSensorFrozen:
    case FaultKind::kSensorInvalid:
      if (is(NodeRole::kModule, node, bus))
        return std::any_of(bus.broadcasts.begin(), bus.broadcasts.end(),
                           [node](const BroadcastFrame& frame) { return frame.module == node; })
                   ? nullptr
                   : "only a module with inputs can do that";
      return node != bus.enable().id ? nullptr : "the enable node cannot do that";
    case FaultKind::kFrameChecksum: {
      const auto subject = subject_at(node, bus);
      return subject && bus.broadcasts[subject->frame].closing.checksum ? nullptr : "the frame has no checksum";
    }
    default:
      return nullptr;
  }
}

namespace {

constexpr double kBabbledLoad = 0.95;
constexpr int kForeignPeriod_ms = 50;
constexpr CanFrame kBabbled{.id = 0x001, .size = 8, .data = {}};  // before all but NMT

}  // namespace

MachineFaults::MachineFaults(const BusDescription& bus, const std::array<double, 2>& bus_loads) noexcept : bus_(bus) {
  for (std::size_t on = 0; on < bus.lines(); ++on)
    babble_[on].bits_per_ms = 1e-3 * bus.line(on).bit_rate * std::max(0.0, kBabbledLoad - bus_loads[on]);
}

void MachineFaults::set(FaultKind kind, std::uint8_t node, bool broken, MachineOnBus& far) noexcept {
  SimulatedMachine& machine = far.machine();
  FaultyPort& port = far.nodes_end();
  if (const auto subject = concerns_frame(kind) ? subject_at(node, bus_) : std::nullopt)
    return machine.nodes().inject_broadcast(subject->frame, broken ? broadcast_fault(kind) : BroadcastFault::kNone,
                                            subject->signals);
  const auto inject = [&](NodeFault fault) { machine.inject(node, broken ? fault : NodeFault::kNone); };
  switch (kind) {
    case FaultKind::kNodeSilent:
      return inject(NodeFault::kSilent);
    case FaultKind::kSensorFrozen:
      return inject(NodeFault::kFrozen);
    case FaultKind::kSensorInvalid:
      return inject(NodeFault::kInvalid);
    case FaultKind::kEncoderBroken:
      return inject(NodeFault::kBrokenWire);
    case FaultKind::kValveStuck:
      return inject(NodeFault::kStuck);
    case FaultKind::kGuardDead:
      return inject(NodeFault::kDeadGuard);
    case FaultKind::kEmcyStorm:
      if (!broken) machine.send_emcy(node, canopen::kEmcyReset);
      return;
    case FaultKind::kNodeEmergency:
      machine.send_emcy(node, broken ? canopen::kEmcyDeviceSpecific : canopen::kEmcyReset);
      return;
    case FaultKind::kNodeReset:
      if (broken) port.whisper(canopen::nmt_frame(canopen::NmtCommand::kResetNode, node));
      return;
    case FaultKind::kWrongIdentity:
      if (auto* there = machine.nodes().node(node)) {
        const std::uint32_t product = there->value(canopen::kProductCode);
        machine.nodes().set_product(node, product ^ 1U);  // twice is the right one again
      }
      return;
    case FaultKind::kNodeIdTwice:
      return port.double_node(node, broken);
    case FaultKind::kEStop:
      return machine.set_estop(broken);
    case FaultKind::kSyncDropped:
      return port.drop_sync(broken);
    case FaultKind::kBusCut:
      return port.cut(broken, node & 1U);
    case FaultKind::kBabble:
      babble_[node & 1U].babblers += broken ? 1 : -1;
      return;
    default:
      return;
  }
}

void MachineFaults::keep_up(FaultKind kind, std::uint8_t node, MachineOnBus& far) noexcept {
  if (kind == FaultKind::kEmcyStorm) far.machine().send_emcy(node, canopen::kEmcyDeviceSpecific);
  if (kind == FaultKind::kOtherController || kind == FaultKind::kForeignSender)
    send_foreign(kind, node, far.nodes_end());
  if (kind != FaultKind::kBabble) return;
  Babble& babble = babble_[node & 1U];
  CanFrame frame = kBabbled;
  if ((node & 1U) != 0) frame.id |= kSecondBus;
  for (babble.bits += babble.bits_per_ms / babble.babblers; babble.bits >= worst_case_bits(frame.size);
       babble.bits -= worst_case_bits(frame.size)) {
    far.nodes_end().shout(frame);
  }
}

void MachineFaults::send_foreign(FaultKind kind, std::uint8_t node, FaultyPort& port) noexcept {
  const bool controller = kind == FaultKind::kOtherController;
  if (++foreign_ms_[controller ? 0 : node & 0x7FU] % kForeignPeriod_ms != 0) return;
  if (controller) {
    port.shout(canopen::heartbeat_frame(bus_.controller_id, canopen::NmtState::kOperational));
    port.shout(canopen::sync_frame());
    return;
  }
  if (const NodeDescription* const valve = bus_.find(node)) {
    for (const NodeChannel& axis : valve->channels)
      port.shout({.id = valve->rpdo_id(axis.pdo()), .size = 4, .data = {canopen::kControlActive}});
  }
}

}  // namespace knuckle::sim
