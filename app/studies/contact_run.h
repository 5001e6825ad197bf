// A simulated machine with the real slave loop on its bus, led against a wall by set-points alone: no hand, no device.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/joints.h"
#include "machine/description.h"
#include "sim/truth.h"

namespace knuckle::studies {

/// Where the bucket touches, and which way the wall faces.
struct ContactPose {
  std::string name;
  JointVector joint_rad = JointVector::Zero();  ///< At the touch.
  PlanarVector normal = PlanarVector(-1, 0);    ///< Of the wall, towards its free side; unit, frame M.
  PlanarVector place_m = PlanarVector::Zero();  ///< Of the bucket, bucket axes.
};

/// The tip against a wall in front, the ground, a slope of 45 deg, something overhead and something behind; and the
/// back of the bucket against the wall in front. With the bucket turned so that this place touches first.
[[nodiscard]] std::vector<ContactPose> contact_poses(const MachineDescription& machine);

struct ContactTrial {
  MachineDescription machine;  ///< As the controller sees it.
  sim::MachineTruth truth;
  ContactPose pose;
  double wall_N_per_m = 1e6, wall_damping_ratio = 0.3, wall_friction = 0.4;
  double gap_m = 0.03;         ///< At the start.
  double approach_mps = 0.03;  ///< Of the set-point, peak.
  double press_N = 1000;  ///< Asked for by the depth of the set-point behind the wall, in units of the law's spring;
  double step_N = 400;    ///< then so much more, at once (0.1 s): into the wall nothing is fed forward.
  double settle_s = 3, watch_s = 6;
  /// Above 0: the set-point goes at this speed until a centimetre before the depth of press_N, where it stops.
  double ram_mps = 0;
  std::uint64_t seed = 1;
};

/// Truth, every millisecond from the touch's approach on.
struct ContactSample {
  double t_s = 0;
  double push_N = 0;   ///< Of the wall along its normal,
  double along_N = 0;  ///< and along its face.
  double gap_m = 0;    ///< Of the place to the wall's face, negative inside.
  JointVector joint_rad = JointVector::Zero();
  std::array<double, 6> chamber_Pa{};
};

struct ContactRecord {
  std::vector<ContactSample> samples;
  std::size_t stepped = 0;  ///< Index of the small step of the set-point.
  std::string trouble;      ///< Why the machine dropped out; empty: it did not.
};

/// The hand counts as shown all that the set-point asks for: what the law does to hands that are shown less (leash) is
/// left out. @throws InputError where truth and pose do not fit together.
[[nodiscard]] ContactRecord run_contact(const ContactTrial& trial);

}  // namespace knuckle::studies
