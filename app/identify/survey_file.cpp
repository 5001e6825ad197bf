#include "app/identify/survey_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "app/recordings/csv_cells.h"
#include "core/error.h"
#include "core/text.h"

namespace knuckle::identify {
namespace {

constexpr std::size_t kEncoders = 3, kValues = 9;  // of a pose: readings, then three points
constexpr std::array<const char*, kValues> kNames{"boom_encoder", "arm_encoder", "bucket_encoder",
                                                  "arm_pin_x",    "arm_pin_z",   "bucket_pin_x",
                                                  "bucket_pin_z", "tip_x",       "tip_z"};

struct Column {
  std::size_t value;  ///< Index in kNames.
  double factor;      ///< Metres a unit.
};

Column column_of(const std::string& path, const std::string& header) {
  for (std::size_t i = 0; i < kValues; ++i) {
    if (header == std::string(kNames[i]) + "_m") return {i, 1};
    if (header == std::string(kNames[i]) + "_mm") return {i, 1e-3};
  }
  throw InputError(path + ": row 1: unknown column '" + shortened(header) + "'; a survey has " + kNames[0] + "_m ... " +
                   kNames[kValues - 1] + "_m, or the same in _mm");
}

std::vector<Column> columns_of(const std::string& path, const recordings::Cells& header) {
  std::vector<Column> columns;
  std::array<int, kValues> seen{};
  for (const std::string& cell : header) {
    columns.push_back(column_of(path, cell));
    if (++seen[columns.back().value] > 1) throw InputError(path + ": row 1: column '" + cell + "' appears twice");
  }
  for (std::size_t i = 0; i < kEncoders; ++i) {
    if (seen[i] == 0) throw InputError(path + ": row 1: no column '" + kNames[i] + "_m'");
  }
  for (std::size_t i = kEncoders; i < kValues; i += 2) {
    if (seen[i] != seen[i + 1]) {
      throw InputError(path + ": row 1: column '" + kNames[seen[i] ? i + 1 : i] + "_m' is missing beside '" +
                       kNames[seen[i] ? i : i + 1] + "'");
    }
  }
  if (std::all_of(seen.begin() + kEncoders, seen.end(), [](int n) { return n == 0; })) {
    throw InputError(path + ": row 1: no surveyed point: arm_pin, bucket_pin or tip, each with _x_m and _z_m");
  }
  return columns;
}

estimation::SurveyPose pose_of(const recordings::CsvFile& file, std::size_t index, const std::vector<Column>& columns) {
  const recordings::Cells &cells = file.rows[index], &header = file.rows.front();
  const std::string where = file.path + ": row " + std::to_string(index + 1) + ": ";
  if (cells.size() != columns.size()) {
    throw InputError(where + std::to_string(cells.size()) + " cells, but " + std::to_string(columns.size()) +
                     " columns");
  }
  std::array<double, kValues> value;
  value.fill(std::numeric_limits<double>::quiet_NaN());
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const bool may_be_empty = columns[c].value >= kEncoders;
    if (cells[c].empty() && may_be_empty) continue;
    value[columns[c].value] = file.number(cells[c]) * columns[c].factor;
    if (!std::isfinite(value[columns[c].value])) {
      throw InputError(where + header[c] + " = '" + shortened(cells[c]) + "': must be a number" +
                       (may_be_empty ? " or empty" : ""));
    }
  }
  for (std::size_t i = kEncoders; i < kValues; i += 2) {
    if (std::isfinite(value[i]) != std::isfinite(value[i + 1])) {
      throw InputError(where + kNames[i] + " and " + kNames[i + 1] + ": give both or none");
    }
  }
  return {{value[0], value[1], value[2]}, {value[3], value[4]}, {value[5], value[6]}, {value[7], value[8]}};
}

}  // namespace

estimation::Survey read_survey(const std::string& path, double point_sigma_m) {
  std::vector<std::string> wanted;
  for (const char* name : kNames)
    for (const char* unit : {"_m", "_mm"}) wanted.push_back(name + std::string(unit));
  recordings::CsvFile file = recordings::read_cells(path, wanted);
  recordings::Cells& header = file.rows.front();
  while (!header.empty() && header.back().empty()) header.pop_back();
  const std::vector<Column> columns = columns_of(path, header);
  std::vector<std::size_t> all(columns.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  recordings::find_decimal_mark(file, all);
  estimation::Survey survey;
  survey.source = path;
  survey.point_sigma_m = point_sigma_m;
  for (std::size_t r = 1; r < file.rows.size(); ++r) {
    recordings::Cells& cells = file.rows[r];
    while (cells.size() > columns.size() && cells.back().empty()) cells.pop_back();
    if (!cells.empty()) survey.poses.push_back(pose_of(file, r, columns));  // else a blank line
  }
  if (survey.poses.empty()) throw InputError(path + ": no pose below the header");
  return survey;
}

void write_survey(const estimation::Survey& survey, std::ostream& out) {
  for (std::size_t i = 0; i < kValues; ++i) out << (i > 0 ? "," : "") << kNames[i] << "_m";
  out << '\n';
  for (const estimation::SurveyPose& pose : survey.poses) {
    Eigen::Matrix<double, kValues, 1> values;
    values << pose.cylinder_m, pose.arm_pin_m, pose.bucket_pin_m, pose.tip_m;
    for (std::size_t i = 0; i < kValues; ++i) {
      const double value = values[static_cast<Eigen::Index>(i)];
      out << (i > 0 ? "," : "") << (std::isfinite(value) ? fmt::format("{:.5f}", value) : "");
    }
    out << '\n';
  }
}

}  // namespace knuckle::identify
