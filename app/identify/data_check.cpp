#include "app/identify/data_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "app/recordings/csv_reader.h"
#include "core/error.h"
#include "estimation/identification/motion.h"
#include "machine/toml_reader.h"

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
    check_scale(apart_from_contact().value_or(fit));
  }

 private:
  /// What is left where some of it looks like contact, but not most of it: a touch carries weight.
  [[nodiscard]] std::optional<WeightFit> apart_from_contact() const {
    constexpr double kMostOfIt = 0.7;
    double sum_s = 0;
    for (const Seconds& stretch : check_.contact) sum_s += stretch.to_s - stretch.from_s;
    if (sum_s == 0 || sum_s > kMostOfIt * file_.recording.duration_s()) return std::nullopt;
    return weigh(machine_, without(check_.contact, file_.recording));
  }

  /// Whether all is believable but where it looks like contact.
  [[nodiscard]] bool touched() const {
    const auto free = apart_from_contact();
    const auto sure = [&](int joint) {
      const bool measured = joint != machine_.sensors.without_pressures;
      return !measured || (free->decisive[static_cast<std::size_t>(joint)] && free->believable(joint));
    };
    return free && sure(kBoom) && sure(kArm) && free->believable(kBucket);
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

namespace {

using estimation::Recording;

constexpr double kMostBeyond = 0.2;   // of the commands that open a valve
constexpr double kOpens_percent = 5;  // no dead band is smaller
constexpr double kSpan_s = 0.05;      // for speeds; about the lag of a valve, too
constexpr double kMoves_mps = 0.005, kNoSpeed_mps = 2;
constexpr double kLeastEachWay_s = 2;
constexpr double kFollows = 0.7, kDoesNot = 0.5;  // of the motion; sampled machines show 0.83 and more

/// How a cylinder moves with each of the commands: share of its motion that goes their way less the share that does
/// not; NaN where the command is hardly known.
struct Following {
  JointVector agreement = JointVector::Zero();
  bool decisive = false;  ///< Moved long enough both ways.
  [[nodiscard]] bool above(int command, double bound) const {
    return !decisive || std::isnan(agreement[command]) || agreement[command] > bound;
  }
};

Following following(const Recording& recording, int cylinder) {
  const auto reach = static_cast<std::size_t>(std::max(1.0, std::round(kSpan_s / 2 / recording.step_s)));
  Following result;
  JointVector known = JointVector::Zero();
  double out_s = 0, in_s = 0;
  std::size_t whole = 0;  // usable samples in a row: where one is missing lengths may go on from elsewhere
  for (std::size_t end = 0; end < recording.samples.size(); ++end) {
    whole = recording.usable[end] != 0 ? whole + 1 : 0;
    if (whole <= 2 * reach) continue;
    const std::size_t i = end - reach;
    const double speed_mps =
        (recording.samples[i + reach].cylinder_m[cylinder] - recording.samples[i - reach].cylinder_m[cylinder]) /
        (static_cast<double>(2 * reach) * recording.step_s);
    if (std::abs(speed_mps) < kMoves_mps || std::abs(speed_mps) > kNoSpeed_mps) continue;
    (speed_mps > 0 ? out_s : in_s) += recording.step_s;
    for (int j = 0; j < kJoints; ++j) {
      const double command = recording.valve[i - reach][j];
      if (!std::isfinite(command)) continue;
      known[j] += 1;
      if (command != 0) result.agreement[j] += command * speed_mps > 0 ? 1 : -1;
    }
  }
  for (int j = 0; j < kJoints; ++j) {
    const bool tells = known[j] * recording.step_s >= kLeastEachWay_s;
    result.agreement[j] = tells ? result.agreement[j] / known[j] : std::nan("");
  }
  result.decisive = std::min(out_s, in_s) >= kLeastEachWay_s;
  return result;
}

class ValveChecker {
 public:
  explicit ValveChecker(recordings::RecordedFile& file) : file_(file), recording_(file.recording) {}

  std::vector<DataFinding> run() {
    if (recording_.valve.empty()) return {};
    bool in_range = true;
    for (int j = 0; j < kJoints; ++j) in_range = check_range(j) && in_range;
    if (in_range) check_direction();
    return std::move(findings_);
  }

 private:
  [[nodiscard]] const std::string& column(int joint) const {
    return file_.valve_columns[static_cast<std::size_t>(joint)];
  }
  void forget(std::size_t sample, int joint) {
    recording_.valve[sample][joint] = std::numeric_limits<double>::quiet_NaN();
  }
  void refuse(const std::string& columns, const std::string& what) {
    findings_.push_back({columns, file_.rows.front(), file_.rows.back(), recording_.samples.size(), what, true});
  }

  /// @return false where the whole column is of something else.
  bool check_range(int joint) {
    std::size_t open = 0, beyond = 0;
    double largest = 0;
    for (const JointVector& command : recording_.valve) {
      const double size = std::abs(command[joint]);
      if (!(size > 0)) continue;  // unknown, too
      ++open;
      beyond += size > 1 ? 1U : 0U;
      largest = std::max(largest, size);
    }
    if (static_cast<double>(beyond) > kMostBeyond * static_cast<double>(open)) {
      const char* percent =
          largest > kOpens_percent && largest <= 100 ? ": looks like percent taken as a fraction" : "";
      refuse(column(joint), "reaches " + number_text(largest) + "; commands lie within [-1, 1]" + percent);
      return false;
    }
    for (std::size_t i = 0; i < recording_.valve.size() && beyond > 0; ++i) {
      const std::size_t first = i;
      for (; i < recording_.valve.size() && std::abs(recording_.valve[i][joint]) > 1; ++i) forget(i, joint);
      if (i > first)
        findings_.push_back({column(joint), file_.rows[first], file_.rows[i - 1], i - first,
                             "outside [-1, 1], not used for this valve", false});
    }
    return true;
  }

  void check_direction() {
    PerJoint<Following> cylinders;
    bool fits = true;
    for (int k = 0; k < kJoints; ++k) {
      Following& cylinder = cylinders[static_cast<std::size_t>(k)] = following(recording_, k);
      fits = fits && cylinder.above(k, kDoesNot);
    }
    if (fits || permuted(cylinders)) return;
    for (int k = 0; k < kJoints; ++k) {
      const Following& cylinder = cylinders[static_cast<std::size_t>(k)];
      if (!cylinder.above(k, -kFollows)) {
        refuse(column(k), "has the wrong sign: its cylinder moves against it");
      } else if (!cylinder.above(k, kDoesNot)) {
        for (std::size_t i = 0; i < recording_.valve.size(); ++i) forget(i, k);
        findings_.push_back({column(k), file_.rows.front(), file_.rows.back(), recording_.valve.size(),
                             "its cylinder does not follow it, not used for this valve", false});
      }
    }
  }

  /// Names the exchange of columns, a swap before a cycle, after which every cylinder follows its command.
  bool permuted(const PerJoint<Following>& cylinders) {
    constexpr std::array<std::array<int, kJoints>, 5> kOrders{{{1, 0, 2}, {2, 1, 0}, {0, 2, 1}, {1, 2, 0}, {2, 0, 1}}};
    for (const std::array<int, kJoints>& order : kOrders) {
      std::string columns, what;
      bool follows = true;
      for (int k = 0; k < kJoints; ++k) {
        const auto i = static_cast<std::size_t>(k);
        follows = follows && cylinders[i].above(order[i], kFollows);
        if (order[i] == k) continue;
        columns += (columns.empty() ? "" : " and ") + column(k);
        what += std::string(what.empty() ? "" : ", ") + kJointNames[i] + " follows " + column(order[i]);
      }
      if (!follows) continue;
      refuse(columns, "look swapped: " + what);
      return true;
    }
    return false;
  }

  recordings::RecordedFile& file_;
  Recording& recording_;
  std::vector<DataFinding> findings_;
};

}  // namespace

std::vector<DataFinding> check_valves(recordings::RecordedFile& file) {
  return ValveChecker(file).run();
}

namespace {

using estimation::Recording;

// Transmitters lag by 2 to 8 ms and an estimate errs by as much; steps of 50 ms, the slowest, let it err by more.
constexpr double kInStep_s = 0.04;
constexpr double kTellsAlone_s = 35;  // shorter ones hardly identify a machine
// Found on every machine tried. Looked for farther, so that it is no clamped value.
constexpr double kMostTakenOff_s = 0.15;

std::string later(double lag_s) {
  const bool clamped = std::abs(lag_s) >= estimation::kMostPressureLag_s;
  return std::to_string(std::lround(1e3 * std::abs(lag_s))) + " ms " + (clamped ? "or more " : "") +
         (lag_s > 0 ? "later" : "earlier");
}

}  // namespace

TimeSkew take_off_skew(const MachineDescription& machine, IdentifyData& data) {
  const double lag_s = estimation::pressure_lag_s(machine, data.training).value_or(0);
  for (const Recording& recording : data.training) {
    if (data.training.size() == 1 || recording.duration_s() < kTellsAlone_s) continue;
    const double alone_s = estimation::pressure_lag_s(machine, {recording}).value_or(lag_s);
    if (std::abs(alone_s - lag_s) > kInStep_s)
      return {recording.source + ": pressures come " + later(alone_s) + " than lengths, in all recordings together " +
                  later(lag_s) + ": not sampled by one clock",
              true};
  }
  if (std::abs(lag_s) <= kInStep_s) return {};
  const std::string what = "pressures come " + later(lag_s) + " than lengths";
  if (std::abs(lag_s) > kMostTakenOff_s)
    return {what + "; at most " + std::to_string(std::lround(1e3 * kMostTakenOff_s)) + " ms can be corrected", true};
  for (std::vector<Recording>* recordings : {&data.training, &data.hold_out}) {
    for (Recording& recording : *recordings) recording = estimation::without_pressure_lag(recording, lag_s);
  }
  return {what + ": corrected", false};
}

}  // namespace knuckle::identify
