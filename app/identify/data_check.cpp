#include "app/identify/data_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "app/identify/data_physics.h"
#include "app/identify/sample_check.h"
#include "app/identify/valve_check.h"
#include "app/recordings/csv_reader.h"
#include "core/error.h"
#include "machine/description.h"

namespace knuckle::identify {
namespace {

constexpr std::size_t kRowsNamed = 5;  // stretches

/// Whether labels, units and signs can be right, by the weight that cylinders carry.
class LabelChecker {
 public:
  LabelChecker(const MachineDescription& machine, const recordings::RecordedFile& file, DataCheck& check)
      : machine_(machine), file_(file), check_(check) {}

  /// What single mistake would explain it all.
  bool explain() {
    const auto better = better_reading(machine_, file_.recording);
    if (better) refuse(columns_of(better->channels), better->what);
    return better.has_value();
  }

  void check_weight() {
    const WeightFit fit = weigh(machine_, file_.recording);
    constexpr std::size_t kLeast = 20;
    if (fit.samples < kLeast && file_.recording.duration_s() > 5)
      return refuse("lengths", "give possible joint angles for hardly any sample");
    for (int j = 0; j < kJoints; ++j) {
      if (fit.decisive[static_cast<std::size_t>(j)]) check_.weight_ratio[j] = fit.ratio[j];
    }
    for (int j = 0; j < kJoints; ++j) {
      if (fit.believable(j)) continue;
      if (touched()) return refuse("the bucket", contact_text(check_.contact, file_.recording));
      if (explain()) return;
      const auto i = static_cast<std::size_t>(j);
      return refuse(
          file_.columns[2 * i] + " and " + file_.columns[2 * i + 1],
          fmt::format("balance {:.2f} times the weight on the cylinder by the machine's drawing", fit.ratio[j]) +
              fmt::format(" and leave {:.0f} % unexplained: wrong channel, unit, sign, machine file or load",
                          100 * fit.error[j]));
    }
    check_scale(fit);
  }

 private:
  /// Whether all is believable but where it looks like contact.
  [[nodiscard]] bool touched() const {
    constexpr double kMostOfIt = 0.7;
    double sum_s = 0;
    for (const Seconds& stretch : check_.contact) sum_s += stretch.to_s - stretch.from_s;
    if (sum_s == 0 || sum_s > kMostOfIt * file_.recording.duration_s()) return false;
    const WeightFit free = weigh(machine_, without(check_.contact, file_.recording));
    const auto sure = [&](int joint) {
      return free.decisive[static_cast<std::size_t>(joint)] && free.believable(joint);
    };
    return sure(kBoom) && sure(kArm) && free.believable(kBucket);
  }

  void refuse(const std::string& column, const std::string& what) {
    check_.findings.push_back(
        {column, file_.rows.front(), file_.rows.back(), file_.recording.samples.size(), what, true});
  }

  [[nodiscard]] std::string columns_of(const std::vector<std::size_t>& channels) const {
    std::string names;
    for (std::size_t i = 0; i < channels.size(); ++i) names += (i > 0 ? " and " : "") + file_.columns[channels[i]];
    return names;
  }

  /// One factor on every pressure would be identified as a heavier arm, and every force be off by it.
  void check_scale(const WeightFit& fit) {
    const double scale = fit.common_scale();
    if (scale == 1) return;
    const double range_bar = machine_.sensors.pressure_range_Pa / 1e5;
    refuse("pressures",
           fmt::format("all balance {:.2f} times the weight on the cylinders by the machine's drawing (", scale) +
               check_.weights() + fmt::format("): looks like transmitters of {:.0f} bar", range_bar / scale) +
               fmt::format(" read with a range of {:.0f} bar, or masses in the machine file are wrong", range_bar));
  }

  const MachineDescription& machine_;
  const recordings::RecordedFile& file_;
  DataCheck& check_;
};

bool refuses(const std::vector<DataFinding>& findings) {
  return std::any_of(findings.begin(), findings.end(), [](const DataFinding& f) { return f.refuses; });
}

}  // namespace

bool DataCheck::refused() const {
  return refuses(findings);
}

std::string DataCheck::weights() const {
  std::string list;
  for (int j = 0; j < kJoints; ++j) {
    list += (j > 0 ? ", " : "") + std::string(kJointNames[static_cast<std::size_t>(j)]) +
            (std::isfinite(weight_ratio[j]) ? fmt::format(" {:.2f}", weight_ratio[j]) : " unknown");
  }
  return list;
}

std::vector<std::string> DataCheck::lines() const {
  std::vector<std::string> lines;
  for (const DataFinding& f : findings) {
    if (f.refuses) lines.push_back(f.column + " " + f.what);
  }
  std::map<std::pair<std::string, std::string>, std::pair<std::size_t, std::vector<std::size_t>>> kinds;
  for (const DataFinding& f : findings) {
    if (f.refuses) continue;
    auto& [samples, rows] = kinds[{f.column, f.what}];
    samples += f.samples;
    for (std::size_t row = f.first_row; row <= f.last_row; ++row) rows.push_back(row);
  }
  for (const auto& [kind, seen] : kinds) {
    std::vector<std::size_t> rows = seen.second;
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    lines.push_back(kind.first + ": " + kind.second + ", " + std::to_string(seen.first) + " samples (row " +
                    recordings::row_list(rows, kRowsNamed) + ")");
  }
  return lines;
}

DataCheck check_data(const MachineDescription& machine, recordings::RecordedFile& file) {
  DataCheck check;
  LabelChecker labels(machine, file, check);
  std::vector<DataFinding> of_valves = check_valves(file);
  if (!check_samples(machine, file, !refuses(of_valves), check.findings)) {
    labels.explain();
    return check;
  }
  if (check.refused()) return check;
  check.contact = contact_seconds(machine, file.recording);
  labels.check_weight();
  if (check.refused()) return check;
  // Swapped lengths look like swapped valves: these are to blame only now that lengths are what they say.
  for (DataFinding& finding : of_valves) {
    if (finding.refuses && !check.weight_ratio.allFinite())
      finding.what += ", or lengths are wrong: too little motion to check them by the weight";
    check.findings.push_back(std::move(finding));
  }
  return check;
}

DataCheck require_data(const MachineDescription& machine, recordings::RecordedFile& file) {
  DataCheck check = check_data(machine, file);
  if (!check.refused()) return check;
  std::string why;
  for (const DataFinding& f : check.findings) {
    if (f.refuses) why += (why.empty() ? "" : "; ") + f.column + " " + f.what;
  }
  throw InputError(file.recording.source + ": " + why);
}

}  // namespace knuckle::identify
