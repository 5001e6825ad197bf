// The haptic device file's sections, with the bounds of every key.

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/units.h"
#include "machine/load.h"
#include "machine/toml_reader.h"

namespace knuckle {
namespace {

void read_joint(TomlTable file, std::size_t joint, DeviceDescription& device) {
  constexpr double kPi = std::numbers::pi;
  device.link_m[static_cast<Eigen::Index>(joint)] = file.number("link_m", 0.01, 2);
  device.min_rad[joint] = file.number("min_rad", -kPi, kPi);
  device.max_rad[joint] = file.number("max_rad", -kPi, kPi);
  file.require(device.max_rad[joint] >= device.min_rad[joint] + 0.1, "max_rad",
               "must be at least 0.1 above min_rad = " + number_text(device.min_rad[joint]), {"min_rad"});
  device.counts_per_turn[joint] = static_cast<std::uint32_t>(file.integer("counts_per_turn", 16, 1 << 24));
  device.gear_ratio[joint] = file.number("gear_ratio", 1, 1000);
  device.torque_constant_Nm_per_A[joint] = file.number("torque_constant_mNm_per_A", 0.1, 10000, kMilli);
  device.rated_current_A[joint] = file.number("rated_current_A", 0.01, 100);
  device.peak_current_A[joint] = file.number("peak_current_A", 0.01, 200);
  file.require(device.peak_current_A[joint] >= device.rated_current_A[joint], "peak_current_A",
               "must be at least rated_current_A = " + number_text(device.rated_current_A[joint]), {"rated_current_A"});
  device.rotor_inertia_kgm2[joint] = file.number("rotor_inertia_gcm2", 0.01, 1e5, 1e-7);
  device.link_inertia_kgm2[joint] = file.number("link_inertia_kgm2", 1e-7, 10);
  device.friction_Nm[joint] = file.number("friction_mNm", 0, 1000, kMilli);
  device.viscous_Nms[joint] = file.number("viscous_mNms", 0, 1000, kMilli);
  device.cogging_Nm[joint] = file.number("cogging_mNm", 0, 1000, kMilli);
  device.cogging_periods[joint] = static_cast<int>(file.integer("cogging_periods", 1, 1000));
  device.thermal_time_constant_s[joint] = file.number("thermal_time_constant_s", 0.1, 1e4);
  device.joint_sign[joint] = file.choice("counts_rise", {"counter-clockwise", "clockwise"}) == 0 ? 1 : -1;
  device.zero_counts[joint] = static_cast<std::int32_t>(file.integer("zero_counts", -1'000'000'000, 1'000'000'000));
}

/// @param leads its law must be one that leads a machine.
DeviceDescription::Feel read_feel(TomlTable file, bool leads) {
  DeviceDescription::Feel feel;
  feel.position_scale = file.number("position_scale", 1, 100);
  feel.force_scale = file.number("force_scale", 1e-5, 1e-1);
  feel.spring_N_per_m = file.number("spring_N_per_m", 10, 5000);
  feel.anchor_time_s = file.number("anchor_time_s", 0.01, 5);
  feel.bias_time_s = file.number("bias_time_s", 0.1, 60);
  feel.bias_time_per_rtt = file.number("bias_time_per_rtt", 0, 50);
  feel.damping_Ns_per_m = file.number("damping_Ns_per_m", 0, 200);
  feel.bias_limit_N = file.number("bias_limit_N", 0, 20);
  feel.force_limit_N = file.number("force_limit_N", 0.5, 50);
  feel.slew_N_per_ms = file.number("slew_N_per_ms", 0.01, 0.5);
  feel.on_N = file.number("on_N", 0.01, 5);
  feel.off_N = file.number("off_N", 0.001, 5);
  file.require(feel.off_N < feel.on_N, "off_N", "must be below on_N = " + number_text(feel.on_N), {"on_N"});
  const auto law = leading_law_named(file.text("law"));
  file.require(law || !leads, "law", kLeadingLawChoice);
  feel.law = law.value_or(feel.law);
  return feel;
}

DeviceDescription read_device(TomlTable file, bool leads) {
  constexpr std::int64_t kLargestSerial = 0xFFFFFFFF;
  DeviceDescription device;
  device.name = file.text("name");
  if (file.has("serial")) device.serial = static_cast<std::uint32_t>(file.integer("serial", 1, kLargestSerial));
  device.source = file.source();
  device.text = file.document();
  TomlTable joints = file.table("joints");
  for (std::size_t joint = 0; joint < kJoints; ++joint)
    read_joint(joints.table(kDeviceJointNames[joint]), joint, device);
  device.watchdog_s = file.number("watchdog_ms", 2, 200, kMilli);
  device.feel = read_feel(file.table("feel"), leads);
  file.finish();
  return device;
}

}  // namespace

DeviceDescription load_device(const std::string& path) {
  return read_device(TomlTable::read_kind("device", path), true);
}

DeviceDescription parse_device(std::string_view text, const std::string& source) {
  return read_device(TomlTable::parse(text, source), false);
}

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
