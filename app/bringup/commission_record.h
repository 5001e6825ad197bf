// Motion of all joints in closed loop on a machine bus, led and recorded for `knuckle identify`: the same slave loop,
// safety gate and frames as with an operator.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "machine/description_fwd.h"
#include "transport/bus_access.h"

namespace knuckle::bringup {

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
