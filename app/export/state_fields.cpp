#include "app/export/state_fields.h"

#include <algorithm>
#include <array>
#include <utility>

#include "app/recordings/recording_reader.h"
#include "machine/device_joints.h"

namespace knuckle::exporting {
namespace {

constexpr std::array<std::pair<std::string_view, const char*>, 11> kUnits{{{"rad", "rad"},
                                                                           {"radps", "rad/s"},
                                                                           {"m", "m"},
                                                                           {"N", "N"},
                                                                           {"N2", "N^2"},
                                                                           {"Nm", "N m"},
                                                                           {"J", "J"},
                                                                           {"kg", "kg"},
                                                                           {"Pa", "Pa"},
                                                                           {"s", "s"},
                                                                           {"ns", "ns"}}};

/// "setpoint_rad" is "setpoint" and "rad"; "valve" is "" and "valve".
std::pair<std::string, std::string> stem_and_end(std::string_view field) {
  const std::size_t at = field.rfind('_');
  if (at == std::string_view::npos) return {"", std::string(field)};
  return {std::string(field.substr(0, at)), std::string(field.substr(at + 1))};
}

std::vector<std::string> elements(std::string_view field, std::size_t size, Joints joints) {
  if (field == "covariance_N2") return {"xx", "xz", "zz"};
  if (size == 2) return {"x", "z"};
  const auto& names = joints == Joints::kDevice ? kDeviceJointNames : kJointNames;
  return {names.begin(), names.end()};
}

}  // namespace

std::vector<std::string> element_names(std::string_view field, std::size_t size, Joints joints) {
  using recordings::kPressureChannels, recordings::kSignalNames;
  const auto* const lengths = kSignalNames.begin() + kPressureChannels;
  if (field == "pressure_Pa") return {kSignalNames.begin(), lengths};
  if (field == "cylinder_m") return {lengths, lengths + kJoints};
  auto [stem, end] = stem_and_end(field);
  const bool whose_joints = stem == "joint" || stem == "device" || stem == "machine";  // which the element says
  const std::string front = stem.empty() || whose_joints ? "" : stem + "_";
  std::vector<std::string> names = elements(field, size, joints);
  for (std::string& name : names) name = front + name + "_" + end;
  return names;
}

std::string unit_of(std::string_view field) {
  const std::string end = stem_and_end(field).second;
  const auto* const unit = std::find_if(kUnits.begin(), kUnits.end(), [&end](const auto& u) { return u.first == end; });
  return unit == kUnits.end() ? "" : unit->second;
}

}  // namespace knuckle::exporting
