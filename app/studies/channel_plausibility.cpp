#include "app/studies/channel_plausibility.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "app/studies/dig_cycles.h"
#include "app/studies/tip_geometry.h"

namespace knuckle::studies {
namespace {

using Values = std::vector<double>;

constexpr std::array<double, 3> kAreaRatios{0.4, 0.55, 0.75};  // of the rod's side to the head's
constexpr std::array<double, kJoints> kExtends{1, -1, -1};     // sign of dL/dtheta

const Values& joint_values(const recordings::MappedTable& cycle, int joint, const char* suffix) {
  return cycle.channel(std::string(kJointNames[static_cast<std::size_t>(joint)]) + suffix).values;
}

double ratio(double part, double whole) {
  return whole > 0 ? part / whole : 0;
}

/// Sum and whole of one cycle: work done and moved, or rows with the right sign and all rows.
struct Tally {
  double sum = 0, whole = 0;
  void add(const Tally& other) {
    sum += other.sum;
    whole += other.whole;
  }
};

/// F dL and |F dL|.
Tally work_of(const recordings::MappedTable& cycle, int joint, bool exchanged, double area_ratio) {
  const Values& head = joint_values(cycle, joint, exchanged ? "_rod_Pa" : "_head_Pa");
  const Values& rod = joint_values(cycle, joint, exchanged ? "_head_Pa" : "_rod_Pa");
  const Values& angle =
      cycle
          .channel(joint == kBucket ? "bucket_joint_rad"
                                    : std::string(kJointNames[static_cast<std::size_t>(joint)]) + "_rad")
          .values;
  Tally work;
  for (std::size_t i = 1; i < angle.size(); ++i) {
    if (cycle.time_s[i] - cycle.time_s[i - 1] > cycle.gap_s) continue;
    const double force = 0.5 * (head[i] + head[i - 1] - area_ratio * (rod[i] + rod[i - 1]));
    const double done = force * kExtends[static_cast<std::size_t>(joint)] * (angle[i] - angle[i - 1]);
    if (!std::isfinite(done)) continue;
    work.sum += done;
    work.whole += std::abs(done);
  }
  return work;
}

/// Sign of F that carries the weight beyond a joint; 0 where it hangs close to below or above its pin.
double carrying_sign(const recordings::MappedTable& cycle, int joint, std::size_t row) {
  constexpr double kClear = 0.3;  // of the lever's cosine
  double line = 0;
  for (int i = 0; i <= joint; ++i) {
    line += i == kBucket ? cycle.channel("bucket_joint_rad").values[row] : joint_values(cycle, i, "_rad")[row];
  }
  const double lever = std::cos(line);  // gravity turns clockwise where the weight is in front of the pin
  return std::abs(lever) > kClear ? std::copysign(1.0, lever) * kExtends[static_cast<std::size_t>(joint)] : 0;
}

/// Rows in the air whose force has the sign that carries the weight.
Tally load_of(const recordings::MappedTable& cycle, int joint, bool exchanged, double area_ratio) {
  constexpr double kInAir_m = 0.2;  // tip above the boom pin: nothing is dug there
  const Values& height = cycle.channel("tip_z_m").values;
  const Values& head = joint_values(cycle, joint, exchanged ? "_rod_Pa" : "_head_Pa");
  const Values& rod = joint_values(cycle, joint, exchanged ? "_head_Pa" : "_rod_Pa");
  Tally load;
  for (std::size_t i = 0; i < height.size(); ++i) {
    const double sign = carrying_sign(cycle, joint, i);
    const double force = head[i] - area_ratio * rod[i];
    if (!(height[i] > kInAir_m) || !(std::abs(sign) > 0) || !std::isfinite(force)) continue;
    load.sum += sign * force > 0;
    ++load.whole;
  }
  return load;
}

using Test = Tally (*)(const recordings::MappedTable&, int, bool, double);

/// @param log_odds of exchange, at the area ratio for which they are closest to even.
SideVerdict::Test judged(const std::vector<recordings::MappedTable>& cycles, int joint, Test test, double& log_odds) {
  SideVerdict::Test result;
  double least = 0, most = 0;
  for (std::size_t r = 0; r < kAreaRatios.size(); ++r) {
    std::array<Tally, 2> total;
    std::size_t votes = 0, voters = 0;
    for (const recordings::MappedTable& cycle : cycles) {
      const std::array<Tally, 2> tally{test(cycle, joint, false, kAreaRatios[r]),
                                       test(cycle, joint, true, kAreaRatios[r])};
      for (std::size_t i = 0; i < 2; ++i) total[i].add(tally[i]);
      if (!(tally[0].whole > 0 && tally[1].whole > 0)) continue;
      ++voters;
      votes += ratio(tally[1].sum, tally[1].whole) > ratio(tally[0].sum, tally[0].whole);
    }
    const double odds = std::log(static_cast<double>(votes + 1) / static_cast<double>(voters - votes + 1));
    least = r == 0 ? odds : std::min(least, odds);
    most = r == 0 ? odds : std::max(most, odds);
    if (std::abs(odds) <= std::min(std::abs(least), std::abs(most))) {
      result.cycles = voters;
      result.votes_for_exchange = votes;
    }
    if (r == kAreaRatios.size() / 2) {
      result.labelled = ratio(total[0].sum, total[0].whole);
      result.exchanged = ratio(total[1].sum, total[1].whole);
    }
  }
  log_odds = least > 0 ? least : most < 0 ? most : 0;
  return result;
}

bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

/// Whether any of these channels differs between a row and the one before it.
bool changes(const std::vector<const Values*>& channels, std::size_t row) {
  return std::any_of(channels.begin(), channels.end(),
                     [&](const Values* v) { return !same((*v)[row], (*v)[row - 1]); });
}

}  // namespace

std::vector<SideVerdict> judge_sides(const std::vector<recordings::MappedTable>& cycles) {
  std::vector<SideVerdict> verdicts;
  for (int joint = 0; joint < kJoints; ++joint) {
    double by_work = 0, by_load = 0;
    SideVerdict verdict;
    verdict.joint = joint;
    verdict.work = judged(cycles, joint, work_of, by_work);
    verdict.load = judged(cycles, joint, load_of, by_load);
    verdict.exchanged = by_work + by_load > 0;
    verdict.confidence = 1 / (1 + std::exp(-std::abs(by_work + by_load)));
    verdicts.push_back(verdict);
  }
  return verdicts;
}

RefreshVerdict judge_refresh(const std::vector<recordings::MappedTable>& cycles) {
  RefreshVerdict verdict;
  double rows = 0;
  for (const recordings::MappedTable& cycle : cycles) {
    std::vector<const Values*> angles, pressures;
    for (int joint = 0; joint < kJoints; ++joint) {
      angles.push_back(&joint_values(cycle, joint, "_rad"));
      pressures.push_back(&joint_values(cycle, joint, "_head_Pa"));
      pressures.push_back(&joint_values(cycle, joint, "_rod_Pa"));
    }
    const std::vector<const Values*> tip{&cycle.channel("tip_x_m").values, &cycle.channel("tip_z_m").values};
    for (std::size_t i = 1; i < cycle.time_s.size(); ++i) {
      const bool angle = changes(angles, i), moved = changes(tip, i);
      verdict.angles += angle;
      verdict.pressures += changes(pressures, i);
      verdict.tip_with_angles += angle == moved;
      ++rows;
    }
  }
  for (double* share : {&verdict.angles, &verdict.pressures, &verdict.tip_with_angles}) {
    *share = ratio(*share, rows);
  }
  return verdict;
}

}  // namespace knuckle::studies
