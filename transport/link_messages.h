// What operator and machine tell each other: the only place where master and slave meet. Little-endian, versioned,
// newest sequence wins (32-bit serial arithmetic). All values SI.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "transport/link.h"
#include "transport/link_header.h"

namespace knuckle {

/// The speed of a set-point is low-passed by its sender, first order, at this.
inline constexpr double kSetPointRateCutoff_Hz = 30;

namespace wire {
inline constexpr double kMostAngle_rad = 10, kMostRate_radps = 200;
inline constexpr double kMostForce_N = 1e8, kMostPressure_Pa = 1e10, kMostMass_kg = 1e9;
}  // namespace wire

/// Modes of a session, decided by the slave (it owns the valves), shown by both.
enum class Mode : std::uint8_t { kOff, kSelfTest, kReady, kAligning, kEngaged, kHold, kFault, kEStop };
[[nodiscard]] const char* name(Mode mode) noexcept;
[[nodiscard]] constexpr unsigned number_of_words(Mode) noexcept {
  return static_cast<unsigned>(Mode::kEStop) + 1;
}
/// Somebody leads the machine, holds it, or is about to: nothing that changes how it feels may be changed.
[[nodiscard]] constexpr bool led(Mode mode) noexcept {
  return mode == Mode::kAligning || mode == Mode::kEngaged || mode == Mode::kHold;
}

/// What the operator has switched on to help.
struct AssistSettings {
  double force_limit_N = 0;     ///< Tip speed into a contact fades to zero at this tip force; 0: off.
  bool stop_on_object = false;  ///< Digging holds when the bucket meets something much stiffer than soil.
};

/// Operator to machine, 500 Hz, and at once when a stop or a release of enable is noticed.
struct MasterMessage {
  LinkStamp stamp;
  Time device_report_at{};  ///< Clock of the stamp, when the device report behind this set-point came in.
  /// How often Stop was pressed and enable released since the sender's start. Every later message says it too, so
  /// neither gets lost or overtaken, however short it was.
  std::uint32_t stops = 0, releases = 0;
  bool presence = false;                             ///< A hand is on the device.
  bool enable = false;                               ///< Dead-man held.
  bool clutch = false;                               ///< Indexing: machine waits while the hand returns.
  bool stop = false;                                 ///< Software stop.
  bool device_ok = false;                            ///< The device is there, calibrated, without fault.
  Reason device_reason;                              ///< Why device_ok is false.
  JointVector position_rad = JointVector::Zero();    ///< Machine joint set-point, clutch offset included.
  JointVector velocity_radps = JointVector::Zero();  ///< Of the set-point, low-passed at kSetPointRateCutoff_Hz.
  PlanarVector rendered_N =
      PlanarVector::Zero();  ///< Of a contact on the hand, without cues and load; machine scale, frame M.
  AssistSettings assist;

  /// In the order of its bytes.
  template <typename Self, typename Visit>
  static void fields(Self& m, Visit&& visit) {
    [[maybe_unused]] const auto& [stamp, device_report_at, stops, releases, presence, enable, clutch, stop, device_ok,
                                  device_reason, position_rad, velocity_radps, rendered_N, assist] = m;
    [[maybe_unused]] const auto& [force_limit_N, stop_on_object] = m.assist;
    visit("stamp", m.stamp);
    visit("device_report_at_ns", m.device_report_at);
    visit("stops", m.stops);
    visit("releases", m.releases);
    visit("presence", m.presence);
    visit("enable", m.enable);
    visit("clutch", m.clutch);
    visit("stop", m.stop);
    visit("device_ok", m.device_ok);
    visit("assist_stop_on_object", m.assist.stop_on_object);
    visit("device_reason", m.device_reason);
    visit("position_rad", m.position_rad, wire::within(wire::kMostAngle_rad));
    visit("velocity_radps", m.velocity_radps, wire::within(wire::kMostRate_radps));
    visit("rendered_N", m.rendered_N, wire::cut(wire::kMostForce_N));
    visit("assist_force_limit_N", m.assist.force_limit_N, wire::Single{0, wire::kMostForce_N});
  }
};

/// Bits of SlaveMessage::limits and of the safety gate: nothing is limited silently.
enum LimitFlag : std::uint16_t {
  kLimitMagnitude = 1 << 0,
  kLimitRate = 1 << 1,
  kLimitJointRange = 1 << 2,
  kLimitVirtualWall = 1 << 3,
  kLimitPressure = 1 << 4,
  kLimitPower = 1 << 5,
  kLimitPumpFlow = 1 << 6,
  kLimitVelocity = 1 << 7,
  kLimitAssistForce = 1 << 8,
  kLimitForceCeiling = 1 << 9,
  kLimitHome = 1 << 10,
};
inline constexpr unsigned kLimitBits = 0x7FF;  ///< All of them; others are refused.
/// What the flag of this bit limits, such as "pump flow"; nullptr behind the last.
[[nodiscard]] const char* limit_word(unsigned bit) noexcept;

/// Machine to operator, 200 Hz.
struct SlaveMessage {
  LinkStamp stamp;
  /// Clock of the stamp, when the newest sensor frame behind what was measured came in: it stands still while only some
  /// sensors are sound, as pose, pressures and force do.
  Time sensor_at{};
  Mode mode = Mode::kOff;
  Reason blocking;                                 ///< Why not engaged, or what limits.
  Reason fault;                                    ///< The latched fault.
  JointVector position_rad = JointVector::Zero();  ///< Measured joints.
  JointVector velocity_radps = JointVector::Zero();
  /// How far the set-point is ahead of the measured joints, as late as tip_force_N.
  JointVector ahead_rad = JointVector::Zero();
  PlanarVector tip_force_N =
      PlanarVector::Zero();  ///< Force of the world on the bucket tip, frame M (x forward, z up), without the load.
  PlanarVector load_N = PlanarVector::Zero();  ///< Weight of the carried load, which tip_force_N leaves out.
  std::array<double, 3> covariance_N2{};       ///< xx, xz, zz of tip_force_N.
  double confidence = 0;                       ///< [0, 1]
  double contact_compliance = 0;               ///< [0, 1]: what the tip presses against moves along with it.
  bool contact = false;                        ///< ForceEstimate::contact.
  bool home_offered = false;  ///< A cylinder's transmitters failed: a HomeMessage is taken for an answer ...
  bool home_on_two = false;   ///< ... and was: slow, without that cylinder's pressures, until the program starts anew.
  std::uint16_t limits = 0;   ///< LimitFlag bits being hit.
  std::array<double, 6> pressure_Pa{};  ///< boom A, B, arm A, B, bucket A, B.
  double payload_kg = 0;
  double payload_sigma_kg = 0;
  double tip_torque_Nm = 0, tip_torque_sigma_Nm = 0;    ///< About the tip, of the world on the bucket.
  std::array<double, 2> force_torque_covariance_N2m{};  ///< Of tip_force_N (x, z) and that torque.
  std::array<double, 6> touched_share{};  ///< Of the bucket's sides, counter-clockwise from the tip: probabilities.
  std::uint8_t unknown_torques = 0;       ///< 1 boom, 2 arm, 4 bucket: nobody measures that cylinder's pressures.

  /// In the order of its bytes.
  template <typename Self, typename Visit>
  static void fields(Self& m, Visit&& visit) {
    [[maybe_unused]] const auto& [stamp, sensor_at, mode, blocking, fault, position_rad, velocity_radps, ahead_rad,
                                  tip_force_N, load_N, covariance_N2, confidence, contact_compliance, contact,
                                  home_offered, home_on_two, limits, pressure_Pa, payload_kg, payload_sigma_kg,
                                  tip_torque_Nm, tip_torque_sigma_Nm, force_torque_covariance_N2m, touched_share,
                                  unknown_torques] = m;
    visit("stamp", m.stamp);
    visit("sensor_at_ns", m.sensor_at);
    visit("mode", m.mode);
    visit("blocking", m.blocking);
    visit("fault", m.fault);
    visit("position_rad", m.position_rad, wire::within(wire::kMostAngle_rad));
    visit("velocity_radps", m.velocity_radps, wire::within(wire::kMostRate_radps));
    visit("ahead_rad", m.ahead_rad, wire::within(wire::kMostAngle_rad));
    visit("tip_force_N", m.tip_force_N, wire::cut(wire::kMostForce_N));
    visit("load_N", m.load_N, wire::cut(wire::kMostForce_N));
    visit("covariance_N2", m.covariance_N2, wire::cut(wire::kMostForce_N * wire::kMostForce_N));
    visit("confidence", m.confidence, wire::Within{0, 1});
    visit("contact_compliance", m.contact_compliance, wire::Within{0, 1});
    visit("contact", m.contact);
    visit("home_offered", m.home_offered);
    visit("home_on_two", m.home_on_two);
    visit("limits", m.limits, wire::Bits{kLimitBits});
    visit("pressure_Pa", m.pressure_Pa, wire::within(wire::kMostPressure_Pa));
    visit("payload_kg", m.payload_kg, wire::within(wire::kMostMass_kg));
    visit("payload_sigma_kg", m.payload_sigma_kg, wire::Within{0, wire::kMostMass_kg});
    visit("tip_torque_Nm", m.tip_torque_Nm, wire::cut(wire::kMostForce_N));
    visit("tip_torque_sigma_Nm", m.tip_torque_sigma_Nm, wire::Cut{0, wire::kMostForce_N});
    visit("force_torque_covariance_N2m", m.force_torque_covariance_N2m,
          wire::cut(wire::kMostForce_N * wire::kMostForce_N));
    visit("touched_share", m.touched_share, wire::Within{0, 1});
    visit("unknown_torques", m.unknown_torques, wire::Bits{7});
  }
};

/// Operator to machine, 100 Hz while the operator asks for it by an act of its own: go on without the pressures of the
/// cylinder whose transmitters failed. Taken only of the one that is offered.
struct HomeMessage {
  LinkStamp stamp;
  std::uint8_t cylinder = 0;  ///< As SlaveMessage::unknown_torques tells it: 1 boom, 2 arm, 4 bucket.

  /// In the order of its bytes.
  template <typename Self, typename Visit>
  static void fields(Self& m, Visit&& visit) {
    [[maybe_unused]] const auto& [stamp, cylinder] = m;
    visit("stamp", m.stamp);
    visit("cylinder", m.cylinder, wire::Bits{7});
  }
};

[[nodiscard]] Datagram encode(const MasterMessage& message) noexcept;
[[nodiscard]] Datagram encode(const SlaveMessage& message) noexcept;
[[nodiscard]] Datagram encode(const HomeMessage& message) noexcept;
/// nullopt where size, magic or version is wrong, or a field not acceptable (link_header.h).
[[nodiscard]] std::optional<MasterMessage> decode_master(std::span<const std::uint8_t> bytes) noexcept;
[[nodiscard]] std::optional<SlaveMessage> decode_slave(std::span<const std::uint8_t> bytes) noexcept;
[[nodiscard]] std::optional<HomeMessage> decode_home(std::span<const std::uint8_t> bytes) noexcept;
/// After a silence of so long the machine's side may have begun anew, for the operator's side.
inline constexpr Duration kRestartSilence = 1s;

}  // namespace knuckle
