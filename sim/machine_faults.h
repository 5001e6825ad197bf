// Breaks and mends what is behind the machine's bus, be the bus a virtual or a real one.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/time.h"
#include "machine/bus_description.h"
#include "sim/machine_on_bus.h"

namespace knuckle::sim {

// What can be broken on purpose, in scenarios and by `knuckle node`: one list for both.

/// By name in files and on the command line: name() and fault_named().
enum class FaultKind : std::uint8_t {
  // Link, device and loop.
  kLinkCut,          ///< no datagram passes, both ways
  kLinkCutBack,      ///< nothing comes back from the machine; set-points still arrive
  kLinkNaN,          ///< set-points arrive as not-a-number
  kLinkSlow,         ///< datagrams take longer and longer, both ways, up to kLinkSlowBy
  kLinkLossy,        ///< kLinkLossyShare of the machine's messages are lost
  kClockStep,        ///< the operator's clock jumps ahead by kClockStepBy, and back when mended
  kDeviceUnplugged,  ///< cable pulled
  kDeviceSilent,     ///< no reports
  kDeviceBadCrc,     ///< reports damaged
  kDeviceTruncated,  ///< reports end early
  kDeviceWild,       ///< encoder counts that stand for no angle
  kLoopHung,         ///< the slave loop does not run
  // The controller on the machine's bus.
  kBusOff,         ///< off the bus, until it is restarted
  kCanDown,        ///< its interface is taken down
  kNoAcknowledge,  ///< counts errors until it is error-passive; what it sends still arrives, as after many repeats
  // Behind the machine's bus: what nodes can be made to do wrong on a real one, too.
  kNodeSilent,       ///< its cable is off
  kNodeEmergency,    ///< one EMCY; its reset when mended
  kEmcyStorm,        ///< an EMCY every millisecond
  kNodeReset,        ///< reboots by itself and has lost its configuration
  kWrongIdentity,    ///< answers with another product code from its next start on
  kSensorFrozen,     ///< goes on sending its last value
  kSensorInvalid,    ///< sends the impossible value
  kEncoderBroken,    ///< wire snapped: the length runs to its end
  kValveStuck,       ///< the spool stays where it is
  kGuardDead,        ///< takes its guards' settings, but does not act by them
  kForeignSender,    ///< somebody else sends it set-points, 20 a second
  kNodeIdTwice,      ///< a second device has its node id and sends the same
  kEStop,            ///< E-stop chain of the machine opens
  kSyncDropped,      ///< no node receives SYNC
  kBusCut,           ///< cable cut between controller and nodes
  kOtherController,  ///< somebody else sends SYNC and the controller's heartbeat, 20 a second
  kBabble,           ///< a node fills the bus to 95 % with frames of the highest priority
  // Of a frame that the machine sends by itself, in the order of BroadcastFault.
  kFrameSilent,    ///< it does not come
  kFrameFrozen,    ///< it repeats itself, with its counter and checksum
  kValuesFrozen,   ///< its values, or one of them, stand; counter and checksum go on
  kValuesInvalid,  ///< they are sent as "not available", else as the highest that the bits can say
  kValuesSpike,    ///< they are far off in one frame
  kFrameChecksum,  ///< its checksum is wrong
  kFrameShort,     ///< it has a byte less
};
inline constexpr int kFaultKinds = 39;
inline constexpr Duration kLinkSlowBy =
    218ms;  ///< A round trip above the one at which cues take over, below the one at which the machine holds.
inline constexpr double kLinkLossyShare = 0.85;
inline constexpr Duration kClockStepBy = 10s;

[[nodiscard]] const char* name(FaultKind kind) noexcept;
[[nodiscard]] std::optional<FaultKind> fault_named(std::string_view name) noexcept;
/// With commas. @param of which; empty: of all.
[[nodiscard]] std::string fault_names(bool (*of)(FaultKind) = nullptr);

/// Nodes of a real bus can do it.
[[nodiscard]] bool behind_bus(FaultKind kind) noexcept;
/// It is about one node.
[[nodiscard]] bool concerns_node(FaultKind kind) noexcept;
/// It is about a frame that the machine sends by itself, or a value in it.
[[nodiscard]] bool concerns_frame(FaultKind kind) noexcept;
[[nodiscard]] BroadcastFault broadcast_fault(FaultKind kind) noexcept;
/// A frame, and the values in it that a fault is about, as a bit for each place in kSignals.
struct FrameSubject {
  std::size_t frame = 0;  ///< Place in BusDescription::broadcasts.
  std::uint64_t signals = ~std::uint64_t{0};
};
/// As a number: below kSignals.size() that of a value, above it that of a frame.
[[nodiscard]] std::optional<FrameSubject> subject_at(std::size_t number, const BusDescription& bus) noexcept;
/// @param name of a frame or a signal. @return the fault's subject; nullopt where the machine sends nothing so called.
[[nodiscard]] std::optional<std::uint8_t> frame_subject(const std::string& name, const BusDescription& bus) noexcept;
/// "front_angle, boom_angle, ...": for the line that refuses another name.
[[nodiscard]] std::string frame_subject_names(const BusDescription& bus);
/// It is about one bus where there are two.
[[nodiscard]] bool concerns_bus(FaultKind kind) noexcept;
/// Why this node of the bus, or what frame_subject() said, cannot have it; nullptr where it can.
[[nodiscard]] const char* why_not(FaultKind kind, std::uint8_t node, const BusDescription& bus) noexcept;

class MachineFaults {
 public:
  /// @param bus_loads share of each bus' time that its own frames take at worst.
  MachineFaults(const BusDescription& bus, const std::array<double, 2>& bus_loads) noexcept;

  /// @param kind one behind the bus; others do nothing. @param node that it concerns, or of two buses which, or
  /// frame_subject(); else 0.
  void set(FaultKind kind, std::uint8_t node, bool broken, MachineOnBus& far) noexcept;
  /// What has to be done again: every millisecond while it is broken.
  void keep_up(FaultKind kind, std::uint8_t node, MachineOnBus& far) noexcept;

 private:
  void send_foreign(FaultKind kind, std::uint8_t node, FaultyPort& port) noexcept;

  BusDescription bus_;
  std::array<int, 128> foreign_ms_{};  ///< By node: since somebody else's last frames to it; 0: the controller's.
  struct Babble {
    double bits_per_ms = 0, bits = 0;
    int babblers = 0;  ///< They share what is left of the bus.
  };
  std::array<Babble, 2> babble_{};  ///< On each bus.
};

}  // namespace knuckle::sim
