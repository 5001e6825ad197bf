#include "app/identify/valve_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "machine/toml_reader.h"

namespace knuckle::identify {
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

}  // namespace knuckle::identify
