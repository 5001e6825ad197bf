// Gravity parameters from poses at rest (Malaguti & Zaghi, "Force sensor by driving hydraulic cylinders", 3.1): one
// torque balance per link and pose, no friction, ordinary least squares,
//
//   tau_i - tau_{i+1} = g (X_i cos phi_i - Z_i sin phi_i).
//
// What friction holds at rest is unknown, so it stays in as noise: that is why the paper takes some 150 poses, and why
// its standard errors are large.
#pragma once

#include <span>
#include <vector>

#include "core/joints.h"
#include "estimation/identification/identification.h"
#include "estimation/identification/recording.h"
#include "estimation/regressor.h"
#include "machine/description_fwd.h"

namespace knuckle::estimation {

struct StaticOptions {
  int first_link = kArm;        ///< The paper has stick and bucket; kBoom takes all three links.
  int least_poses = 150;        ///< Fewer are used, but not called usable.
  double rest_s = 0.4;          ///< Shortest rest; its second half is averaged.
  double stop_margin_m = 0.01;  ///< Poses with a rod closer to its end stop, which bears force unseen, are left out.
};

/// Options for all links, without the boom where nobody measures its pressures.
[[nodiscard]] StaticOptions all_measured_links(const MachineDescription& machine);

/// What rods may move by in a pose at rest: two steps of the encoders, 0.2 mm at least.
[[nodiscard]] double still_m(const MachineDescription& machine);

struct RestingPose {
  JointVector joint_rad, torque_Nm;  ///< Torques of the cylinders.
  double hull_pitch_rad;
};

struct StaticResult {
  Identification summary;  ///< S1, S2: X and Z of the bucket, S3, S4 of the stick, S5, S6 of the boom where asked for.
  int first_link = kArm;
  int poses = 0, near_stops = 0;
  BaseParameters parameters = BaseParameters::Zero();  ///< Moments only.
};

/// Finds the stretches in which no rod moves by more than two encoder steps. Each is one pose, unless the joints came
/// to rest where they had been.
/// @param near_stops is increased by the poses left out.
[[nodiscard]] std::vector<RestingPose> resting_poses(const MachineDescription& machine, const Recording& recording,
                                                     const StaticOptions& options, int& near_stops);

/// Poor data is not thrown at: summary.usable is false and the reasons say why.
/// @throws InputError as Kinematics does.
[[nodiscard]] StaticResult identify_static(const MachineDescription& machine, std::span<const Recording> recordings,
                                           const StaticOptions& options = {});

/// Gravity against measured torque, sample by sample, moving or not; NaN for a boom that was not identified.
[[nodiscard]] TorqueComparison compare_torque(const StaticResult& result, const MachineDescription& machine,
                                              const Recording& recording);

/// Force of the world on the tip, frame M, one a sample, NaN where not known: from stick and bucket, or from all three
/// joints by least squares.
[[nodiscard]] std::vector<PlanarVector> external_force(const StaticResult& result, const MachineDescription& machine,
                                                       const Recording& recording);

}  // namespace knuckle::estimation
