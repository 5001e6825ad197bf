// Why something is refused, limited or stopped: one code, what it concerns, the value seen and its bound. The same
// small struct crosses the link, sits in the fault record and becomes the one line an operator can act on.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "core/time.h"

namespace knuckle {

enum class ReasonCode : std::uint16_t {
  kNone = 0,
  // Not yet (blocking reasons): the operator can act on each.
  kStartingUp,        ///< self test still running
  kNoPresence,        ///< no hand on the device
  kEnableNotPressed,  ///< enable must be pressed after ready
  kEnableHeld,        ///< enable was held before ready: release it first
  kHandNotAligned,    ///< subject: joint; value, limit in deg
  kHandMoving,        ///< subject: joint; rad/s
  kMachineMoving,     ///< subject: joint; rad/s
  kClutchHeld,        ///< the operator holds the clutch: machine waits
  kRoundTripTooLong,  ///< ms
  kBuriedObject,      ///< assist: digging met something stiff; kN/m
  kReleaseToRecover,  ///< latched fault gone: release enable, then press again
  // Faults: each latches and is neutral on the wire.
  kLinkLost,           ///< ms since the last newer packet
  kSensorStale,        ///< subject: node id or signal; age in ms
  kSensorInvalid,      ///< subject: node id or signal; non-finite, out of range, status bad; limit < 0: frame_words.h
  kSensorImplausible,  ///< subject: node id or signal; sensors contradict each other; value in the unit of the rule
  kNodeSilent,         ///< subject: node id; heartbeat missing, ms
  kNodeEmergency,      ///< subject: node id; value: EMCY error code
  kNodeFault,          ///< subject: node id; valve left ACTIVE or reports a fault
  kNodeIdentity,       ///< subject: node id; identity differs from the machine file
  kNodeSetup,          ///< subject: node id; SDO abort or time-out during start-up
  kValveNotFollowing,  ///< subject: joint; |spool - demand| as a fraction
  kCommandInvalid,     ///< subject: joint; non-finite or out of mode
  kSetpointInvalid,    ///< subject: joint; operator set-point non-finite or future-stamped
  kPressureLimit,      ///< subject: cylinder chamber 0..5; bar
  kBusDown,            ///< subject: bus; CAN interface down or gone
  kDeviceLost,         ///< haptic device unplugged
  kDeviceStale,        ///< ms since the last good report
  kDeviceReport,       ///< malformed reports: NaN-like, CRC, version; value: count
  kDeviceFault,        ///< fault word of the device
  kLoopOverrun,        ///< a loop did not run for value ms
  kEmergencyStop,      ///< E-stop chain of the machine open
  kOperatorStop,       ///< Stop pressed by the operator
  kPresenceLost,       ///< hand left the device while engaged
  kEnergyWatchdog,     ///< force lowered: returned minus put-in energy in J
  // What the safety gate limits (no faults): the operator feels or sees it.
  kJointLimit,          ///< subject: joint; deg
  kVirtualWall,         ///< subject: 0 floor, 1 ceiling, 2 reach (no joint); m
  kPowerLimit,          ///< kW
  kAssistForce,         ///< assist: force limit set by the operator; N
  kPilotOff,            ///< machine enable gives no pilot pressure
  kAssistForceUnknown,  ///< assist: no force is known to hold against the limit
  kDeviceIdentity,      ///< fault: the haptic device is not the one its file describes
  // More of the bus' faults.
  kBusOff,        ///< subject: bus; CAN controller went bus-off; stays until an operator acknowledges it
  kBusPassive,    ///< subject: bus; CAN controller error-passive: frames are not acknowledged, or most are damaged
  kPilotAwaited,  ///< engaging: pilot pressure was requested and is not there yet
  // The two sides do not fit together: not led at all.
  kOtherMachine,    ///< the machine's side drives another machine than the operator's side leads
  kMachineNotTold,  ///< the machine's side does not report which machine it drives
  // Set-points that no hand can make: the machine holds until enable is released.
  kSetpointRange,  ///< subject: joint; deg
  kSetpointSpeed,  ///< subject: joint; rad/s
  kSetpointJump,   ///< subject: joint; deg that the speeds sent do not explain, or no hand's speed does
  // First motions of a machine, one valve at a time.
  kJogOtherMoves,  ///< subject: joint that was not commanded; mm
  kJogTooLong,     ///< s
  kPilotStaysOn,   ///< switched off, and still on
  // Another limit (no fault).
  kForceCeiling,  ///< what the tip may press by the machine file; N
  // The link or the estimate is sick: cues instead of a force.
  kCuesDelay,     ///< ms
  kCuesSilence,   ///< ms since the last newer message
  kCuesLoss,      ///< % of the machine's messages that came too late or not at all
  kCuesEstimate,  ///< confidence in %
  kMotorHeat,     ///< force lowered to what the device's motors bear; % of the wanted
  // Another fault.
  kLengthElsewhere,  ///< subject: node id or signal; an encoder stands still elsewhere than it was; mm
  kDeviceUnpowered,  ///< the haptic device drives no motor although it is asked to
  kFrameShort,       ///< subject: node id or signal; bytes of its process data frame, bytes mapped
  // Who else speaks on the bus.
  kOtherController,  ///< value: identifier of a frame that only the controller sends, and another one sent
  kForeignSender,    ///< subject: node id that was commanded or written to; value: the frame's identifier
  kNodeIdTwice,      ///< subject: node id; frames seen, frames due (1: answers to one SDO request)
  // A cylinder whose pressures nobody measures (no fault).
  kForceUnknown,  ///< two torques do not tell the force in this pose: no advance that way; 95 % interval in N
  // A cylinder whose transmitters failed (slave/home_on_two.h).
  kHomeOffered,  ///< subject: joint; the operator acknowledged it and may choose to go on without its pressures
  kHomePressed,  ///< subject: joint; not chosen: something may be pressed
  // A machine whose valves do not tell where their spools are.
  kMotionNotFollowing,  ///< subject: joint; by its angle or length it does not move as it was told
  // J1939.
  kGroupTwice,   ///< subject: signal; addresses of the second and the first sender of its parameter group
  kAddressLost,  ///< another device has the address that commands go out from; value: the address
  kCount,
};

/// What a Reason's subject counts.
enum class SubjectKind : std::uint8_t {
  kNothing,
  kJoint,
  kNode,          ///< Node id, at most 127.
  kNodeOrSignal,  ///< Node id; or, where a node has several signals and one is meant, signal_subject().
  kChamber,       ///< 0...5
  kBus,           ///< Of two buses 0 or 1; else 0.
};
[[nodiscard]] SubjectKind subject_kind(ReasonCode code) noexcept;

struct Reason {
  ReasonCode code = ReasonCode::kNone;
  std::uint8_t subject = 0;
  float value = 0;  ///< What was seen, in the unit the code's text names.
  float limit = 0;  ///< Its bound, same unit.
  constexpr Reason() noexcept = default;
  template <std::integral Subject = int>
  constexpr Reason(ReasonCode why, Subject about = 0, double seen = 0, double bound = 0) noexcept
      : code(why),
        subject(static_cast<std::uint8_t>(about)),
        value(static_cast<float>(seen)),
        limit(static_cast<float>(bound)) {}
  explicit operator bool() const noexcept { return code != ReasonCode::kNone; }
};

/// The subject that names a signal: above all node ids. @param place in kSignals (machine/bus_description.h)
[[nodiscard]] constexpr std::uint8_t signal_subject(std::size_t place) noexcept {
  return static_cast<std::uint8_t>(0x80 + place);
}
/// Place in kSignals of the signal that the reason names; nullopt where it names none.
[[nodiscard]] std::optional<std::size_t> signal_of(const Reason& reason) noexcept;

/// Whether both say the same of the same subject, whatever was measured: one standing reason, not a new event.
[[nodiscard]] constexpr bool same_cause(const Reason& a, const Reason& b) noexcept {
  return a.code == b.code && a.subject == b.subject;
}

/// Stable identifier for files and JSON, such as "link_lost".
[[nodiscard]] const char* name(ReasonCode code) noexcept;
// Words. They allocate: not for loops. Nodes and signals are numbers here; where the machine is known,
// machine/reason_text.h names them.

/// What the reason is about: "arm", "node 0x30"; empty where its code has no subject.
[[nodiscard]] std::string subject_text(const Reason& reason);
/// One line a person can act on, such as "arm: hand is 7.2 deg from the machine; limit 5 deg".
[[nodiscard]] std::string text(const Reason& reason);
/// The same with the subject in the caller's words.
[[nodiscard]] std::string text_about(const std::string& subject, const Reason& reason);
/// text() behind its identifier, for logs: "hand_not_aligned: arm: hand is ...".
[[nodiscard]] std::string text_with_code(const Reason& reason);

}  // namespace knuckle
