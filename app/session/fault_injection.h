// Breaks things on purpose, as a scenario schedules it, and knows when the last good input came in: the moment from
// which the time to neutral counts.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "app/session/frame_log.h"
#include "app/session/scenario.h"
#include "app/session/session_sides.h"
#include "core/time.h"
#include "sim/machine_faults.h"
#include "transport/impaired_link.h"
#include "transport/link.h"

namespace knuckle::session {

struct Injected {
  ScheduledFault fault;
  Time at{};  ///< When it was broken.
  Time mended_at = Time::max();
  Time last_good_input{};  ///< Of the input it takes away.
};

class FaultInjection {
 public:
  /// @param network outlives this. @param bus as the machine file says.
  FaultInjection(std::vector<ScheduledFault> schedule, ImpairedLink& network, const BusDescription& bus);

  /// The operator's and the machine's end of the link, as master and slave are to use them.
  [[nodiscard]] Link& operator_end() noexcept { return operator_end_; }
  [[nodiscard]] Link& machine_end() noexcept { return machine_end_; }

  /// Breaks and mends what is due `in_phase` into the operator's phase number `phase`.
  void step(Time now, int phase, Duration in_phase, SimulatedMachineSide& far, HandSide& hand) noexcept;
  /// False while the slave loop hangs.
  [[nodiscard]] bool slave_runs() const noexcept { return !loop_hung_; }
  /// By so much the operator's clock is ahead of the machine's.
  [[nodiscard]] Duration operator_clock() const noexcept { return clock_ahead_; }
  [[nodiscard]] const std::vector<Injected>& injected() const noexcept { return injected_; }

 private:
  /// Master's end: passes set-points on, or spoils them.
  class OperatorEnd final : public Link {
   public:
    explicit OperatorEnd(Link& link) noexcept : link_(link) {}
    bool send(std::span<const std::uint8_t> bytes) noexcept override;
    bool receive(Datagram& datagram) noexcept override { return link_.receive(datagram); }
    bool spoil = false;

   private:
    Link& link_;
  };
  /// Slave's end: notes when a good set-point came in.
  class MachineEnd final : public Link {
   public:
    explicit MachineEnd(Link& link) noexcept : link_(link) {}
    bool send(std::span<const std::uint8_t> bytes) noexcept override { return link_.send(bytes); }
    bool receive(Datagram& datagram) noexcept override;
    Time now{}, last_good = kNever;
    std::optional<std::uint32_t> newest;  ///< Sequence: a copy or a late one is no news.

   private:
    Link& link_;
  };
  void set(const ScheduledFault& fault, bool broken, SimulatedMachineSide& far, HandSide& hand) noexcept;

  std::vector<ScheduledFault> schedule_;
  std::vector<bool> done_;
  std::vector<Injected> injected_;
  ImpairedLink& network_;
  OperatorEnd operator_end_;
  MachineEnd machine_end_;
  sim::MachineFaults machine_faults_;
  bool loop_hung_ = false;
  Duration clock_ahead_{};
};

}  // namespace knuckle::session
