#include "app/bringup/doctor_report.h"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace knuckle::bringup {
namespace {

using cli::Json;

std::string hex(int digits, std::optional<std::uint32_t> value) {
  return value ? fmt::format("0x{:0{}X}", *value, digits) : "-";
}

std::string profile_of(std::optional<std::uint32_t> device_type) {
  return device_type ? std::to_string(*device_type & 0xFFFFU) : "-";
}

std::string row(const std::array<std::string, 8>& cells) {
  return fmt::format("{:5} {:20} {:16} {:4} {:11} {:11} {:6} {}", cells[0], cells[1], cells[2], cells[3], cells[4],
                     cells[5], cells[6], cells[7]);
}

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

}  // namespace

std::vector<std::string> finding_lines(const Findings& findings) {
  std::vector<std::string> lines;
  using Level = Finding::Level;
  for (const Level level : {Level::kFault, Level::kNote, Level::kOk}) {
    for (const Finding& one : findings) {
      if (one.level != level) continue;
      lines.push_back(fmt::format("{:6}{}: {}", name(level), one.about, one.text));
    }
  }
  return lines;
}

std::vector<std::string> diagnosis_lines(const BusDiagnosis& diagnosis) {
  std::vector<std::string> lines{row({"node", "name", "state", "CiA", "vendor", "product", "error", "reading"})};
  for (const NodeLine& node : diagnosis.nodes) {
    std::string now = node.reading;
    if (node.settings) {
      now += (now.empty() ? "" : "; ") + std::to_string(*node.settings_as_file) + " of " +
             std::to_string(*node.settings) + " settings as in the machine file";
    }
    lines.push_back(row({hex(2, node.id), node.name, node.state, profile_of(node.device_type), hex(8, node.vendor),
                         hex(8, node.product), hex(2, node.error_register), now}));
  }
  lines.emplace_back();
  for (std::string& line : finding_lines(diagnosis.findings)) lines.push_back(std::move(line));
  return lines;
}

Json findings_json(const Findings& findings) {
  Json all = Json::array();
  for (const Finding& one : findings) {
    const char* level = one.level == Finding::Level::kFault ? "fault" : name(one.level);
    all.push_back({{"level", level}, {"about", one.about}, {"text", one.text}});
  }
  return all;
}

Json diagnosis_json(const BusDiagnosis& diagnosis) {
  Json nodes = Json::array();
  for (const NodeLine& node : diagnosis.nodes) {
    nodes.push_back({{"id", node.id},
                     {"name", node.name == "-" ? Json() : Json(node.name)},
                     {"state", node.state},
                     {"device_type", or_null(node.device_type)},
                     {"vendor", or_null(node.vendor)},
                     {"product", or_null(node.product)},
                     {"error_register", or_null(node.error_register)},
                     {"emergency", or_null(node.emergency)},
                     {"reading", node.reading.empty() ? Json() : Json(node.reading)},
                     {"settings_as_file", or_null(node.settings_as_file)},
                     {"settings", or_null(node.settings)}});
  }
  return {{"bus", diagnosis.bus},
          {"load", diagnosis.load},
          {"listened_s", diagnosis.listened_s},
          {"expected_load", or_null(diagnosis.expected_load)},
          {"nodes", nodes}};
}

}  // namespace knuckle::bringup
