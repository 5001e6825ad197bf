// Motion of all joints in closed loop on a machine bus, led and recorded for `knuckle identify`: the same slave loop,
// safety gate and frames as with an operator.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "app/motion/path_leader.h"
#include "estimation/identification/joint_path.h"
#include "estimation/identification/recording.h"
#include "machine/description.h"
#include "machine/kinematics.h"
#include "slave/slave_loop.h"
#include "transport/bus_access.h"
#include "transport/impaired_link.h"

namespace knuckle::bringup {

class LedMachine {
 public:
  /// @param stopped whether the operator requests a stop; called every SYNC.
  LedMachine(const MachineDescription& machine, BusAccess& access, std::function<bool()> stopped);

  /// From reset to engaged, where the machine stands. @throws CommissionEnded with the reason where it cannot.
  void engage();
  /// Gently to the path's first point, then along it; only the path is recorded, with the encoders' raw readings.
  /// @throws CommissionEnded with the reason where the machine disengages or the operator stops it.
  [[nodiscard]] estimation::Recording follow(const estimation::JointPath& path, const std::string& source);
  /// Waits with closed valves, pilot pressure still on; for the way out, before an orderly stop.
  void neutral() noexcept;

 private:
  /// A millisecond of link and leader. @return whether the slave loop's period was due, and it has stepped.
  bool advance();
  void tick();
  template <typename Condition>
  void run_until(Condition reached, Duration patience, const char* what);
  void sample(const JointVector& demand);

  MachineDescription machine_;
  Kinematics kinematics_;
  BusAccess& access_;
  std::function<bool()> stopped_;
  Duration period_;
  Time step_due_;
  ImpairedLink link_;
  motion::PathLeader leader_;
  slave::SlaveLoop slave_;
  estimation::Recording* recording_ = nullptr;
};

/// Slow sweeps, fast motion and two motions to validate with, in the order of their names.
struct IdentifyMotions {
  double slow_s = 120, fast_s = 80, validation_s = 40;
  std::uint64_t seed = 1;
};
inline constexpr std::array<const char*, 4> kMotionNames{"slow", "fast", "hold_out_slow", "hold_out_digging"};
[[nodiscard]] inline std::string recording_file(const std::string& folder, const char* motion) {
  return (std::filesystem::path(folder) / (std::string(motion) + ".csv")).string();
}
/// Writes each as a recording_file().
/// @return their names. @throws CommissionEnded, InputError
[[nodiscard]] std::vector<std::string> record_motions(const MachineDescription& machine, BusAccess& access,
                                                      const IdentifyMotions& motions, const std::string& folder,
                                                      const std::function<bool()>& stopped);

}  // namespace knuckle::bringup
