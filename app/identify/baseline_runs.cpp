// The papers' methods on motion of ours, and the figures of their pages.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <sstream>
#include <tuple>
#include <utility>

#include "app/identify/baseline_report.h"
#include "app/identify/commission.h"
#include "app/identify/identify_output.h"
#include "app/report/plots.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/least_squares.h"
#include "estimation/identification/paper_motions.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::identify {
namespace {

using estimation::BaseParameters;
using estimation::kInertia;
using estimation::kMomentX;
using estimation::kMomentZ;
using estimation::MalagutiOptions;
using estimation::Recording;

constexpr std::array<std::string_view, 3> kPapers{"static", "malaguti", "kim"};
constexpr int kPoses = 170;  // some are lost near end stops or do not come to rest
constexpr int kVerifyingPoses = 40;
constexpr double kRest_s = 0.8;

/// Rod lengths as they really were, with normal errors of noise_m; all else as recorded.
Recording with_exact_rods(const motion::MachineRecording& run, const sim::MachineTruth& truth, double noise_m,
                          std::uint64_t seed) {
  const Kinematics kinematics(truth.machine);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, noise_m > 0 ? noise_m : 1);
  Recording recording = run.recording;
  for (std::size_t i = 0; i < recording.samples.size(); ++i) {
    for (int joint = 0; joint < kJoints; ++joint) {
      const double exact_m = kinematics.cylinder_at(joint, run.truth[i].joint_rad[joint])->length_m;
      recording.samples[i].cylinder_m[joint] = exact_m + (noise_m > 0 ? noise(random) : 0);
    }
  }
  return recording;
}

/// Coulomb, the mean of both directions [N], and viscous [N s/m].
std::pair<double, double> cylinder_friction(const sim::MachineTruth& truth, int joint) {
  const sim::LuGreFriction& friction = truth.friction[static_cast<std::size_t>(joint)];
  return {(friction.coulomb_extend_N + friction.coulomb_retract_N) / 2,
          friction.viscous_Ns_per_m * truth.viscosity_factor};
}

void add(InertiaBias& row, const MachineDescription& machine, const Recording& recording,
         const MalagutiOptions& options, const std::map<std::string, double>& truth) {
  const estimation::MalagutiResult result = estimation::identify_malaguti(machine, std::span(&recording, 1), options);
  row.bucket.push_back(result.parameters[0] / truth.at("phi_D1"));
  row.stick.push_back(result.parameters[1] / truth.at("phi_D2"));
  for (const estimation::IdentifiedParameter& p : result.summary.parameters) {
    if (p.name.starts_with("phi_f")) continue;
    ++row.intervals;
    row.covered += std::abs(p.value - truth.at(p.name)) <= 1.96 * p.sigma ? 1 : 0;
  }
}

}  // namespace

const char* name(Paper paper) noexcept {
  return kPapers[static_cast<std::size_t>(paper)].data();
}

std::optional<Paper> paper_named(std::string_view name) noexcept {
  const auto found = std::find(kPapers.begin(), kPapers.end(), name);
  if (found == kPapers.end()) return std::nullopt;
  return static_cast<Paper>(found - kPapers.begin());
}

std::string missing_for(Paper paper, const MachineDescription& machine) {
  const int without = machine.sensors.without_pressures;
  if (without == SensorDescription::kNone) return "";
  if (paper == Paper::kKim) return "the pressures of all three cylinders";
  return without == kBoom ? "" : "the pressures of arm and bucket";
}

BaselineRuns run_baseline(Paper paper, const MachineDescription& machine, motion::MachineRun& run, std::uint64_t seed) {
  BaselineRuns runs;
  switch (paper) {
    case Paper::kStatic:
      runs.identification.push_back(run.stops(estimation::static_poses(machine, kPoses, seed), kRest_s));
      runs.verification.push_back(run.stops(estimation::static_poses(machine, kVerifyingPoses, seed + 1000), kRest_s));
      break;
    case Paper::kMalaguti:
      runs.identification.push_back(run.follow(estimation::malaguti_dig_like_motion(machine, seed)));
      runs.verification.push_back(run.follow(estimation::malaguti_dig_like_motion(machine, seed + 1000)));
      break;
    case Paper::kKim:
      runs.identification.push_back(run.follow(estimation::kim_slow_motion(machine)));
      runs.verification.push_back(run.follow(estimation::kim_verification_1(machine)));
      runs.verification.push_back(run.follow(estimation::kim_verification_2(machine)));
      break;
  }
  return runs;
}

BaseParameters projected_parameters(const sim::MachineTruth& truth, std::span<const motion::MachineRecording> runs) {
  constexpr std::size_t kEvery = 5;
  const estimation::RigidArm arm(truth.machine);
  std::vector<motion::TruthSample> samples;
  for (const motion::MachineRecording& run : runs) {
    for (std::size_t i = 0; i < run.truth.size(); i += kEvery) samples.push_back(run.truth[i]);
  }
  const auto rows = static_cast<Eigen::Index>(kJoints * samples.size());
  estimation::LeastSquaresProblem problem;
  problem.columns.resize(rows, estimation::kBaseParameters);
  problem.right.resize(rows);
  problem.weight = Eigen::VectorXd::Ones(rows);
  Eigen::Index at = 0;
  for (const motion::TruthSample& s : samples) {
    const JointVector torque = s.lever_m.cwiseProduct(s.cylinder_N - s.friction_N);
    problem.columns.middleRows<kJoints>(at) =
        arm.inverse_dynamics(estimation::Pose(s.joint_rad, truth.hull_pitch_rad), estimation::absolute(s.joint_radps),
                             estimation::absolute(s.joint_radps2));
    problem.right.segment<kJoints>(at) << torque[0] - torque[1], torque[1] - torque[2], torque[2];
    at += kJoints;
  }
  return estimation::solve_least_squares(problem).parameters;
}

PlanarVector own_moment(const MachineDescription& machine, const BaseParameters& base, int link) {
  const double m3 = machine.links[kBucket].mass_kg, m2 = machine.links[kArm].mass_kg;
  const JointVector later(machine.links[kBoom].length_m * (m2 + m3), machine.links[kArm].length_m * m3, 0);
  return {base[kMomentX + link] - later[link], base[kMomentZ + link]};
}

std::map<std::string, double> baseline_truth(Paper paper, const MachineDescription& machine,
                                             const sim::MachineTruth& truth, const BaselineRuns& runs) {
  const BaseParameters base =
      projected_parameters(truth, runs.verification.empty() ? runs.identification : runs.verification);
  std::map<std::string, double> values;
  if (paper == Paper::kKim) {
    constexpr double kDegPerRad = 180 / std::numbers::pi;
    for (int i = 0; i < kJoints; ++i) {
      const std::string n = std::to_string(i + 1);
      const PlanarVector own = own_moment(machine, base, i);
      values["m" + n + " L_O" + n + "G" + n] = own.norm();
      values["A_mc" + n] = std::atan2(own.y(), own.x()) * kDegPerRad;
      std::tie(values["f_c" + n], values["f_v" + n]) = cylinder_friction(truth, i);
    }
    return values;
  }
  const bool still = paper == Paper::kStatic;
  for (int i = kBucket, s = 1; i >= (still ? kBoom : kArm); --i, s += 2) {
    values[(still ? "S" : "phi_S") + std::to_string(s)] = base[kMomentX + i];
    values[(still ? "S" : "phi_S") + std::to_string(s + 1)] = base[kMomentZ + i];
  }
  if (still) return values;
  values["phi_D1"] = base[kInertia + kBucket];
  values["phi_D2"] = base[kInertia + kArm];
  for (const auto& [joint, first] : {std::pair{kBucket, 1}, std::pair{kArm, 3}}) {
    std::tie(values["phi_f" + std::to_string(first)], values["phi_f" + std::to_string(first + 1)]) =
        cylinder_friction(truth, joint);
  }
  return values;
}

std::vector<InertiaBias> malaguti_bias(const MachineDescription& machine, std::uint64_t first_seed, int machines,
                                       const std::function<void(double)>& progress) {
  constexpr double kNoise_m = 1e-4;
  std::vector<InertiaBias> rows{{"the authors' settings, sensors as they are", {}, {}},
                                {"the same on exact rod lengths", {}, {}},
                                {"the same on exact rod lengths with 0.1 mm of white noise", {}, {}},
                                {"2 Hz filter and 41-sample cubic, sensors as they are", {}, {}}};
  for (int i = 0; i < machines; ++i) {
    if (progress) progress(static_cast<double>(i) / machines);
    const std::uint64_t seed = first_seed + static_cast<std::uint64_t>(i);
    const sim::MachineTruth truth = sim::sample_truth(machine, seed);
    motion::MachineRun run(machine, truth, {}, middle_of_range(machine), seed);
    const motion::MachineRecording made = run.follow(estimation::malaguti_dig_like_motion(machine, seed));
    const auto values = baseline_truth(Paper::kMalaguti, machine, truth, {{made}, {}});
    add(rows[0], machine, made.recording, {}, values);
    add(rows[1], machine, with_exact_rods(made, truth, 0, seed), {}, values);
    add(rows[2], machine, with_exact_rods(made, truth, kNoise_m, seed), {}, values);
    add(rows[3], machine, made.recording, estimation::repaired_malaguti_options(), values);
  }
  return rows;
}

namespace {

/// From shortly before the joint leaves where it was to shortly after it comes to where it stays.
std::pair<double, double> moving(const std::vector<double>& angle_deg, double step_s) {
  constexpr double kMoved_deg = 1, kAround_s = 2;
  std::size_t first = 0, last = angle_deg.size();
  while (first < last && !(std::abs(angle_deg[first] - angle_deg.front()) > kMoved_deg)) ++first;
  while (last > first && !(std::abs(angle_deg[last - 1] - angle_deg.back()) > kMoved_deg)) --last;
  return {std::max(0.0, static_cast<double>(first) * step_s - kAround_s),
          static_cast<double>(last) * step_s + kAround_s};
}

/// A round number that parts the values' span into about four.
double round_step(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  if (low == high) return 1;
  const double rough = (*high - *low) / 4, decade = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (rough <= factor * decade) return factor * decade;
  }
  return 10 * decade;
}

/// Estimated less measured torque.
std::vector<double> error_series(const estimation::TorqueComparison& torque, int joint) {
  std::vector<double> error = torque_series(torque, torque.modelled_Nm, joint);
  const std::vector<double> measured = torque_series(torque, torque.measured_Nm, joint);
  for (std::size_t i = 0; i < error.size(); ++i) error[i] -= measured[i];
  return error;
}

}  // namespace

report::PageFigure torque_figure(const std::string& title, const std::string& caption,
                                 const estimation::TorqueComparison& torque, const std::vector<int>& joints,
                                 const estimation::TorqueComparison* by_default) {
  const std::vector<double> t = times(torque.usable.size(), torque.step_s);
  report::PanelPlot plot;
  for (const int joint : joints) {
    plot.panel(std::string(kJointNames[static_cast<std::size_t>(joint)]) + ", N m");
    plot.line(t, torque_series(torque, torque.measured_Nm, joint), "measured",
              by_default == nullptr ? report::kBlue : report::kSky, by_default == nullptr ? "lw 1.2" : "lw 2.5");
    plot.line(t, torque_series(torque, torque.modelled_Nm, joint), by_default == nullptr ? "estimated" : "their method",
              report::kVermilion, "dt 2 lw 1.6");
    if (by_default == nullptr) continue;
    const std::vector<double> default_t = times(by_default->usable.size(), by_default->step_s);
    plot.line(default_t, torque_series(*by_default, by_default->modelled_Nm, joint), "default method", report::kGreen,
              "lw 1");
    plot.panel("error, N m");
    plot.line(t, error_series(torque, joint), "their method", report::kVermilion, "lw 1");
    plot.line(default_t, error_series(*by_default, joint), "default method", report::kGreen, "lw 1");
  }
  return {title, caption, plot.figure(t)};
}

report::PageFigure pressure_figure(const std::string& title, const MachineDescription& machine,
                                   const estimation::Recording& recording, int joint) {
  const JointSeries series = joint_series(machine, recording, joint);
  report::PanelPlot plot;
  plot.panel(std::string(kJointNames[static_cast<std::size_t>(joint)]) + ", deg");
  plot.line(series.t_s, series.angle_deg, "", report::kBlue);
  plot.panel("pressure, bar");
  plot.line(series.t_s, series.head_bar, "A, head side", report::kVermilion, "lw 1.2");
  plot.line(series.t_s, series.rod_bar, "B, rod side", report::kGreen, "lw 1.2");
  const auto [first_s, last_s] = moving(series.angle_deg, recording.step_s);
  return {title, "Joint angle, and the pressures at both ports of its cylinder, while it moves.",
          plot.figure(first_s, last_s)};
}

report::PageFigure wrench_figure(const std::string& title, const std::string& caption, double step_s,
                                 const std::vector<Eigen::Vector3d>& wrench) {
  const std::vector<double> t = times(wrench.size(), step_s);
  std::array<std::vector<double>, 3> series;
  for (const Eigen::Vector3d& w : wrench) {
    for (std::size_t k = 0; k < series.size(); ++k) series[k].push_back(w[static_cast<Eigen::Index>(k)]);
  }
  report::PanelPlot plot;
  plot.panel("force, N");
  plot.line(t, series[0], "horizontal", report::kBlue, "lw 1.2");
  plot.line(t, series[1], "vertical", report::kVermilion, "lw 1.2");
  plot.panel("torque, N m");
  plot.line(t, series[2], "", report::kGreen, "lw 1.2");
  return {title, caption, plot.figure(t)};
}

report::PageFigure pose_figure(const std::string& title, const std::string& caption,
                               const std::vector<PoseTorque>& torques) {
  std::ostringstream script;
  script << report::plot_style() << "set multiplot layout 1," << torques.size()
         << "\nset bmargin 3.5\nset lmargin 11\n";
  for (std::size_t n = 0; n < torques.size(); ++n) {
    script << "$p" << n << " << EOD\n";
    for (std::size_t i = 0; i < torques[n].measured_Nm.size(); ++i)
      script << torques[n].estimated_Nm[i] << ' ' << torques[n].measured_Nm[i] << '\n';
    script << "EOD\nset xtics " << round_step(torques[n].estimated_Nm) << "\nset xlabel "
           << report::plot_quoted(torques[n].joint + ", estimated, N m")
           << "\nset ylabel 'measured, N m'\nplot x with lines lc rgb '" << report::kGrey << "' notitle, $p" << n
           << " using 1:2 with points pt 7 ps 0.35 lc rgb '" << report::kBlue << "' notitle\n";
  }
  script << "unset multiplot\n";
  return {title, caption, {900, 320, script.str()}};
}

}  // namespace knuckle::identify
