#include "slave/node_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/error.h"
#include "machine/description.h"

namespace knuckle::slave {
namespace {

using canopen::Object;
using Kind = SdoStep::Kind;

std::uint32_t milliseconds(double seconds) {
  return static_cast<std::uint32_t>(std::lround(seconds * 1e3));
}

SdoScript identity(const NodeDescription& node) {
  return {{Kind::kIdentity, canopen::kDeviceType, node.device_type, 4},
          {Kind::kIdentity, canopen::kVendorId, node.vendor, 4},
          {Kind::kIdentity, canopen::kProductCode, node.product, 4}};
}

void append(SdoScript& script, const SdoScript& more) {
  script.insert(script.end(), more.begin(), more.end());
}

/// A PDO may only be mapped while it is off (CiA 301): bit 31 of its COB-ID on, count 0, entries, count, type, on.
SdoScript pdo(Object cob_id_object, Object type, Object count, std::uint32_t cob_id, const canopen::PdoMap& map,
              std::uint8_t transmission) {
  SdoScript script{{Kind::kWrite, cob_id_object, cob_id | canopen::kPdoDisabled, 4}, {Kind::kWrite, count, 0, 1}};
  for (std::uint8_t i = 0; i < map.count; ++i) {
    script.push_back({Kind::kWrite, {count.index, static_cast<std::uint8_t>(i + 1)}, map.entries[i], 4});
  }
  append(script, {{Kind::kWrite, count, map.count, 1},
                  {Kind::kWrite, type, transmission, 1},
                  {Kind::kWrite, cob_id_object, cob_id, 4}});
  return script;
}

SdoScript tpdo(const NodeDescription& node, const canopen::PdoMap& map, std::uint8_t transmission) {
  return pdo(canopen::kTpdo1CobId, canopen::kTpdo1Type, canopen::kTpdo1MapCount, node.tpdo_id(), map, transmission);
}

SdoScript rpdo(const NodeDescription& node, const canopen::PdoMap& map) {
  return pdo(canopen::kRpdo1CobId, canopen::kRpdo1Type, canopen::kRpdo1MapCount, node.rpdo_id(), map,
             canopen::kEventDriven);
}

SdoStep produce_heartbeat(const BusDescription& bus) {
  return {Kind::kWrite, canopen::kProducerHeartbeat, milliseconds(bus.node_heartbeat_s), 2};
}

/// Nodes that can move something must notice by themselves when the controller is gone.
SdoStep watch_controller(const BusDescription& bus) {
  return {Kind::kWrite, canopen::kConsumerHeartbeat,
          std::uint32_t{bus.controller_id} << 16 | milliseconds(bus.controller_timeout_s), 4};
}

}  // namespace

SdoScript valve_script(const MachineDescription& machine, const NodeDescription& node) {
  SdoScript script = identity(node);
  script.push_back({Kind::kRequire, canopen::kValveControlMode, 1, 1});
  append(script, tpdo(node, canopen::kValveTpdo, static_cast<std::uint8_t>(machine.bus.valve_status_every_nth_sync)));
  append(script, rpdo(node, canopen::kValveRpdo));
  append(script, {{Kind::kWrite, canopen::kRpdo1Timer, milliseconds(machine.bus.valve_watchdog_s), 2},
                  watch_controller(machine.bus),
                  produce_heartbeat(machine.bus)});
  return script;
}

const canopen::PdoMap& pressure_map(const WireDescription& wire) noexcept {
  return wire.pressure_float ? canopen::kPressureFloatTpdo : canopen::kPressureTpdo;
}

SdoScript pressure_script(const MachineDescription& machine, const NodeDescription& node) {
  SdoScript script = identity(node);
  const WireDescription& wire = machine.bus.wire;
  script.push_back({Kind::kRequire, canopen::kPressureUnit, canopen::kUnitBar, 4});
  if (!wire.pressure_float) {
    script.push_back({Kind::kRequire, canopen::kPressureDigits, static_cast<std::uint32_t>(wire.pressure_digits), 1});
  }
  append(script, tpdo(node, pressure_map(wire), 1));
  script.push_back(produce_heartbeat(machine.bus));
  return script;
}

/// What is counted in steps must not be read in slightly other ones, nor run out of numbers.
void check_step(const MachineDescription& machine, const char* key, double step, double object, double most) {
  constexpr double kSame = 1e-6;
  const auto refuse = [&](const std::string& why) {
    throw InputError(machine.source + ": key 'sensors." + key + "': " + why);
  };
  const double units = step / object;
  if (std::abs(units - std::round(units)) > kSame * units)
    refuse("must be a whole number of the steps its node can be set to");
  if (step * std::numeric_limits<std::int16_t>::max() < most)
    refuse("too fine: its 16 bits would not reach far enough");
}

SdoScript encoder_script(const MachineDescription& machine, const NodeDescription& node) {
  SdoScript script = identity(node);
  check_step(machine, "encoder_step_mm", machine.sensors.encoder_step_m, 1e-9, 0);
  const std::uint32_t step = canopen::encoder_step_object(machine.sensors.encoder_step_m);
  const auto speed_step =
      static_cast<std::uint32_t>(std::lround(machine.bus.wire.encoder_speed_step_mps / 1e-5));  // 0.01 mm/s
  append(script, {{Kind::kRequire, canopen::kEncoderStep, step, 4},
                  {Kind::kRequire, canopen::kEncoderSpeedStep, speed_step, 4}});
  append(script, tpdo(node, canopen::kEncoderTpdo, 1));
  script.push_back(produce_heartbeat(machine.bus));
  return script;
}

SdoScript tilt_script(const MachineDescription& machine, const NodeDescription& node) {
  SdoScript script = identity(node);
  const bool on_boom = machine.sensors.tilt_mount == SensorDescription::TiltMount::kOnBoom;
  const double most_rad = on_boom ? std::numbers::pi : std::numbers::pi / 3;
  check_step(machine, "tilt_step_deg", machine.sensors.tilt_step_rad, 1e-3 * std::numbers::pi / 180, most_rad);
  script.push_back(
      {Kind::kRequire, canopen::kTiltResolution, canopen::tilt_step_object(machine.sensors.tilt_step_rad), 2});
  append(script, tpdo(node, canopen::kTiltTpdo, static_cast<std::uint8_t>(machine.bus.tilt_every_nth_sync)));
  script.push_back(produce_heartbeat(machine.bus));
  return script;
}

SdoScript enable_script(const MachineDescription& machine, const NodeDescription& node) {
  SdoScript script = identity(node);
  // Inputs at once when they change, and often enough to be supervised.
  append(script, tpdo(node, canopen::kEnableTpdo, canopen::kEventDriven));
  script.push_back({Kind::kWrite, canopen::kTpdo1Timer, milliseconds(machine.bus.controller_heartbeat_s), 2});
  append(script, rpdo(node, canopen::kEnableRpdo));
  append(script, {watch_controller(machine.bus), produce_heartbeat(machine.bus)});
  return script;
}

std::vector<NodeScript> node_scripts(const MachineDescription& machine) {
  const auto script_of = [&machine](const NamedNode& named) {
    switch (named.role) {
      case NodeRole::kValve:
        return valve_script(machine, named.node);
      case NodeRole::kPressure:
        return pressure_script(machine, named.node);
      case NodeRole::kEncoder:
        return encoder_script(machine, named.node);
      case NodeRole::kTilt:
        return tilt_script(machine, named.node);
      case NodeRole::kEnable:
        break;
    }
    return enable_script(machine, named.node);
  };
  std::vector<NodeScript> all;
  for (const NamedNode& named : named_nodes(machine.bus))
    all.push_back({named.role, named.joint, named.name, named.node, script_of(named)});
  return all;
}

SdoScript preset_script(const MachineDescription& machine, double length_m) {
  const auto steps = canopen::to_steps<std::int32_t>(length_m, machine.sensors.encoder_step_m);
  return {{Kind::kWrite, canopen::kEncoderPreset, static_cast<std::uint32_t>(steps), 4},
          {Kind::kWrite, canopen::kStoreParameters, canopen::kSaveSignature, 4}};
}

std::string text(const SetupFailure& failure) {
  if (failure.what == SetupFailure::What::kNone) return "";
  const SdoStep& step = failure.step;
  const char* doing = step.kind == Kind::kWrite ? "writing" : "reading";
  const std::string what =
      fmt::format("node 0x{:02X}: {} 0x{:04X}:{:02X} ", failure.node, doing, step.object.index, step.object.subindex);
  switch (failure.what) {
    case SetupFailure::What::kSilent:
      return what + "was not answered: check its power, cable and node id";
    case SetupFailure::What::kAborted:
      return what + fmt::format("was refused: {} (SDO abort 0x{:08X})", canopen::abort_text(failure.abort),
                                static_cast<unsigned>(failure.abort));
    case SetupFailure::What::kOtherValue:
      return what + fmt::format("gave 0x{:X}, the machine file says 0x{:X}", failure.seen, step.value);
    case SetupFailure::What::kNone:
      break;
  }
  return "";
}

void SdoDialogue::restart() noexcept {
  next_ = 0;
  asked_ = 0;
  asked_at_ = kNever;
  failure_ = {};
  details_ = {};
  requests_ = answers_ = 0;
  read_ = {};
  second_ = 0;
}

/// Another identity is another device; everything else is a set-up that did not work.
void SdoDialogue::fail(SetupFailure::What what) noexcept {
  const SdoStep& step = script_[next_];
  details_.what = what;
  details_.node = node_;
  details_.step = step;
  if (what == SetupFailure::What::kOtherValue && step.kind == Kind::kIdentity) {
    failure_ = {ReasonCode::kNodeIdentity, node_, static_cast<float>(details_.seen), static_cast<float>(step.value)};
  } else {
    failure_ = {ReasonCode::kNodeSetup, node_, static_cast<float>(next_), static_cast<float>(script_.size())};
  }
}

void SdoDialogue::step(CanBus& bus, Time now) noexcept {
  if (done() || failure_ || (asked_ > 0 && now - asked_at_ < timeout_)) return;
  const SdoStep& step = script_[next_];
  if (asked_ > 0) {
    // The node is told that its answer is not waited for any more (CiA 301), or it may take the next request for a
    // part of this one.
    bus.send(canopen::sdo_abandoned(node_, step.object, canopen::SdoAbort::kTimeout));
    if (asked_ == kSdoAttempts) return fail(SetupFailure::What::kSilent);
  }
  const bool sent =
      bus.send(step.kind == Kind::kWrite ? canopen::sdo_download(node_, step.object, step.value, step.size)
                                         : canopen::sdo_upload(node_, step.object));
  if (!sent) return;  // queue full: again in the next step
  ++requests_;
  ++asked_;
  asked_at_ = now;
}

/// One device answers a request once at most, be it late.
void SdoDialogue::count(const canopen::SdoResponse& answer) noexcept {
  if (++answers_ <= requests_) return;
  const bool other =
      answer.kind == canopen::SdoResponse::Kind::kUploaded && answer.object == read_ && answer.value != value_;
  second_ = std::min(2, second_ + (other ? 2 : 1));
}

void SdoDialogue::receive(const CanFrame& frame) noexcept {
  if (done() || requests_ == 0) return;
  const auto answer = canopen::parse_sdo_response(frame);
  if (!answer) return;
  count(*answer);
  const SdoStep& step = script_[next_];
  if (failure_ || asked_ == 0 || answer->object != step.object) return;  // a late answer to an earlier attempt
  using Answer = canopen::SdoResponse::Kind;
  const bool written = step.kind == Kind::kWrite && answer->kind == Answer::kDownloaded;
  const bool read = step.kind != Kind::kWrite && answer->kind == Answer::kUploaded;
  if (!written && !read) {
    details_.abort = answer->kind == Answer::kAborted ? answer->abort : canopen::SdoAbort::kUnknownCommand;
    return fail(SetupFailure::What::kAborted);
  }
  if (read) {
    read_ = answer->object;
    value_ = answer->value;
  }
  if (read && answer->value != step.value) {
    details_.seen = answer->value;
    return fail(SetupFailure::What::kOtherValue);
  }
  ++next_;
  asked_ = 0;
}

}  // namespace knuckle::slave
