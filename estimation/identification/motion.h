// A recording as identification sees it: what the joints did and what the cylinders pushed, sample by sample, smoothed
// to both sides (off-line), known only where the sensors were.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "estimation/identification/recording.h"
#include "estimation/identification/smoothing.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

struct MotionOptions {
  /// Savitzky-Golay window: 41 samples at 200 Hz, and as long at any other rate.
  double window_s = 0.205;
  int order = 3;
  /// What the polynomial is fitted to: encoder noise is even in the cylinder's length; M fits joint angles.
  enum class Smooth : std::uint8_t { kCylinderLength, kJointAngle } smooth = Smooth::kCylinderLength;
  /// Time constant of the transmitters (and of hoses that act like it), taken off: p + T dp/dt; 0 leaves pressures raw.
  double pressure_lag_s = 0;
  /// [rad/(N m)] How far each link stays behind its encoder per torque of its cylinder, taken off.
  JointVector compliance_radpNm = JointVector::Zero();
  double pitch_window_s = 1;  ///< The hull hardly moves, tilt sensors are coarse: mean over so long.
};

/// One column a sample of the recording; NaN outside `stretches`, and the force of a cylinder without transmitters
/// (SensorDescription::without_pressures) everywhere.
struct Motion {
  double step_s = 0;
  std::vector<Stretch> stretches;
  Eigen::Matrix3Xd joint_rad, joint_radps;         ///< Relative joints.
  Eigen::Matrix3Xd cylinder_m, cylinder_mps;       ///< True pin-to-pin lengths (offset taken off); rates.
  Eigen::Matrix3Xd lever_m;                        ///< dL/dtheta
  Eigen::Matrix3Xd cylinder_N, smooth_cylinder_N;  ///< p_A A_A - p_B A_B as read (lag taken off); smoothed alike.
  Eigen::Matrix3Xd smooth_pressure_sum_Pa;         ///< p_A + p_B
  Eigen::RowVectorXd hull_pitch_rad;

  [[nodiscard]] Eigen::Index size() const noexcept { return joint_rad.cols(); }
  [[nodiscard]] double duration_s() const noexcept { return step_s * static_cast<double>(total_size(stretches)); }
};

/// @param machine as calibrated(); its encoder offsets are taken off the readings.
/// A sample counts as known where the recording says usable, every value is finite and every length has an angle.
/// @throws InputError as Kinematics does.
[[nodiscard]] Motion offline_motion(const MachineDescription& machine, const Recording& recording,
                                    const MotionOptions& options = {});

/// Half a window in samples: at least one; for smoothing, at least what the order needs.
[[nodiscard]] int half_window(double window_s, double step_s) noexcept;
[[nodiscard]] int smoothing_half_window(const MotionOptions& options, double step_s) noexcept;

// Whether pressures and lengths were recorded at the same time.

inline constexpr double kMostPressureLag_s = 0.25;  ///< Either way; more is not looked for.

/// How much later pressures come than lengths [s]: the shift at which the full model, identified anew for each,
/// explains the torque best. +-kMostPressureLag_s where none within explains it best; nothing where the recordings
/// are less than 20 s or cannot be solved for.
/// @param machine as calibrated().
[[nodiscard]] std::optional<double> pressure_lag_s(const MachineDescription& machine,
                                                   const std::vector<Recording>& recordings);

/// Pressures read lag_s later, between samples by a line; where they are not known, the sample is not usable.
[[nodiscard]] Recording without_pressure_lag(const Recording& recording, double lag_s);

}  // namespace knuckle::estimation
