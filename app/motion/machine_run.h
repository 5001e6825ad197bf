// Drives a machine along given motions through the same slave loop, safety gate and CAN frames as an operator would,
// and records what the sensors said. Here the machine is the simulated one, on virtual time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "estimation/identification/excitation.h"
#include "estimation/identification/kinematic_calibration.h"
#include "estimation/identification/recording.h"
#include "machine/description.h"
#include "sim/truth.h"
#include "sim/world.h"
#include "slave/slave_state.h"

namespace knuckle::motion {

/// What the simulator knows of the moment at which a recorded sample was measured, for judging only.
struct TruthSample {
  JointVector joint_rad = JointVector::Zero(), joint_radps = JointVector::Zero(), joint_radps2 = JointVector::Zero();
  JointVector cylinder_mps = JointVector::Zero();
  JointVector lever_m = JointVector::Zero();
  JointVector cylinder_N = JointVector::Zero();  ///< Chamber pressures times areas, friction not taken off.
  JointVector friction_N = JointVector::Zero();
  PlanarVector tip_m = PlanarVector::Zero();
  PlanarVector contact_N = PlanarVector::Zero();  ///< Of world and test rig on the bucket, frame M.
  double payload_kg = 0;
};

/// One recorded run; truth has one entry a sample.
struct MachineRecording {
  estimation::Recording recording;
  std::vector<TruthSample> truth;
};

class MachineRun {
 public:
  /// @param machine as the controller sees it (calibrated() or not); @param truth of the simulated machine.
  /// The machine starts at rest at start_rad, comes up, aligns and is engaged before the first motion.
  MachineRun(const MachineDescription& machine, const sim::MachineTruth& truth, const sim::WorldDescription& world,
             const JointVector& start_rad, std::uint64_t seed);
  ~MachineRun();

  /// Is told the time driven so far every second of it; may throw to end the run, which is then of no more use.
  void watch(std::function<void(double elapsed_s)> watcher);
  /// Is told with each recorded sample what the slave loop reports after the step that heard it.
  void listen(std::function<void(const slave::SlaveState&, const TruthSample&)> listener);
  /// Goes gently to the path's first point, then follows it and records (the way there is not recorded).
  /// @param pull_N of a test rig (load cell on a chain) on the bucket, frame M, one a sample of the path; empty: none.
  /// @param pull_from_tip_m where its chain hangs, from the tip, bucket axes.
  /// @throws NotLed with the reason where the machine does not engage or is no longer engaged.
  [[nodiscard]] MachineRecording follow(const estimation::JointPath& path, const std::vector<PlanarVector>& pull_N = {},
                                        const PlanarVector& pull_from_tip_m = PlanarVector::Zero());
  /// Stands still for so long and records.
  [[nodiscard]] MachineRecording rest(double duration_s);
  /// Hangs a weight on the bucket where the machine file says that loads lie; 0 takes it off. The machine waits for it.
  void hang(double mass_kg);
  /// Goes to each pose, waits until it rests, reads the encoders and surveys the three points with normal errors of
  /// sigma_m per coordinate.
  [[nodiscard]] estimation::Survey survey(const std::vector<JointVector>& poses_rad, double sigma_m);
  /// Same stops, but recorded for duration_s each: for static identification. Between two stops lies one sample that is
  /// marked as not usable.
  [[nodiscard]] MachineRecording stops(const std::vector<JointVector>& poses_rad, double duration_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace knuckle::motion
