#include "app/recordings/state_table.h"

#include <cstdint>
#include <limits>
#include <utility>

#include "app/recordings/recording_reader.h"
#include "core/joints.h"
#include "core/time.h"
#include "estimation/line_of_action.h"
#include "machine/device_description.h"

namespace knuckle::recordings {
namespace {

/// "setpoint_rad" is "setpoint" and "rad"; "valve" is "" and "valve".
std::pair<std::string, std::string> stem_and_end(const std::string& field) {
  const std::size_t at = field.rfind('_');
  if (at == std::string::npos) return {"", field};
  return {field.substr(0, at), field.substr(at + 1)};
}

std::vector<std::string> elements(const Field& field) {
  if (field.name == "covariance_N2") return {"xx", "xz", "zz"};
  if (field.name == "touched_share") return {estimation::kBucketSideNames.begin(), estimation::kBucketSideNames.end()};
  if (field.count == 2) return {"x", "z"};
  const auto& names = field.of_device ? kDeviceJointNames : kJointNames;
  return {names.begin(), names.end()};
}

std::vector<std::string> names_of(const Field& field) {
  if (!field.vector) return {field.name};
  const auto* const lengths = kSignalNames.begin() + kPressureChannels;
  if (field.name == "pressure_Pa") return {kSignalNames.begin(), lengths};
  if (field.name == "cylinder_m") return {lengths, lengths + kJoints};
  const auto [stem, end] = stem_and_end(field.name);
  const bool whose_joints = stem == "joint" || stem == "device" || stem == "machine";  // which the element says
  const std::string front = stem.empty() || whose_joints ? "" : stem + "_";
  std::vector<std::string> names = elements(field);
  for (std::string& name : names) name = front + name + "_" + end;
  return names;
}

}  // namespace

std::vector<std::string> column_names(const Field& field) {
  std::vector<std::string> names = names_of(field);
  if (field.part.empty()) return names;
  for (std::string& name : names) name = field.part + "_" + name;
  return names;
}

void show_unknown(slave::SlaveState& state) noexcept {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < kJoints; ++i)
    if ((state.unknown_torques >> i & 1) != 0) state.pressure_Pa[2 * i] = state.pressure_Pa[2 * i + 1] = kUnknown;
  if (state.line_sigma_m == 0) state.line_offset_m = state.line_sigma_m = kUnknown;
}

StateTable::StateTable(std::ostream& out, std::span<const Field> fields, std::span<const std::string_view> more)
    : fields_(fields), rows_(out, false) {
  RowWriter header(out, true);
  header.word("time_s", "");
  for (const std::string_view name : more) header.word(name, "");
  for (const Field& field : fields_) {
    if (field.time) continue;
    for (const std::string& name : column_names(field)) header.word(name, "");
  }
  header.end_row();
}

void StateTable::add(const void* row, std::span<const std::string_view> more) {
  rows_.exact("", to_seconds(Duration(static_cast<std::int64_t>(number_at(row, fields_.front())))));
  for (const std::string_view word : more) rows_.word("", word);
  for (const Field& field : fields_) {
    if (field.time) continue;
    if (field.word != nullptr) {
      rows_.word("", field.word(static_cast<unsigned>(number_at(row, field))));
    } else if (field.type == NumberType::kFloat) {
      rows_.exact("", static_cast<float>(number_at(row, field)));  // as few digits as a float needs
    } else {
      for (std::size_t i = 0; i < field.count; ++i) rows_.exact("", number_at(row, field, i));
    }
  }
  rows_.end_row();
}

}  // namespace knuckle::recordings
