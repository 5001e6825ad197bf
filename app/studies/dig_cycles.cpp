#include "app/studies/dig_cycles.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>

#include "app/studies/channel_plausibility.h"
#include "core/error.h"
#include "core/quantile.h"
#include "machine/load.h"

namespace knuckle::studies {
namespace {

constexpr const char* kDataset = "excavator_dig_cycles";
constexpr double kDegree = std::numbers::pi / 180;

/// Median, 95th percentile and RMS of distances.
struct Spread {
  double median, p95, rms;
};

Spread spread(const std::vector<double>& distances) {
  double squares = 0;
  for (const double d : distances) squares += d * d;
  return {median(distances), quantile(distances, 0.95), std::sqrt(squares / static_cast<double>(distances.size()))};
}

using Prediction = std::function<PlanarVector(const TipSample&)>;

Spread tip_error(const std::vector<TipSample>& samples, const Prediction& predicted) {
  std::vector<double> distances;
  for (const TipSample& s : samples) distances.push_back((predicted(s) - s.tip_m).norm());
  return spread(distances);
}

PlanarVector median_tip(const std::vector<TipSample>& samples) {
  std::vector<double> x, z;
  for (const TipSample& s : samples) {
    x.push_back(s.tip_m.x());
    z.push_back(s.tip_m.y());
  }
  return {median(x), median(z)};
}

/// Errors of the tip on held-out cycles, beside those of simpler predictions made from the same training cycles.
void add_tip_rows(const std::vector<TipSample>& train, const std::vector<TipSample>& test, const TipGeometry& geometry,
                  std::vector<RealRow>& rows) {
  const PlanarVector constant = median_tip(train);
  const PlainChain squares = fit_plain_chain(train, 1, false), absolute = fit_plain_chain(train, 1, true);
  std::vector<TipSample> informed = train;  // with the bucket angle that the machine's computer has worked out
  for (TipSample& s : informed) s.angle_rad[kBucket] = s.bucket_joint_rad;
  const PlainChain with_joint = fit_plain_chain(informed, 1, false);
  const std::vector<std::pair<std::string, Prediction>> baselines{
      {"constant position", [&](const TipSample&) { return constant; }},
      {"three joints, least squares", [&](const TipSample& s) { return squares.tip(s.angle_rad); }},
      {"three joints, least absolute error", [&](const TipSample& s) { return absolute.tip(s.angle_rad); }},
      {"given the bucket joint (column Jbkt)", [&](const TipSample& s) {
         return with_joint.tip({s.angle_rad[kBoom], s.angle_rad[kArm], s.bucket_joint_rad});
       }}};
  const Spread own = tip_error(test, [&](const TipSample& s) { return geometry.tip(s); });
  RealRow median{kDataset, "held-out tip error, median", own.median, "m", {}};
  RealRow p95{kDataset, "held-out tip error, 95th percentile", own.p95, "m", {}};
  RealRow rms{kDataset, "held-out tip error, RMS", own.rms, "m", {}};
  for (const auto& [name, predicted] : baselines) {
    const Spread error = tip_error(test, predicted);
    median.baselines.emplace_back(name, error.median);
    p95.baselines.emplace_back(name, error.p95);
    rms.baselines.emplace_back(name, error.rms);
  }
  rows.insert(rows.end(), {median, p95, rms});

  using G = TipGeometry;
  const auto fitted = [&](const char* name, G::Index index, const char* unit, double factor, std::size_t link) {
    rows.push_back({kDataset, name, factor * geometry.value[index], unit, {{"sigma", factor * geometry.sigma[index]}}});
    if (link > 0)
      rows.back().baselines.emplace_back("three joints, least squares", std::abs(squares.coefficient[link]));
  };
  fitted("boom length", G::kBoom_m, "m", 1, 1);
  fitted("arm length", G::kArm_m, "m", 1, 2);
  fitted("bucket length", G::kBucket_m, "m", 1, 3);
  fitted("boom angle offset", G::kBoomAngle, "deg", 1 / kDegree, 0);
  fitted("arm angle offset", G::kArmAngle, "deg", 1 / kDegree, 0);
  fitted("latency of the tip behind the angles", G::kLatency_s, "s", 1, 0);
}

void add_label_rows(const std::vector<recordings::MappedTable>& cycles, std::vector<RealRow>& rows) {
  for (const SideVerdict& v : judge_sides(cycles)) {
    const std::string joint = kJointNames[static_cast<std::size_t>(v.joint)];
    rows.push_back({kDataset,
                    joint + " head and rod exchanged, confidence",
                    v.exchanged ? v.confidence : 1 - v.confidence,
                    "1",
                    {{"net work as labelled", v.work.labelled},
                     {"net work exchanged", v.work.exchanged},
                     {"weight carried as labelled", v.load.labelled},
                     {"weight carried exchanged", v.load.exchanged}}});
  }
  const RefreshVerdict refresh = judge_refresh(cycles);
  rows.push_back({kDataset, "rows with a fresh angle", refresh.angles, "1", {{"fresh pressure", refresh.pressures}}});
  rows.push_back({kDataset, "rows where tip and angles change together", refresh.tip_with_angles, "1", {}});
}

std::map<recordings::Finding::Kind, std::size_t> defects(const std::vector<recordings::MappedTable>& cycles) {
  std::map<recordings::Finding::Kind, std::size_t> count;
  for (const recordings::MappedTable& cycle : cycles) {
    for (const recordings::Finding& f : cycle.findings) ++count[f.kind];
  }
  return count;
}

}  // namespace

std::vector<recordings::MappedTable> read_dig_cycles(const std::string& dir) {
  std::error_code error;
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(dir, error)) {
    if (entry.path().extension() == ".csv") files.push_back(entry.path().string());
  }
  if (error) throw InputError(dir + ": cannot be read as a folder");
  if (files.empty()) throw InputError(dir + ": no .csv file in it");
  std::sort(files.begin(), files.end());
  const std::string map = find_config("map", "excavator_dig_survey");
  std::vector<recordings::MappedTable> cycles;
  for (const std::string& file : files) cycles.push_back(recordings::read_mapped_csv(file, map));
  return cycles;
}

std::vector<TipSample> tip_samples(const std::vector<recordings::MappedTable>& cycles) {
  std::vector<TipSample> samples;
  for (const recordings::MappedTable& cycle : cycles) {
    const auto values = [&](const char* name) -> const std::vector<double>& { return cycle.channel(name).values; };
    const auto &boom = values("boom_rad"), &arm = values("arm_rad"), &bucket = values("bucket_rad");
    const auto &joint = values("bucket_joint_rad"), &x = values("tip_x_m"), &z = values("tip_z_m");
    const auto angles = [&](std::size_t i) { return JointVector(boom[i], arm[i], bucket[i]); };
    for (std::size_t i = 0; i < boom.size(); ++i) {
      const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, boom.size() - 1);
      const double span = cycle.time_s[after] - cycle.time_s[before];
      TipSample s{angles(i), JointVector::Zero(), joint[i], {x[i], z[i]}};
      if (span <= 2 * cycle.gap_s) s.rate_radps = (angles(after) - angles(before)) / span;
      if (!s.rate_radps.allFinite()) s.rate_radps.setZero();
      if (s.angle_rad.allFinite() && std::isfinite(s.bucket_joint_rad) && s.tip_m.allFinite()) samples.push_back(s);
    }
  }
  return samples;
}

std::vector<RealRow> dig_cycle_rows(const std::string& train_dir, const std::string& test_dir) {
  std::vector<recordings::MappedTable> cycles = read_dig_cycles(train_dir);
  const std::vector<TipSample> train = tip_samples(cycles);
  std::vector<recordings::MappedTable> held_out = read_dig_cycles(test_dir);
  const std::vector<TipSample> test = tip_samples(held_out);
  if (test.empty()) throw InputError(test_dir + ": no row with all angles and a tip");
  const auto geometry = fit_tip_geometry(train);
  if (!geometry) throw InputError(train_dir + ": no geometry fits the recorded angles and tips");
  std::vector<RealRow> rows;
  add_tip_rows(train, test, *geometry, rows);
  std::move(held_out.begin(), held_out.end(), std::back_inserter(cycles));
  add_label_rows(cycles, rows);
  for (const auto& [kind, count] : defects(cycles)) {
    rows.push_back({kDataset, std::string("found: ") + recordings::name(kind), static_cast<double>(count), "1", {}});
  }
  return rows;
}

}  // namespace knuckle::studies
