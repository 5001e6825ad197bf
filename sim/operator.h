// The operator as a person with a plan: a list of phases (engage, move, press, ...) acted out by where the hand means
// to be, from what is seen on the screen (late) and felt in the hand. Knows the arm's shape, never its controller.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "core/joints.h"
#include "core/time.h"
#include "machine/description_fwd.h"
#include "sim/haptic_device.h"
#include "sim/person.h"
#include "transport/link_messages.h"

namespace knuckle::sim {

// The way a hand goes from one place to another.

inline constexpr double kPeakOfMinimumJerk = 1.875;  ///< Peak speed over mean speed.

/// Minimum-jerk position in [0, 1] for u in [0, 1] (Flash and Hogan 1985).
[[nodiscard]] inline double minimum_jerk(double u) noexcept {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * u * (10 + u * (-15 + 6 * u));
}

// Joints that move at random, each by itself, anywhere in their ranges and to the ends: what free air is judged with.

/// Every stretch is of minimum jerk (Flash and Hogan 1985), begins and ends at rest, and is followed by a pause.
class Wander {
 public:
  /// @param low_rad, @param high_rad the joints' ranges.
  Wander(std::uint64_t seed, const JointVector& low_rad, const JointVector& high_rad);

  /// Begins anew, with other numbers than before. @param fastest_radps peak speed of the fastest stretch.
  void begin(const JointVector& from_rad, double fastest_radps) noexcept;
  /// @param t_s since the beginning, never going back. @param going_on new stretches may begin.
  /// @return where the joints are meant to be.
  const JointVector& step(double t_s, bool going_on) noexcept;
  /// Nothing is on its way.
  [[nodiscard]] bool at_rest() const noexcept { return at_rest_; }

 private:
  struct Stretch {
    double from_rad = 0, to_rad = 0, begin_s = 0, end_s = 0, until_s = 0;  // the last: of the pause
  };
  [[nodiscard]] Stretch drawn(int joint, double from_rad, double t_s) noexcept;

  std::mt19937_64 random_;
  JointVector low_rad_, high_rad_, meant_rad_ = JointVector::Zero();
  double fastest_radps_ = 0;
  PerJoint<Stretch> stretches_{};
  bool at_rest_ = true;
};

enum class PhaseKind : std::uint8_t {
  kEngage,  ///< take hold, align the hand with the machine, press enable, wait until engaged
  kLetGo,   ///< release enable and wait
  kMove,    ///< straight tip path to `tip_m` with `bucket_rad` (or joint path to `joints_rad`), minimum jerk
  kPress,   ///< push along `direction` until `force_N` is felt, then hold the hand where it is for `duration_s`
  kSweep,   ///< sines about the pose at its start
  kPath,    ///< a recorded joint path
  kClutch,  ///< hold the clutch, move the hand by `joints_rad`, let the clutch go
  kWait,    ///< keep still
  kWander,  ///< all joints at random, to their ends and back (wander.h)
  kHome,    ///< acknowledge that a cylinder's transmitters failed, choose to go home on two, wait until that is taken
};

struct PathPoint {
  JointVector joints_rad, rates_radps;
};

struct Phase {
  PhaseKind kind = PhaseKind::kWait;
  bool joint_space = false;                   ///< kMove: to joints_rad instead of tip_m and bucket_rad.
  PlanarVector tip_m = PlanarVector::Zero();  ///< Machine tip, frame M.
  double bucket_rad = 0;                      ///< Absolute bucket angle (sum of joints).
  JointVector joints_rad =
      JointVector::Zero();  ///< kMove: machine joints; kSweep: amplitudes; kClutch: hand displacement.
  JointVector periods_s = JointVector::Ones();     ///< kSweep
  PlanarVector direction = PlanarVector::UnitX();  ///< kPress, unit vector, frame M.
  double speed_mps = 0.2;     ///< Peak machine tip speed asked for (kMove, kPress approach); kMove in joint space,
                              ///< kWander: rad/s.
  double force_N = 0;         ///< kPress, felt at the hand.
  double duration_s = 0;      ///< kPress: hold; kSweep, kWander, kWait, kLetGo: length.
  double timeout_s = 30;      ///< Given up after this long.
  double tolerance_m = 0.05;  ///< kMove: the machine's tip must come this close.
  bool until_break = false;   ///< kPress: raise the force until something gives way ...
  int pieces = 1;             ///< ... that is one of so many: once all are loose there is nothing left to press.
  bool until_hold = false;    ///< kMove: goes on until the machine holds by itself.
  bool until_fault = false;   ///< kSweep, kWait: after its length, goes on until the machine has stopped with a fault.
};

/// What the operator sees (screen) and feels (hand).
struct OperatorView {
  JointVector machine_rad = JointVector::Zero();  ///< Measured machine joints as shown.
  JointVector ghost_rad = JointVector::Zero();    ///< Machine pose that the hand asks for, as shown.
  JointVector hand_rad = JointVector::Zero();     ///< Own hand.
  PlanarVector felt_N = PlanarVector::Zero();     ///< Force of the device on the hand.
  Mode mode = Mode::kOff;
  int breaks = 0;                                  ///< Pieces seen to give way so far.
  bool home_offered = false, home_on_two = false;  ///< As the machine tells it.
};

/// What a hand that means to be a machine metre further pushes with at the tip of the device.
struct PushStiffness {
  double limb_N_per_m = 0;  ///< The limb, held still.
  double felt_N_per_m =
      0;  ///< The limb and the spring that the device renders, in series: as a practised hand knows it.
};
[[nodiscard]] PushStiffness push_stiffness(const LimbImpedance& limb, const DeviceDescription::Feel& feel) noexcept;

class Operator {
 public:
  /// @param start_rad where the hand is at first. @param reaction delay of seeing and feeling.
  /// @param unsteadiness what the hand does beside the plan, and whose hand it is. @param seed of what phases draw.
  Operator(const MachineDescription& machine, std::vector<Phase> phases, std::vector<PathPoint> path,
           Duration path_period, const JointVector& start_rad, Duration reaction, const PushStiffness& push,
           const Unsteadiness& unsteadiness = {}, std::uint64_t seed = 1);
  OperatorIntent step(Time now, const OperatorView& view) noexcept;
  [[nodiscard]] int phase() const noexcept { return static_cast<int>(index_); }
  [[nodiscard]] bool finished() const noexcept { return index_ >= phases_.size(); }
  /// Index of the first phase that ran into its time-out, or -1.
  [[nodiscard]] int timed_out() const noexcept { return timed_out_; }
  /// How long the current phase (or, once finished, none) has been going on.
  [[nodiscard]] Duration in_phase(Time now) const noexcept { return now - phase_start_; }
  /// True while a kPress phase holds the hand still after its force was reached.
  [[nodiscard]] bool holding() const noexcept { return holding_; }

 private:
  struct Pose {
    PlanarVector tip_m;
    double bucket_rad;
  };
  void begin(Time now, const OperatorView& view) noexcept;
  void next(Time now) noexcept;
  // Of these, true: the phase is done.
  bool run(Time now, const OperatorView& view) noexcept;
  bool engage(Time now, const OperatorView& view) noexcept;
  bool move(double t, const OperatorView& view) noexcept;
  bool press(Time now, const OperatorView& view) noexcept;
  bool sweep(double t) noexcept;
  bool follow_path(double t) noexcept;
  bool clutch(double t) noexcept;
  bool choose_home(Time now, const OperatorView& view) noexcept;
  void mean(const JointVector& machine_rad) noexcept { meant_rad_ = machine_rad; }
  void mean(const Pose& pose) noexcept;
  /// Moves the hand towards where the screen would show what was meant when the picture seen now was taken.
  void correct(const JointVector& meant_then_rad, const OperatorView& seen, double dt_s) noexcept;
  [[nodiscard]] bool looks() const noexcept { return unsteadiness_.person().corrects; }
  [[nodiscard]] bool watches() const noexcept;  // now
  [[nodiscard]] OperatorIntent carried_out(Time now, double dt_s) noexcept;
  [[nodiscard]] Pose pose_of(const JointVector& machine_rad) const noexcept;
  [[nodiscard]] bool inverse(const Pose& pose, JointVector& joints) const noexcept;

  JointVector links_m_;
  JointVector min_rad_, max_rad_;
  std::vector<Phase> phases_;
  std::vector<PathPoint> path_;
  Duration path_period_, reaction_;
  PushStiffness push_;
  Unsteadiness unsteadiness_;
  Wander wander_{1, JointVector::Zero(), JointVector::Zero()};
  double correction_1ps_ = 0;  // of what is seen to be missing; 0: never corrects
  std::size_t index_ = 0;
  int timed_out_ = -1;
  bool begun_ = false;
  Time phase_start_{}, last_{};

  OperatorIntent intent_;  // as planned and corrected, without unsteadiness
  JointVector carried_out_rad_;
  JointVector correction_rad_ = JointVector::Zero();
  JointVector meant_rad_;                     // machine pose the operator means
  JointVector offset_ = JointVector::Zero();  // ghost - hand, as seen at the start of a phase
  JointVector start_rad_;                     // meant pose at the start of the phase
  JointVector hand_start_rad_;
  Pose start_pose_{};
  double depth_m_ = 0, touch_depth_m_ = 0, hold_depth_m_ = 0;
  PlanarVector pushing_N_ = PlanarVector::Zero(), pushed_N_ = PlanarVector::Zero();  // meant; by the muscles as yet
  bool touched_ = false, holding_ = false;
  Time hold_start_{}, calm_since_{}, pressed_at_{kNever}, engaged_since_{kNever};
  int breaks_at_start_ = 0;
  // Late senses: one view each 5 ms.
  static constexpr std::size_t kRing = 128;
  std::array<OperatorView, kRing> seen_{};
  std::array<JointVector, kRing> meant_then_rad_{};
  std::size_t seen_count_ = 0;
  Time last_seen_{kNever};
};

}  // namespace knuckle::sim
