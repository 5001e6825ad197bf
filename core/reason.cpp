#include "core/reason.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <utility>

#include "core/frame_words.h"
#include "core/joints.h"

namespace knuckle {
namespace {

struct Entry {
  const char* name;
  SubjectKind subject;
  const char* text;  // without values
  const char* unit;  // nullptr: value and limit are not shown
};

constexpr float kNeverYet_ms = 1e9F;  // no age but that of kNever is so long

// In the order of ReasonCode.
constexpr std::array<Entry, static_cast<std::size_t>(ReasonCode::kCount)> kEntries{{
    {"none", SubjectKind::kNothing, "nothing blocks", nullptr},
    {"starting_up", SubjectKind::kNothing, "self test is running: wait", nullptr},
    {"no_presence", SubjectKind::kNothing, "no hand on the device: take hold of it", nullptr},
    {"enable_not_pressed", SubjectKind::kNothing, "press enable", nullptr},
    {"enable_held", SubjectKind::kNothing, "enable was held too early: release it, then press again", nullptr},
    {"hand_not_aligned", SubjectKind::kJoint, "hand is away from the machine: move it or use the clutch", "deg"},
    {"hand_moving", SubjectKind::kJoint, "hand moves: hold it still to engage", "rad/s"},
    {"machine_moving", SubjectKind::kJoint, "machine still moves: wait", "rad/s"},
    {"clutch_held", SubjectKind::kNothing, "clutch held: the machine holds, release the clutch to continue", nullptr},
    {"round_trip_too_long", SubjectKind::kNothing, "round trip too long: machine holds", "ms"},
    {"buried_object", SubjectKind::kNothing,
     "the bucket has met something stiff: release enable, look, then press again", "kN/m"},
    {"release_to_recover", SubjectKind::kNothing, "fault is over: release enable, then press again", nullptr},
    {"link_lost", SubjectKind::kNothing, "no new packet over the link: check the network", "ms"},
    {"sensor_stale", SubjectKind::kNodeOrSignal, "sensor has stopped sending: check node and cable", "ms"},
    {"sensor_invalid", SubjectKind::kNodeOrSignal, "sensor sends an impossible value: check sensor and wiring", "raw"},
    {"sensor_implausible", SubjectKind::kNodeOrSignal, "sensor contradicts the others: check mounting and wiring",
     nullptr},
    {"node_silent", SubjectKind::kNode, "heartbeat is missing: check node power and bus", "ms"},
    {"node_emergency", SubjectKind::kNode, "node reports an emergency, code in decimal: see its manual", "code"},
    {"node_fault", SubjectKind::kNode, "node is no longer operational: check it, then start again", nullptr},
    {"node_identity", SubjectKind::kNode,
     "node is not the one named in the machine file: put that one back, or correct the file", "id"},
    {"node_setup", SubjectKind::kNode, "node refused its configuration or did not answer: check its power and cable",
     "step"},
    {"valve_not_following", SubjectKind::kJoint, "spool does not follow its command: check the valve", "of stroke"},
    {"command_invalid", SubjectKind::kJoint, "controller gave an invalid command: release enable, then press again",
     "of stroke"},
    {"setpoint_invalid", SubjectKind::kJoint, "operator set-point is invalid: release enable, then press again", "rad"},
    {"pressure_limit", SubjectKind::kChamber, "pressure beyond its limit: reduce the load", "bar"},
    {"bus_down", SubjectKind::kBus,
     "CAN interface is down or gone: plug in its adapter, set it up (ip link set NAME up)", nullptr},
    {"device_lost", SubjectKind::kNothing, "haptic device is disconnected: plug it in, then align again", nullptr},
    {"device_stale", SubjectKind::kNothing, "haptic device has stopped reporting: check its cable", "ms"},
    {"device_report", SubjectKind::kNothing, "haptic device sends damaged or impossible reports: check cable",
     "in a row"},
    {"device_fault", SubjectKind::kNothing, "haptic device reports a fault, bits in decimal: see its manual", "bits"},
    {"loop_overrun", SubjectKind::kNothing, "control loop did not run in time: close other programs on its computer",
     "ms"},
    {"emergency_stop", SubjectKind::kNothing, "E-stop of the machine is open: release it on the machine", nullptr},
    {"operator_stop", SubjectKind::kNothing, "stop was pressed: release enable, then press again", nullptr},
    {"presence_lost", SubjectKind::kNothing, "hand left the device: take hold of it, then press enable again", nullptr},
    {"energy_watchdog", SubjectKind::kNothing, "force feedback reduced: it returned more energy than the hand put in",
     "J"},
    {"joint_limit", SubjectKind::kJoint, "end of the working range: move the other way", "deg"},
    {"virtual_wall", SubjectKind::kNothing, "virtual wall: move the bucket away from it", "m"},
    {"power_limit", SubjectKind::kNothing, "hydraulic power limited: move fewer joints or slower", "kW"},
    {"assist_force", SubjectKind::kNothing, "force limit of the assist: move away, or set it higher", "N"},
    {"pilot_off", SubjectKind::kNothing,
     "no pilot pressure although the machine is enabled: check the enable node and the E-stop", nullptr},
    {"assist_force_unknown", SubjectKind::kNothing,
     "force limit of the assist: force unknown, machine holds; switch the limit off to continue", nullptr},
    {"device_identity", SubjectKind::kNothing, "haptic device is not the one of its file: see knuckle doctor --device",
     nullptr},
    {"bus_off", SubjectKind::kBus,
     "CAN was bus-off: repair the wiring, restart the controller, then press and release enable", nullptr},
    {"bus_passive", SubjectKind::kBus, "CAN frames are damaged or not acknowledged: check node power, cable, bit rate",
     nullptr},
    {"pilot_awaited", SubjectKind::kNothing,
     "pilot pressure is rising: if it does not arrive, check the enable node and the E-stop", nullptr},
    {"other_machine", SubjectKind::kNothing,
     "machine's side drives another machine: give the same --machine on both sides", nullptr},
    {"machine_not_told", SubjectKind::kNothing,
     "machine's side does not say which machine it drives: run the same version on both sides", nullptr},
    {"setpoint_range", SubjectKind::kJoint,
     "set-point beyond the working range: release enable, give the same --machine on both sides, then press again",
     "deg"},
    {"setpoint_speed", SubjectKind::kJoint,
     "set-point faster than a hand moves: release enable, check haptic device and link, then press again", "rad/s"},
    {"setpoint_jump", SubjectKind::kJoint,
     "set-point jumps, or its speed contradicts its position: release enable, check haptic device and link, then press "
     "again",
     "deg"},
    {"jog_other_moves", SubjectKind::kJoint,
     "cylinder moved without a command: valves, hoses or encoders are exchanged, or a load holding valve leaks", "mm"},
    {"jog_too_long", SubjectKind::kNothing, "motion takes too long: check pump, engine speed and pilot pressure", "s"},
    {"pilot_stays_on", SubjectKind::kNothing,
     "pilot pressure is still on after it was switched off: check the enable valve before anything else", nullptr},
    {"force_ceiling", SubjectKind::kNothing, "presses no harder than the machine file allows: move away", "N"},
    {"cues_delay", SubjectKind::kNothing,
     "round trip too long for felt forces: contact is only signalled, work slowly or use a faster link", "ms"},
    {"cues_silence", SubjectKind::kNothing, "machine is not heard: no force is felt, stop and check the network", "ms"},
    {"cues_loss", SubjectKind::kNothing,
     "link loses too much for felt forces: contact is only signalled, check the network", "%"},
    {"cues_estimate", SubjectKind::kNothing,
     "force of the machine is not known: contact is only signalled, move the arm in free air", "%"},
    {"motor_heat", SubjectKind::kNothing, "force feedback reduced: the device's motors are hot, press less for a while",
     "%"},
    {"length_elsewhere", SubjectKind::kNodeOrSignal,
     "length jumped and stands still: look at the machine; if the new one is right, press and release enable", "mm"},
    {"device_unpowered", SubjectKind::kNothing,
     "haptic device drives no motor: check its supply and its E-stop, then press enable again", nullptr},
    {"frame_short", SubjectKind::kNodeOrSignal, "process data is too short to be used: check the node's PDO mapping",
     "bytes"},
    {"other_controller", SubjectKind::kNothing, "another controller is on the bus: stop one of the two", nullptr},
    {"foreign_sender", SubjectKind::kNode, "another sender on the bus commands this node: find it and take it off",
     nullptr},
    {"node_id_twice", SubjectKind::kNode, "two devices send under this node id: take one off, or give it another id",
     nullptr},
    {"force_unknown", SubjectKind::kNothing,
     "with a cylinder's pressures missing, the force is not known in this pose: bend the bucket or the arm first", "N"},
    {"home_offered", SubjectKind::kJoint,
     "pressures failed: to go home slowly without them hold the clutch for 3 s; to try them again press and release "
     "enable",
     nullptr},
    {"home_pressed", SubjectKind::kJoint,
     "something may be pressed, so the machine does not go on without its pressures: repair the transmitter", nullptr},
    {"motion_not_following", SubjectKind::kJoint,
     "does not move as it was told: check its valve, its position sensor and the machine's own controller", nullptr},
    {"group_twice", SubjectKind::kNodeOrSignal,
     "two devices send its parameter group: take one off, or give the frame's source in the machine file", nullptr},
    {"address_lost", SubjectKind::kNothing,
     "another device has the J1939 address that commands go out from: give them one that nobody has, then start again",
     nullptr},
}};

const Entry& entry(ReasonCode code) noexcept {
  const auto index = static_cast<std::size_t>(code);
  return kEntries[index < kEntries.size() ? index : 0];
}

/// What the node of a node_fault says that it is: its NMT state (CiA 301) where the limit is that of an operational
/// one, else its valve's status word (CiA 408).
std::string node_state_text(const Reason& reason) {
  constexpr int kOperational = 5;
  if (!(reason.value >= 0 && reason.value <= 0xFFFF && reason.limit >= 0 && reason.limit <= 0xFFFF)) return "";
  const auto state = static_cast<int>(reason.value);
  if (static_cast<int>(reason.limit) != kOperational) return fmt::format(" (its valve's status is 0x{:04X})", state);
  constexpr std::array<std::pair<int, const char*>, 3> kStates{
      {{0, "has started anew"}, {4, "is stopped"}, {127, "is pre-operational"}}};
  for (const auto& [known, words] : kStates) {
    if (state == known) return fmt::format(" (it {})", words);
  }
  return fmt::format(" (its state is {})", state);
}

/// What another sender sent.
std::string foreign_text(const Reason& reason) {
  if (!(reason.value >= 0 && reason.value <= 0x7FF)) return "";
  return " (heard: " + controllers_frame_text(static_cast<std::uint32_t>(reason.value)) + ")";
}

/// Of a frame that does not count.
std::string void_text(const Reason& reason) {
  if (reason.limit == kCounterStands)
    return "the counter of its frame stands: what sends it hangs and repeats its last frame, or does not count as the "
           "machine file says";
  return "the checksum of its frame is wrong: check cable and termination, and its checksum in the machine file";
}

std::string twice_text(const Reason& reason) {
  if (reason.value == 2 && reason.limit == 1) return " (two answers to one request)";
  return fmt::format(" ({:.0f} frames where {:.0f} are due)", double(reason.value), double(reason.limit));
}

unsigned address_of(float value) {
  return value >= 0 && value <= 0xFF ? static_cast<unsigned>(value) : 0xFF;
}

/// Three digits, but whole thousands and codes in full: 1213, not 1.21e+03.
std::string number_text(float value) {
  const bool in_full = std::abs(value) < 1e6F && (value == std::floor(value) || std::abs(value) >= 1000);
  return in_full ? fmt::format("{:.0f}", double(value)) : fmt::format("{:.3g}", double(value));
}

}  // namespace

const char* name(ReasonCode code) noexcept {
  return entry(code).name;
}

SubjectKind subject_kind(ReasonCode code) noexcept {
  return entry(code).subject;
}

std::optional<std::size_t> signal_of(const Reason& reason) noexcept {
  constexpr std::uint8_t kFirst = signal_subject(0);
  if (subject_kind(reason.code) != SubjectKind::kNodeOrSignal || reason.subject < kFirst) return std::nullopt;
  return static_cast<std::size_t>(reason.subject - kFirst);
}

std::string subject_text(const Reason& reason) {
  constexpr std::array<const char*, 6> kChambers{"boom head side", "boom rod side",    "arm head side",
                                                 "arm rod side",   "bucket head side", "bucket rod side"};
  const std::uint8_t subject = reason.subject;
  switch (entry(reason.code).subject) {
    case SubjectKind::kNothing:
      return "";
    case SubjectKind::kJoint:
      return subject < kJoints ? kJointNames[subject] : "joint ?";
    case SubjectKind::kNode:
    case SubjectKind::kNodeOrSignal:
      if (const auto place = signal_of(reason)) return fmt::format("signal {}", *place);
      return fmt::format("node 0x{:02X}", subject);
    case SubjectKind::kChamber:
      return subject < kChambers.size() ? kChambers[subject] : "chamber ?";
    case SubjectKind::kBus:
      return subject == 0 ? "" : fmt::format("bus {}", subject + 1);
  }
  return "";
}

std::string text(const Reason& reason) {
  return text_about(subject_text(reason), reason);
}

std::string text_about(const std::string& subject, const Reason& reason) {
  const Entry& e = entry(reason.code);
  std::string line = (subject.empty() ? "" : subject + ": ") + e.text;
  if (reason.code == ReasonCode::kSensorInvalid && reason.limit < 0) return subject + ": " + void_text(reason);
  if (reason.code == ReasonCode::kNodeFault) return line + node_state_text(reason);
  if (reason.code == ReasonCode::kFrameShort)
    return line + fmt::format(" (frame has {:.0f} bytes, {:.0f} are mapped)", reason.value, reason.limit);
  if (reason.code == ReasonCode::kOtherController || reason.code == ReasonCode::kForeignSender)
    return line + foreign_text(reason);
  if (reason.code == ReasonCode::kNodeIdTwice) return line + twice_text(reason);
  if (reason.code == ReasonCode::kGroupTwice)
    return line + fmt::format(" (0x{:02X} beside 0x{:02X})", address_of(reason.value), address_of(reason.limit));
  if (reason.code == ReasonCode::kAddressLost) return line + fmt::format(" (0x{:02X})", address_of(reason.value));
  if (e.unit != nullptr && std::strcmp(e.unit, "ms") == 0 && reason.value > kNeverYet_ms) return line + " (never yet)";
  if (e.unit != nullptr) {
    line +=
        " (" + number_text(reason.value) + " " + e.unit + "; limit " + number_text(reason.limit) + " " + e.unit + ")";
  }
  return line;
}

std::string text_with_code(const Reason& reason) {
  return std::string(name(reason.code)) + ": " + text(reason);
}

}  // namespace knuckle
