// What the doctor says of frames from and to a controller that the machine has by itself.
#pragma once

#include <cstdint>

#include "app/bringup/bus_survey.h"
#include "app/bringup/doctor_finding.h"
#include "machine/bus_description.h"

namespace knuckle::bringup {

/// Whether the machine file has a broadcast or a command that is known by this identifier.
[[nodiscard]] bool of_own_controller(std::uint32_t id, const BusDescription& bus);

/// Of each broadcast how often it comes and what it says, or what is wrong with it; of commands and of Knuckle's own
/// J1939 address, who else sends.
[[nodiscard]] Findings own_frame_findings(const BusSurvey& survey, const BusDescription& bus);

}  // namespace knuckle::bringup
