// What a node measures or does at the moment, as read over SDO, as text with units.
#pragma once

#include <string>
#include <vector>

#include "app/bringup/bus_survey.h"
#include "machine/bus_description.h"
#include "machine/description_fwd.h"
#include "slave/node_setup.h"

namespace knuckle::bringup {

struct NodeReading {
  std::string text;       ///< "60.21 bar", "INIT, spool 0.0 %"; empty where it could not be read.
  std::string complaint;  ///< The defect and what to do; empty where there is none.
  bool fault = false;     ///< The machine cannot be run with this defect.
};
[[nodiscard]] std::vector<canopen::Object> reading_objects(NodeRole role, const MachineDescription& machine);
[[nodiscard]] NodeReading reading_of(const SurveyedNode& node, const slave::NodeScript& expected,
                                     const MachineDescription& machine);

}  // namespace knuckle::bringup
