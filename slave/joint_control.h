// Joint control through the valves: where each joint should go becomes a cylinder speed, and that a spool command:
// compliant in contact, load-aware valve gain, flow sharing, dead-band compensation with learning and dither.
#pragma once

#include <array>

#include "core/filters.h"
#include "core/joints.h"
#include "estimation/contact_compliance.h"
#include "estimation/force_estimator.h"
#include "estimation/joint_state.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "slave/assist.h"
#include "slave/contact_law.h"

namespace knuckle::slave {

struct JointCommand {
  JointVector position_rad = JointVector::Zero();
  JointVector velocity_radps = JointVector::Zero();
  bool active = false;  ///< false: valves neutral, filters start anew; the learned dead bands stay.
  PlanarVector rendered_N = PlanarVector::Zero();  ///< MasterMessage::rendered_N
  double force_limit_N = 0;                        ///< Of the assist; 0: off.
  double speed_share = 1;                          ///< Of the joints' speed limits.
};

class JointControl {
 public:
  struct Output {
    JointVector valve = JointVector::Zero();  ///< Spool commands or shares of full speed, [-1, 1], positive extends.
    JointVector rate_radps = JointVector::Zero();  ///< Joint rates asked of the valves.
    double contact_compliance = 0;                 ///< SlaveMessage::contact_compliance
    JointVector ahead_rad = JointVector::Zero();   ///< SlaveMessage::ahead_rad
    std::uint16_t limits = 0;                      ///< LimitFlag bits (transport/link_messages.h).
    Reason assist;                                 ///< Why ceiling or assist slow or hold; kNone: they do not.
  };
  JointControl(const MachineDescription& machine, double step_s);
  /// @param sent_valve_last what left the gate in the last step; where the gate changed it, nothing is learned.
  Output step(const estimation::JointState& state, const estimation::ForceEstimate& force, const JointCommand& command,
              const JointVector& sent_valve_last) noexcept;
  void reset() noexcept;

 private:
  static constexpr int kDelaySteps = 16;  ///< Room for the delayed speed command of the learning rule: 50 ms at 250 Hz.

  JointVector wanted_rates(const estimation::JointState& state, const Touch& touch,
                           const estimation::ForceEstimate& force, const JointCommand& command,
                           Output& output) noexcept;
  /// The set-point's speed, times (1 - fade); of the part that leads out of the contact also the rest, as far as it is
  /// faster than towards_radps (rates of position error and compliance) press in. `held`: share of the speed out of the
  /// contact that is left away.
  [[nodiscard]] JointVector fed_forward(const Touch& touch, const PlanarVector& force_N, double fade, double held,
                                        const JointVector& towards_radps) const noexcept;
  /// Speed limit of the joint, falling to zero towards the ends of its range.
  [[nodiscard]] double within_limits(int joint, double rate_radps, double angle_rad, double speed_share,
                                     std::uint16_t& limits) const noexcept;
  /// Within the tip's speed limit and the pump's flow; one factor for all axes keeps the direction of the tip.
  [[nodiscard]] JointVector shared(const JointVector& rate, const estimation::JointState& state,
                                   std::uint16_t& limits) const noexcept;
  /// Ceiling and assist: slow what would press too hard.
  void limit_force(const Touch& touch, const estimation::ForceEstimate& force, double assist_N,
                   Output& output) noexcept;
  /// Rod speed at full opening under the low-passed pressures load_.
  double full_opening_mps(int joint, bool extend) const noexcept;
  void update_supply(const JointVector& cylinder_mps) noexcept;
  /// By which the joints are off what the machine's own controller has let in, because their oil gives way: swinging.
  [[nodiscard]] JointVector swing_rad(const estimation::JointState& state) noexcept;
  /// Share of the full speed that the machine's own controller is told.
  [[nodiscard]] double rate_command(int joint, double rate_radps, bool extend) const noexcept;
  double spool_command(int joint, double wanted_mps, const estimation::JointState& state, bool learning) noexcept;
  void learn(int joint, double wanted_mps, double full_mps, const estimation::JointState& state,
             bool learning) noexcept;

  MachineDescription machine_;
  Kinematics kinematics_;
  ContactLaw law_;
  double step_s_;
  int dither_steps_;
  double supply_Pa_;
  using Load = Eigen::Array<double, 2 * kJoints, 1>;
  [[nodiscard]] Load load_of(const estimation::JointState& state,
                             const estimation::ForceEstimate& force) const noexcept;
  LowPass<Load> load_;  ///< Pressures for the valve gain, in the order of JointState::pressure_Pa.
  JointVector last_valve_ = JointVector::Zero();
  LowPass<JointVector> velocity_, acceleration_, given_way_rad_;
  estimation::ForceLag<JointVector> ahead_;
  RisingForce rising_to_ceiling_, rising_to_assist_;
  estimation::ContactCompliance contact_compliance_;
  PlanarVector touched_m_ =
      PlanarVector::Zero();  ///< Integrated speed of the touched point: no place, since that point changes.
  PlanarVector came_mps_ = PlanarVector::Zero();      ///< The tip's motion before it touched; kept from hold to hold.
  PlanarVector from_touch_m_ = PlanarVector::Zero();  ///< Its way since then.
  double contact_probability_ = 0;                    ///< Largest contact_probability(), falling over some seconds.
  std::uint32_t steps_ = 0;
  PerJoint<std::array<double, 2>> learned_{};
  struct Learning {
    explicit Learning(double step_s) noexcept;
    std::array<double, kDelaySteps> wanted_mps{};
    double delivered_m = 0;
    LowPass<double> wanted_1, wanted_2, delivered_1, delivered_2;
  };
  PerJoint<Learning> learning_;
  bool running_ = false;
};

}  // namespace knuckle::slave
