// What the machine's side tells of itself a few times a second beside the newest SlaveMessage: what a person watches,
// and which machine it is, which alone is acted on: another one is not led. A datagram of its own on the same link; who
// does not know it drops it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "core/joints.h"
#include "core/time.h"
#include "transport/link.h"
#include "transport/link_stamp.h"

namespace knuckle {

/// A machine's name as it travels: printable ASCII (? for anything else), cut to 31, zeros behind it.
class MachineName {
 public:
  static constexpr std::size_t kSize = 32;
  MachineName() noexcept = default;
  explicit MachineName(std::string_view name) noexcept;
  [[nodiscard]] std::string_view text() const noexcept;
  bool operator==(const MachineName&) const noexcept = default;

 private:
  std::array<char, kSize> bytes_{};
};

/// Machine to operator, 20 Hz. All values SI.
struct MachineStatus {
  /// How late or how long, of the steps of the last 10 s.
  struct Timing {
    Duration p50{}, p99{}, max{};
  };
  LinkStamp stamp;
  JointVector valve_command = JointVector::Zero();  ///< After the gate, [-1, 1].
  JointVector spool = JointVector::Zero();          ///< As the valves report, [-1, 1].
  bool pilot_on = false;                            ///< As the enable node reports.
  double oil_flow_m3ps = 0;                         ///< What the cylinders take from the pump, from their speeds.
  double hydraulic_power_W = 0;                     ///< That flow times the pressures it works against.
  Timing wake_lateness, execution;                  ///< Of the machine's loop.
  Duration period{};                                ///< It is meant to keep.
  std::uint64_t steps = 0, overruns = 0;            ///< Since its start.
  std::uint8_t fifo_priority = 0;                   ///< Granted; 0: no real-time class.
  double bus_load = 0;           ///< Share of the CAN bus taken by what the controller sends and hears.
  std::uint32_t can_errors = 0;  ///< Error frames and frames lost, since the start.
  /// device_report_at of the set-point that is on the valves' wire now; kNever: none is.
  /// Hand to valve = arrival of this here - acted_report_at - acted_ago - the way back (half a round trip).
  Time acted_report_at = kNever;
  Duration acted_ago{};           ///< From that valve frame to sent_at.
  std::uint8_t force_doubts = 0;  ///< estimation::ConfidenceReason bits: why the tip force is known no better.
  MachineName machine;            ///< That it drives: nobody leads it as another one.
  bool simulated = false;         ///< There is no real machine behind it.
  bool calibrated = false;        ///< Its dynamics have been identified; else forces are those of a drawing.
};

[[nodiscard]] Datagram encode(const MachineStatus& status) noexcept;
/// nullopt where size, magic or version is wrong, or a number not finite or beyond anything honest.
[[nodiscard]] std::optional<MachineStatus> decode_status(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace knuckle
