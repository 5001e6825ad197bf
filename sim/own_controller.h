// The controller that a machine has by itself, where frames tell it what to do: it moves pilot valves as they say, or
// keeps the joints' speeds. When the frames stop, it closes all valves. Pilot valves on a module's outputs do as those
// say, at once.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/joints.h"
#include "core/time.h"
#include "machine/arm_description.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "sim/pilot_stage.h"
#include "sim/truth.h"
#include "transport/can_bus.h"

namespace knuckle::sim {

class OwnController {
 public:
  explicit OwnController(const MachineDescription& machine);

  /// @param from_bus else it is what a module's outputs do; what the bus says to a module is not for this controller.
  void hear(const CanFrame& frame, Time now, bool from_bus = true) noexcept;
  /// What its own sensors say.
  struct Seen {
    JointVector joint_rad = JointVector::Zero();
    JointVector cylinder_mps = JointVector::Zero();  ///< The signs: whether joints extend their cylinders.
    JointVector lever_m = JointVector::Zero();       ///< Of the cylinders on their joints.
    std::array<double, 6> pressure_Pa{};             ///< boom A, B, arm A, B, bucket A, B
  };
  /// @param supplied nothing else takes the pilot pressure away.
  void step(Time now, const Seen& seen, bool supplied = true) noexcept;
  /// Of these valves, as its makers measured them on this machine: their edges.
  void measured(const PerJoint<ValveRoughness>& valves) noexcept;
  void set_estop(bool pressed) noexcept { estop_ = pressed; }

  [[nodiscard]] JointVector spool_demand() const noexcept { return stage_.driven(spool_demand_); }
  /// Pilot pressure: all that must be said for it is being said, and nothing is missing.
  [[nodiscard]] bool pilot() const noexcept { return pilot_; }
  [[nodiscard]] PilotStage& pilots() noexcept { return stage_; }
  [[nodiscard]] const PilotStage& pilots() const noexcept { return stage_; }

 private:
  static constexpr Duration kPeriod = 10ms;
  struct Heard {
    CommandFrame frame;
    CanFrame newest{};
    Time at = kNever;
    std::optional<std::uint64_t> count{};
  };
  /// Of one joint, as the controller's makers measured it.
  struct Axis {
    ValveDescription valve;  ///< With the curve of its edges.
    double valve_gain = 0;   ///< Flow at full opening is this times sqrt(drop).
    double head_m2 = 0, rod_m2 = 0;
    double lever_m = 1;               ///< Of the cylinder on its joint, in this place.
    std::array<double, 2> load_Pa{};  ///< Head and rod side, smoothed: what swings on its oil is not followed.
    double last_rad = 0, rate_radps = 0;
    double sum = 0;  ///< Of the opening, for what its speed lacks; forgotten when it turns back.
    std::size_t way = 0;
  };
  [[nodiscard]] bool fresh(Time now) const noexcept;
  [[nodiscard]] bool led() const noexcept;
  [[nodiscard]] double asked(int joint) const noexcept;
  [[nodiscard]] double full_opening_radps(const Axis& axis, bool extend) const noexcept;
  void control(Time now, const Seen& seen) noexcept;
  [[nodiscard]] double spool_for(Axis& axis, int joint, double share) noexcept;

  CommandKind kind_;
  Duration patience_;
  double margin_Pa_, relief_Pa_;  ///< Of the pump: over the highest load, and at most.
  std::vector<Heard> frames_;     // sized once, at construction
  PerJoint<Axis> axes_{};
  std::array<JointVector, 2> full_rate_radps_{JointVector::Zero(), JointVector::Zero()};
  JointVector spool_demand_ = JointVector::Zero();
  PilotStage stage_;
  Time stepped_at_ = kNever, controlled_at_ = kNever;
  bool estop_ = false, pilot_ = false;
};

}  // namespace knuckle::sim
