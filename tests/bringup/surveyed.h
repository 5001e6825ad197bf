// What the doctor says of a simulated bus, and surveys of one that tests change.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>

#include "app/bringup/doctor_bus.h"
#include "machine/load.h"
#include "slave/node_setup.h"
#include "tests/bringup/hardware_bench.h"
#include "tests/support/few_nodes.h"
#include "transport/canopen.h"

namespace knuckle::bringup::test {

inline SurveyOptions brief() {
  SurveyOptions options;
  options.listen_s = 0.3;
  options.answer_s = 0.05;
  return options;
}

inline BusDiagnosis look(const std::shared_ptr<sim::MachineOnBus>& bus, const MachineDescription& file = solar()) {
  std::vector<BusAccess> access{sim::access_to(bus)};
  return diagnose_each(access, file, brief()).front();
}

/// All findings of this level, one line each.
inline std::string said(const BusDiagnosis& diagnosis, Finding::Level level) {
  std::string lines;
  for (const Finding& one : diagnosis.findings) {
    if (one.level == level) lines += one.about + ": " + one.text + "\n";
  }
  return lines;
}
inline std::string faults(const BusDiagnosis& diagnosis) {
  return said(diagnosis, Finding::Level::kFault);
}
inline const NodeLine& line(const BusDiagnosis& diagnosis, std::uint8_t id) {
  for (const NodeLine& one : diagnosis.nodes) {
    if (one.id == id) return one;
  }
  throw std::runtime_error("no such node");
}

inline void say(BusSurvey& survey, std::uint8_t id, canopen::Object object, std::uint32_t value) {
  for (ObjectRead& one : survey.nodes[id].objects)
    if (one.object == object) one = {object, ObjectRead::Answer::kValue, value, canopen::SdoAbort::kNone};
}

/// Surveyed nodes of this machine, set up as its file says, on a bus on which SYNC was heard for two seconds.
inline BusSurvey running(const MachineDescription& machine) {
  BusAccess access = sim::access_to(simulated_bus(machine));
  BusSurvey survey = survey_bus(access, machine.bus.bit_rate, doctor_objects(machine), brief());
  survey.listened_s = 2;
  survey.heard[canopen::kSyncId] = {static_cast<std::uint64_t>(2 * machine.bus.sync_Hz), 0};
  for (const slave::NodeScript& node : slave::node_scripts(machine)) {
    for (const slave::SetupPart& part : node.script)
      for (const slave::SdoStep& step : part.asked) say(survey, node.node.id, step.object, step.value);
    survey.heard[canopen::heartbeat_id(node.node.id)] = {20, 0};
  }
  return survey;
}
/// Of the default machine, as a healthy bus shows them.
inline BusSurvey running() {
  BusSurvey survey = running(solar());
  survey.heard[0x1A2] = {400, 0};
  survey.heard[0x1C0] = {40, 0, 39};
  return survey;
}

inline const MachineDescription& few_nodes() {
  static const MachineDescription machine = parse_machine(knuckle::test::few_nodes_text(), "few_nodes.toml");
  return machine;
}

}  // namespace knuckle::bringup::test
