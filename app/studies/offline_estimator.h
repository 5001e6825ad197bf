// The real-time force and payload estimators, run over recordings in the order the slave loop steps them.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "core/joints.h"
#include "estimation/contact_models.h"
#include "estimation/force_estimator.h"
#include "estimation/identification/recording.h"
#include "estimation/joint_state.h"
#include "estimation/payload.h"
#include "machine/description_fwd.h"

namespace knuckle::studies {

/// What is judged of one sample.
struct EstimateSample {
  PlanarVector tip_N = PlanarVector::Zero();      ///< With the weight of what is carried.
  PlanarVector contact_N = PlanarVector::Zero();  ///< Without.
  Eigen::Matrix2d covariance_N2 = Eigen::Matrix2d::Zero();
  estimation::JointLoad load;  ///< With what is carried, for the other contact models.
  bool contact = false;
  bool valid = false;  ///< false where a length made no joint angle.
};

class OfflineEstimator {
 public:
  /// @param machine calibrated() or not.
  OfflineEstimator(const MachineDescription& machine, double step_s);
  /// Starts at rest where the recording starts; what was learned before stays.
  std::vector<EstimateSample> run(const estimation::Recording& recording);
  [[nodiscard]] estimation::PayloadEstimator& payload() noexcept { return payload_; }
  [[nodiscard]] const estimation::ForceEstimator& force() const noexcept { return force_; }

 private:
  JointVector offset_m_;
  estimation::JointStateFilter filter_;
  estimation::ForceEstimator force_;
  estimation::PayloadEstimator payload_;
};

}  // namespace knuckle::studies
