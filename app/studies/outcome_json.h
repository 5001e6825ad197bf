// One judged machine of the estimation battery as JSON and back, to the bit.
#pragma once

#include <nlohmann/json.hpp>

#include "app/studies/battery_machine.h"

namespace knuckle::studies {

[[nodiscard]] nlohmann::ordered_json to_json(MachineOutcome outcome);
/// @throws InputError where it is no such thing.
[[nodiscard]] MachineOutcome outcome_of(const nlohmann::ordered_json& json);

}  // namespace knuckle::studies
