// The "dynamic tare": a Kalman filter that learns, in free motion, what the nominal model has wrong today: pressure
// offsets, friction, oil viscosity, gravity moments, lag.
// A calibrated machine starts with what its identification left uncertain and what changes from day to day.
//
// In free motion the external torque is zero, so the nominal observer's answer e is minus the model error:
// e = -H x + noise, where x are small corrections with priors. The correction H x is then added to every answer.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <limits>

#include "core/joints.h"
#include "estimation/torque_rate.h"
#include "machine/calibration.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

inline constexpr int kTareStates = 22;
/// x: per cylinder bias [N], Coulomb [N], viscous [N s/m], friction of the seals by pressure [m^2]; per link X and Z
/// [kg m]; per joint how far it yields behind its encoder [rad/(N m)]; how late all pressures come [s].
enum TareState {
  kTareBias = 0,
  kTareCoulomb = 3,
  kTareViscous = 6,
  kTareSeal = 9,
  kTareX = 12,
  kTareZ = 15,
  kTareBending = 18,
  kTareLag = 21
};
inline constexpr int kTareUnseen = UnseenColumns::ColsAtCompileTime;  ///< From kTareBending to the end.
static_assert(kTareBending + kTareUnseen == kTareStates);
inline constexpr double kUsualLag_s = 5e-3;  ///< Of transmitters that have not shown theirs.
using TareVector = Eigen::Matrix<double, kTareStates, 1>;
using TareMatrix = Eigen::Matrix<double, kTareStates, kTareStates>;
/// H in relative joints: joint i sees its own cylinder's four corrections, the moments of links k >= i, the inertia
/// of what yields anywhere, and the lag that all transmitters have: they are of one make.
using TareColumns = Eigen::Matrix<double, kJoints, kTareStates>;

/// The signals H is made of (each filtered like the residual it belongs to).
struct TareSignals {
  JointVector lever, lever_dahl, lever_speed, lever_dahl_pressure, gravity_x, gravity_z;
  UnseenColumns unseen = UnseenColumns::Zero();  ///< Of what yields and of the lag.
  [[nodiscard]] TareColumns columns() const noexcept {
    TareColumns h = TareColumns::Zero();
    for (int i = 0; i < kJoints; ++i) {
      h(i, kTareBias + i) = lever[i];
      h(i, kTareCoulomb + i) = lever_dahl[i];
      h(i, kTareViscous + i) = lever_speed[i];
      h(i, kTareSeal + i) = lever_dahl_pressure[i];
      for (int k = i; k < kJoints; ++k) {
        h(i, kTareX + k) = gravity_x[k];
        h(i, kTareZ + k) = gravity_z[k];
      }
    }
    h.rightCols<kTareUnseen>() = unseen;
    return h;
  }
};

/// One look at free motion.
struct TareSample {
  TareSignals signals;
  JointVector residual_Nm;   ///< e, nominal model
  JointVector variance_Nm2;  ///< Of one look taken alone.
};

class Tare {
 public:
  /// Looks are taken this often, and kept back this long: a contact seen meanwhile throws them away, so that what led
  /// up to it is not learned either.
  static constexpr double kLookEvery_s = 0.05;
  static constexpr int kDelayedLooks = 20;
  static constexpr double kRepeats = 20;  ///< Looks of one second tell about the same, so each counts for so little.
  static constexpr double kNisMemory_s = 30;

  explicit Tare(const MachineDescription& machine);

  /// Random walk of the corrections over `duration_s` (oil warms; only while learning is allowed).
  void predict(double duration_s) noexcept;
  /// Queues one look and learns from the one that has been waiting longest, once the queue is full.
  void look(const TareSample& sample) noexcept;
  /// Something touched the machine: forget the looks not yet learned.
  void discard() noexcept { queued_ = 0; }

  [[nodiscard]] const TareVector& state() const noexcept { return x_; }
  [[nodiscard]] const TareMatrix& covariance() const noexcept { return p_; }
  /// Normalised innovation squared, mean of the three joints: e^2 / (H P H' + R) of one look before it is learned. 1 on
  /// average where model and variances are right; NaN before the first look.
  [[nodiscard]] double mean_nis() const noexcept { return mean_nis_; }  ///< Over the last half minute of looks.
  /// Seconds of free motion learned so far.
  [[nodiscard]] double learned_s() const noexcept { return learned_s_; }

 private:
  void expect_drawing(const MachineDescription& machine);
  void expect_bending(const MachineDescription& machine);
  void expect_lag();
  void expect_calibrated(const MachineDescription& machine, const DynamicsCalibration& found);
  void learn(const TareSample& sample) noexcept;

  TareVector x_ = TareVector::Zero();
  TareMatrix p_ = TareMatrix::Zero();
  TareVector walk_ = TareVector::Zero();   ///< Variance per second.
  TareVector prior_ = TareVector::Zero();  ///< Variance no correction grows beyond.
  TareVector least_ = TareVector::Zero();  ///< Nor falls below.
  std::array<TareSample, kDelayedLooks> queue_{};
  int queued_ = 0, next_ = 0;
  double learned_s_ = 0;
  double last_nis_ = std::numeric_limits<double>::quiet_NaN(), mean_nis_ = last_nis_;
};

}  // namespace knuckle::estimation
