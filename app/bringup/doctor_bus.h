// Compares a surveyed machine bus with the machine file: nodes found, missing or of another type, and everything on
// which start-up would fail.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/bringup/bus_survey.h"
#include "app/bringup/doctor_finding.h"
#include "machine/description_fwd.h"

namespace knuckle::bringup {

/// One node as a line of a table.
struct NodeLine {
  std::uint8_t id = 0;
  std::string name;     ///< Key in the machine file; "-" where the file has no such node.
  std::string state;    ///< "operational", ...; "no heartbeat", "silent"
  std::string reading;  ///< Process value or state now, such as "60.21 bar"; empty where there is none.
  std::string guard;    ///< Of a node that is told to move something: what stops it without its controller now.
  std::optional<std::uint32_t> device_type, vendor, product, error_register;
  std::optional<std::uint32_t> serial;            ///< Where the device has one.
  std::optional<std::uint16_t> emergency;         ///< Newest EMCY received, else of its error list (0x1003).
  std::optional<double> heartbeat_ms;             ///< From one to the next, as measured.
  std::optional<int> settings_as_file, settings;  ///< PDO and heartbeat objects: equal to the file, all.
};

struct BusDiagnosis {
  std::string bus;
  double load = 0, listened_s = 0;
  std::optional<double> expected_load;  ///< Worst case by the machine file.
  std::vector<NodeLine> nodes;
  Findings findings;
};

/// What survey_bus() is to read of the nodes in the machine file.
[[nodiscard]] std::map<std::uint8_t, std::vector<canopen::Object>> doctor_objects(const MachineDescription& machine);

/// @param machine nullptr: no node is expected, every node found is listed.
[[nodiscard]] BusDiagnosis diagnose(const BusSurvey& survey, const MachineDescription* machine);

/// Each of the machine's buses, surveyed alone, one after the other. @param access to each, in the file's order.
[[nodiscard]] std::vector<BusDiagnosis> diagnose_each(std::vector<BusAccess>& access, const MachineDescription& machine,
                                                      const SurveyOptions& options,
                                                      const std::function<void()>& check = {});
/// What was found of all of them: findings of the second name it.
[[nodiscard]] BusDiagnosis together(std::vector<BusDiagnosis> each, const BusDescription& bus);

// Whether two devices have one node id, or two controllers lead the machine, by the frames heard and the answers given.

/// Two signs of two devices with this node id are a fault, one is a note.
/// @param expected in the machine file. @param about of the finding.
[[nodiscard]] std::optional<Finding> second_device(const BusSurvey& survey, const MachineDescription& machine,
                                                   const SurveyedNode& node, const NodeDescription& expected,
                                                   const std::string& about);

/// Beside the one that leads the machine meanwhile.
[[nodiscard]] std::optional<Finding> second_controller(const BusSurvey& survey, const MachineDescription& machine,
                                                       const std::string& about);

}  // namespace knuckle::bringup
