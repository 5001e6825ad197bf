#include "machine/device_choice.h"

#include <cmath>

#include "core/error.h"
#include "machine/load.h"
#include "machine/toml_reader.h"

namespace knuckle {

DeviceDescription device_for(const MachineDescription& machine, const std::string& asked) {
  const std::string own = "knuckle1_" + machine.name;
  return load_device(find_config("device", !asked.empty() ? asked : has_config("device", own) ? own : "knuckle1"));
}

void check_springs(const MachineDescription& machine, const DeviceDescription& device) {
  constexpr double kMismatch = 0.2;
  const auto& feel = device.feel;
  const double wanted = feel.force_scale * feel.position_scale * machine.control.tip_stiffness_N_per_m;
  if (std::abs(feel.spring_N_per_m - wanted) <= kMismatch * wanted) return;
  throw InputError(device.source + ": key 'feel.spring_N_per_m' = " + number_text(feel.spring_N_per_m) +
                   ": must be within 20 % of " + number_text(wanted) +
                   " = force_scale * position_scale * 'control.tip_stiffness_N_per_m' of " + machine.source +
                   ": this device file is for another machine");
}

}  // namespace knuckle
