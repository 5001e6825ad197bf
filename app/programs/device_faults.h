// What a simulated haptic device can be made to do wrong on a real cable, at a time: for trying out how the driver
// takes it.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "core/time.h"
#include "sim/device_firmware.h"
#include "transport/faulty_ports.h"

namespace knuckle::programs {

enum class DeviceFaultKind : std::uint8_t {
  kSilent,      ///< no reports; commands still obeyed
  kBadCrc,      ///< reports damaged
  kFrozen,      ///< the same report over and over
  kWildCounts,  ///< counts that stand for no angle
  kHung,        ///< neither reports nor reads
  kTruncated,   ///< reports end early
};
inline constexpr std::array<const char*, 6> kDeviceFaultNames{"silent",      "bad_crc", "frozen",
                                                              "wild_counts", "hung",    "truncated"};

struct PlannedDeviceFault {
  DeviceFaultKind kind = DeviceFaultKind::kSilent;
  double at_s = 0;
  double duration_s = std::numeric_limits<double>::infinity();
  std::string text;  ///< As given on the command line.
};
/// "KIND@S[+D]". @throws InputError naming --fault, its value and what is wrong with it.
[[nodiscard]] PlannedDeviceFault parse_device_fault(const std::string& text);

class DeviceFaults {
 public:
  explicit DeviceFaults(std::vector<PlannedDeviceFault> plan);

  /// Before each cycle of the firmware; of several faults at a time the last one counts.
  /// @return the fault that began or ended just now: its place in the plan; else -1.
  int step(Time now, sim::DeviceFirmware& firmware, TruncatingPort& port) noexcept;
  [[nodiscard]] bool broken(int fault) const noexcept { return broken_[static_cast<std::size_t>(fault)]; }

 private:
  std::vector<PlannedDeviceFault> plan_;
  std::vector<char> broken_;
};

}  // namespace knuckle::programs
