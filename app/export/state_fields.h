// What the states of the two loops (slave/slave_state.h, master/master_state.h) are called in tables and data files.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/joints.h"
#include "core/reason.h"
#include "master/master_state.h"
#include "recording/fields.h"
#include "slave/slave_state.h"
#include "transport/link_messages.h"

namespace knuckle::exporting {

/// Calls take(name, suffix, value) for every member of a state: scalars and vectors of doubles. A reason is four of
/// them: its code, and with suffixes "_subject", "_value" and "_limit" the rest.
template <typename State, typename Take>
void for_each_field(const State& state, const Take& take) {
  State::fields(state, [&take](const char* name, const auto& member) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(member)>, Reason>) {
      take(name, "", member.code);
      take(name, "_subject", member.subject);
      take(name, "_value", member.value);
      take(name, "_limit", member.limit);
    } else {
      take(name, "", member);
    }
  });
}

/// Whose joints a vector of a state is about.
enum class Joints : std::uint8_t { kMachine, kDevice };
template <typename State>
[[nodiscard]] Joints joints_of(std::string_view field) noexcept {
  const bool device =
      std::is_same_v<State, master::MasterState> && (field.starts_with("device_") || field == "torque_Nm");
  return device ? Joints::kDevice : Joints::kMachine;
}

/// Columns of a vector's elements, as the other tables name them: joint_rad is boom_rad, arm_rad, bucket_rad;
/// setpoint_rad is setpoint_boom_rad, ...; tip_force_N is tip_force_x_N and tip_force_z_N; sensors are called as in
/// recordings that `knuckle identify` reads.
[[nodiscard]] std::vector<std::string> element_names(std::string_view field, std::size_t size, Joints joints);

/// Of a field, from the end of its name: "rad/s", "N m"; empty: it has none.
[[nodiscard]] std::string unit_of(std::string_view field);

}  // namespace knuckle::exporting
