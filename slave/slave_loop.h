// The machine's side of a session, 200 times a second: newest sensors, joint state, external force, newest operator
// set-point, loss policy, mode, joint control, safety gate, valves, and what the operator is told of it.
#pragma once

#include <cstdint>
#include <optional>

#include "core/filters.h"
#include "core/joints.h"
#include "core/reason.h"
#include "core/time.h"
#include "estimation/buried_object.h"
#include "estimation/force_estimator.h"
#include "estimation/joint_state.h"
#include "estimation/payload.h"
#include "machine/description.h"
#include "machine/pilot_spool.h"
#include "slave/canopen_client.h"
#include "slave/home_on_two.h"
#include "slave/j1939_bus.h"
#include "slave/joint_control.h"
#include "slave/modes.h"
#include "slave/motion_monitor.h"
#include "slave/operator_input.h"
#include "slave/pilot_monitor.h"
#include "slave/plausibility.h"
#include "slave/safety_gate.h"
#include "slave/sensors.h"
#include "slave/unseen_spool.h"
#include "slave/valve_monitor.h"
#include "transport/can_bus.h"
#include "transport/link.h"
#include "transport/link_messages.h"

namespace knuckle::slave {

class SlaveLoop {
 public:
  /// Bus and link must outlive the loop. @param start drawn anew for each loop.
  /// @throws InputError where the machine file cannot be worked with.
  SlaveLoop(const MachineDescription& machine, CanBus& bus, Link& link, const LinkStart& start);

  /// One period of 1 / sync_Hz. A gap beyond the valves' watchdog is a fault (kLoopOverrun).
  void step(Time now) noexcept;

  // What the last step knew and did.
  [[nodiscard]] Mode mode() const noexcept { return decision_.state.mode; }
  /// Why not engaged, or what limits an engaged machine.
  [[nodiscard]] const Reason& blocking() const noexcept;
  /// The latched fault.
  [[nodiscard]] const Reason& fault() const noexcept { return decision_.state.fault; }
  /// nullopt until all sensors have been heard, and while a value makes no joint angle.
  [[nodiscard]] const std::optional<estimation::JointState>& state() const noexcept { return state_; }
  /// The newest state, also after what it was made of has gone; zero before the first.
  [[nodiscard]] const estimation::JointState& newest_state() const noexcept { return newest_state_; }
  [[nodiscard]] const estimation::ForceEstimate& force() const noexcept { return force_.estimate(); }
  /// Of that force, [0, 1]; 0 where it rests on no usable sensors, whatever the estimator made of the last ones.
  [[nodiscard]] double confidence() const noexcept { return state_ && !sensor_fault_ ? force().confidence : 0; }
  [[nodiscard]] const estimation::PayloadEstimator& payload() const noexcept { return payload_; }
  /// The newest message, its set-point and its age.
  [[nodiscard]] const OperatorInput& operator_input() const noexcept { return operator_; }
  [[nodiscard]] const JointVector& wanted() const noexcept { return wanted_; }                   ///< Before the gate.
  [[nodiscard]] const JointVector& commands() const noexcept { return gate_.commands.value(); }  ///< After it.
  /// Of set-point control and gate: LimitFlag bits.
  [[nodiscard]] std::uint16_t limits() const noexcept {
    return static_cast<std::uint16_t>(gate_.limits | control_output_.limits);
  }
  [[nodiscard]] const JointControl::Output& control_output() const noexcept { return control_output_; }
  /// As the operator's side was told in the step at `now`.
  [[nodiscard]] SlaveMessage message(Time now) const noexcept;
  [[nodiscard]] const CanopenClient& client() const noexcept { return client_; }
  [[nodiscard]] const SensorSet& sensors() const noexcept { return sensors_; }
  [[nodiscard]] const J1939Bus& j1939() const noexcept { return j1939_; }
  /// Of the valves, [-1, 1]: as they tell; where they do not, where they should be by their pilot pressures, or, where
  /// nobody tells these, by what they were told.
  [[nodiscard]] const JointVector& spool() const noexcept {
    return client_.spools_seen() ? client_.spool() : unseen_spool_.value();
  }
  // As the enable node says, or the machine by itself.
  [[nodiscard]] bool e_stop_open() const noexcept {
    return client_.e_stop_open() || !sensors_.e_stop_closed().value_or(true);
  }
  /// True where nobody tells.
  [[nodiscard]] bool pilot_on() const noexcept {
    return client_.bus().has_enable() ? client_.pilot_on() : sensors_.pilot_on().value_or(!sensors_.tells_pilot());
  }
  [[nodiscard]] const HomeOnTwo& home() const noexcept { return home_; }
  [[nodiscard]] const JointControl& control() const noexcept { return control_; }
  /// Cumulative energy that the world put into the moving arm, while led and as far as the force is significant; only
  /// grows.
  [[nodiscard]] double energy_in_J() const noexcept { return energy_in_J_; }

 private:
  static constexpr double kVelocityCutoff_Hz = 10;  ///< Of the joint rates for control.
  static constexpr double kRestCutoff_Hz = 1;       ///< Of the rates that decide whether the machine is at rest.
  static constexpr Duration kRestartAfter = 1s;     ///< Nodes that failed are left alone this long.
  static constexpr Duration kPilotFalls = 1s;       ///< Pilot pressure that nobody asks for is over by then.

  enum class Asking : std::uint8_t { kNothing, kReleased, kPressed };

  void receive_frames(Time now) noexcept;
  void estimate(Time now) noexcept;
  void restart_motion() noexcept;
  void watch_digging() noexcept;
  void watch_sensors(Time now) noexcept;
  void read_pilots() noexcept;
  [[nodiscard]] Reason watch_valves() noexcept;
  [[nodiscard]] Reason machine_fault() const noexcept;
  [[nodiscard]] ModeInputs observe(Time now) const noexcept;
  void command(Time now) noexcept;
  void restart_nodes_once_released(Time now) noexcept;
  [[nodiscard]] bool stopped() const noexcept;
  [[nodiscard]] bool acknowledged() noexcept;
  [[nodiscard]] bool still_asked(const Reason& shown) const noexcept;
  void go_on_if_asked(Time now) noexcept;
  void need_pressures(int joint, bool on) noexcept;
  void go_home_if_chosen(Time now) noexcept;

  double step_s_;
  Duration longest_gap_;
  Link& link_;
  CanBus& bus_;
  CanopenClient client_;
  J1939Bus j1939_;
  SensorSet sensors_;
  Plausibility plausibility_;
  ValveMonitor valve_monitor_;
  UnseenSpool unseen_spool_;
  PilotMonitor pilot_monitor_;
  MotionMonitor motion_monitor_;
  estimation::JointStateFilter filter_;
  estimation::ForceEstimator force_;
  estimation::PayloadEstimator payload_;
  estimation::BuriedObjectCue object_cue_;
  JointControl control_;
  GateLimits gate_limits_;
  OperatorInput operator_;
  HomeOnTwo home_;

  Time stepped_at_ = kNever, failed_at_ = kNever;
  bool restarted_in_vain_ = false;  // over a bus that had failed
  Duration gap_{};
  std::optional<estimation::JointState> state_;
  LowPass<JointVector> rest_rate_;
  Reason sensor_fault_, valve_reason_;
  PerJoint<std::optional<PilotSpool>> pilots_{};
  std::array<double, 6> pilot_Pa_{};                                                 // newest
  JointVector pilot_opening_ = JointVector::Zero(), piloted_ = JointVector::Zero();  // PilotSpool's, of the newest
  Time unasked_since_ = kNever;  // pilot pressure is on although the machine is not led
  Reason object_;                // met while digging; until enable is let go
  // What the operator did with enable since the machine stopped, and the question that was shown when it was pressed.
  Asking asking_ = Asking::kNothing;
  Reason asked_;
  ModeDecision decision_;
  JointControl::Output control_output_;
  JointVector wanted_ = JointVector::Zero();
  GateResult gate_;
  estimation::JointState newest_state_;
  std::uint32_t sequence_ = 0;  // of the newest message
  Time measured_at_ = kNever;   ///< Of the newest sensor frame behind state and force.
  double energy_in_J_ = 0;
};

}  // namespace knuckle::slave
