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
#include "transport/can_bus.h"
#include "transport/link.h"
#include "transport/link_header.h"

namespace knuckle {

/// A machine's name as it travels: printable ASCII (? for anything else), cut to 31, zeros behind it.
class MachineName {
 public:
  static constexpr std::size_t kSize = 32;
  MachineName() noexcept = default;
  explicit MachineName(std::string_view name) noexcept;
  [[nodiscard]] std::string_view text() const noexcept;
  bool operator==(const MachineName&) const noexcept = default;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("name", self.bytes_, wire::Text{});
  }

 private:
  std::array<char, kSize> bytes_{};
};

/// Machine to operator, 20 Hz. All values SI.
struct MachineStatus {
  /// How late or how long, of the steps of the last 10 s.
  struct Timing {
    Duration p50{}, p99{}, max{};

    template <typename Self, typename Visit>
    static void fields(Self& self, Visit&& visit) {
      [[maybe_unused]] const auto& [p50, p99, max] = self;
      visit("p50_ns", self.p50);
      visit("p99_ns", self.p99);
      visit("max_ns", self.max);
    }
  };
  /// Of a CAN bus, by the controller's end.
  struct Bus {
    double load = 0;  ///< Share of its time taken by what the controller sends and hears.
    CanState state = CanState::kActive;

    template <typename Self, typename Visit>
    static void fields(Self& self, Visit&& visit) {
      [[maybe_unused]] const auto& [load, state] = self;
      visit("load", self.load, wire::Cut{0, 10});
      visit("state", self.state);
    }
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
  std::array<Bus, 2> buses;                         ///< In the order of the machine file, which names them.
  std::uint32_t can_errors = 0;                     ///< Of all buses: error frames and frames lost, since the start.
  /// device_report_at of the set-point that is on the valves' wire now; kNever: none is.
  /// Hand to valve = arrival of this here - acted_report_at - acted_ago - the way back (half a round trip).
  Time acted_report_at = kNever;
  Duration acted_ago{};            ///< From that valve frame to sent_at.
  std::uint16_t force_doubts = 0;  ///< estimation::ConfidenceReason bits: why the tip force is known no better.
  MachineName machine;             ///< That it drives: nobody leads it as another one.
  bool simulated = false;          ///< There is no real machine behind it.
  bool calibrated = false;         ///< Its dynamics have been identified; else forces are those of a drawing.

  /// In the order of its bytes.
  template <typename Self, typename Visit>
  static void fields(Self& s, Visit&& visit) {
    [[maybe_unused]] const auto& [stamp, valve_command, spool, pilot_on, oil_flow_m3ps, hydraulic_power_W,
                                  wake_lateness, execution, period, steps, overruns, fifo_priority, buses, can_errors,
                                  acted_report_at, acted_ago, force_doubts, machine, simulated, calibrated] = s;
    constexpr double kMostOpening = 1e3;  // of spool stroke, as a valve may report it
    visit("stamp", s.stamp);
    visit("valve_command", s.valve_command, wire::cut(kMostOpening));
    visit("spool", s.spool, wire::cut(kMostOpening));
    visit("pilot_on", s.pilot_on);
    visit("simulated", s.simulated);
    visit("calibrated", s.calibrated);
    visit("oil_flow_m3ps", s.oil_flow_m3ps, wire::Cut{0, 1e3});
    visit("hydraulic_power_W", s.hydraulic_power_W, wire::Cut{0, 1e12});
    visit("wake_lateness", s.wake_lateness);
    visit("execution", s.execution);
    visit("period_ns", s.period);
    visit("steps", s.steps);
    visit("overruns", s.overruns);
    visit("fifo_priority", s.fifo_priority, wire::Within{0, 99});
    visit("bus", s.buses[0]);
    visit("second_bus", s.buses[1]);
    visit("can_errors", s.can_errors);
    visit("acted_report_at_ns", s.acted_report_at);
    visit("acted_ago_ns", s.acted_ago);
    visit("force_doubts", s.force_doubts);
    visit("machine", s.machine);
  }
};

[[nodiscard]] Datagram encode(const MachineStatus& status) noexcept;
/// nullopt where size, magic or version is wrong, or a field not acceptable (link_header.h).
[[nodiscard]] std::optional<MachineStatus> decode_status(std::span<const std::uint8_t> bytes) noexcept;

}  // namespace knuckle
