// What the machine's side tells of itself beside every SlaveMessage: gathered around the slave loop, which knows
// nothing of it, and sent 20 times a second.
#pragma once

#include <cstdint>

#include "core/joints.h"
#include "core/loop_health.h"
#include "core/mailbox.h"
#include "core/time.h"
#include "estimation/joint_state.h"
#include "machine/description.h"
#include "slave/slave_loop.h"
#include "transport/can_bus.h"
#include "transport/can_load.h"
#include "transport/link.h"
#include "transport/machine_status.h"

namespace knuckle::slave {

struct OilDemand {
  double flow_m3ps = 0;
  double power_W = 0;
};
/// What moving cylinders take from the pump, and the power of it.
/// @param spool actual, [-1, 1], positive = extend.
[[nodiscard]] OilDemand oil_demand(const MachineDescription& machine, const estimation::JointState& state,
                                   const JointVector& spool) noexcept;

class StatusReporter {
 public:
  static constexpr Duration kPeriod = 50ms;
  static constexpr std::uint32_t kEveryNthReadings = 20;  ///< What changes slowly: with every n-th status.

  /// All outlive this. @param bus, @param meter, @param link of the loop; the meter is read here alone.
  /// @param simulated whether the bus is that of a simulation, as far as the program knows.
  /// @param health of the thread that steps the loop, read in that thread; null: the loop has no real time.
  StatusReporter(const MachineDescription& machine, const CanBus& bus, CanMeter& meter, Link& link, bool simulated,
                 Mailbox<LoopHealth>* health = nullptr) noexcept;

  /// After every step of the loop, in its thread.
  void step(Time now, const SlaveLoop& slave) noexcept;
  /// The last one told.
  [[nodiscard]] const MachineStatus& sent() const noexcept { return status_; }

 private:
  void note_acted(Time now, const SlaveLoop& slave) noexcept;
  void forget_acted(Time now, const SlaveLoop& slave) noexcept;
  void note_health() noexcept;

  const MachineDescription& machine_;
  const CanBus& bus_;
  CanMeter& meter_;
  Link& link_;
  Mailbox<LoopHealth>* mailbox_;
  LoopHealth health_;
  MachineStatus status_;
  bool has_readings_ = false;
  Time due_ = kNever, set_points_at_ = kNever;
};

}  // namespace knuckle::slave
