// Whether two devices have one node id, or two controllers lead the machine, by the frames heard and the answers given.
#pragma once

#include <optional>
#include <string>

#include "app/bringup/bus_survey.h"
#include "app/bringup/doctor_finding.h"
#include "machine/description_fwd.h"

namespace knuckle::bringup {

/// Two signs of two devices with this node id are a fault, one is a note.
/// @param expected in the machine file. @param about of the finding.
[[nodiscard]] std::optional<Finding> second_device(const BusSurvey& survey, const MachineDescription& machine,
                                                   const SurveyedNode& node, const NodeDescription& expected,
                                                   const std::string& about);

/// Beside the one that leads the machine meanwhile.
[[nodiscard]] std::optional<Finding> second_controller(const BusSurvey& survey, const MachineDescription& machine,
                                                       const std::string& about);

}  // namespace knuckle::bringup
