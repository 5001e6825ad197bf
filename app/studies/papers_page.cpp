// The page of `knuckle-studies papers`. Each table has a column for what the paper prints, one for its authors' method
// and one for the default method, both on the same recordings of the simulated machine.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/identify/baseline_report.h"
#include "app/identify/identify_output.h"
#include "app/identify/scores.h"
#include "app/report/html.h"
#include "app/report/plots.h"
#include "app/report/result_text.h"
#include "app/studies/offline_estimator.h"
#include "app/studies/papers.h"
#include "core/filters.h"
#include "estimation/force_estimator.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/static_poses.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::studies {
namespace {

using estimation::IdentifiedParameter;
using estimation::Recording;
using estimation::TorqueComparison;
using estimation::TorqueFit;
using identify::Identified;
using identify::Paper;
using report::number_text;

using TableRows = std::vector<std::vector<std::string>>;
constexpr const char* kNotShown = "not shown";
constexpr const char* kNone = "-";
constexpr double kPublished_N = 200;  // K: "horizontal and vertical forces which are under 200N"

TableRows result_head() {
  return {{"", "unit", "published", "their method", "default method"}};
}

std::string recorded_s(const std::vector<Recording>& recordings) {
  return number_text(identify::total_s(recordings), 2) + " s";
}

// Torques of one recording by both methods.

struct Torques {
  TorqueComparison theirs, ours;
  TorqueFit their_fit, our_fit;
};

/// @param cutoff_Hz up to which theirs is given, so that ours is judged likewise; 0: unfiltered.
template <typename Result>
Torques torques(const Experiment& experiment, const Result& result, const Recording& recording, double cutoff_Hz) {
  const MachineDescription machine = calibrated(experiment.data.machine);
  Torques both{compare_torque(result, machine, recording),
               estimation::compare_torque(*experiment.ours.machine.dynamics_calibration, machine, recording),
               {},
               {}};
  both.their_fit = torque_fit(both.theirs, 0);
  both.our_fit = torque_fit(both.ours, cutoff_Hz);
  return both;
}

std::string percent(double share) {
  return number_text(100 * share);
}

// Forces at the tip of the empty bucket.

/// What the running estimator, calibrated by the default method, makes of each held-out recording, one after the other,
/// once it has run over the recordings that were identified from. Not valid without a usable calibration, which no
/// machine would run with.
std::vector<std::vector<EstimateSample>> estimates(const Experiment& experiment) {
  if (!experiment.ours.summary.usable) {
    std::vector<std::vector<EstimateSample>> none;
    for (const Recording& recording : experiment.data.hold_out) none.emplace_back(recording.samples.size());
    return none;
  }
  OfflineEstimator estimator(calibrated(experiment.ours.machine), experiment.data.training.front().step_s);
  for (const Recording& recording : experiment.data.training) (void)estimator.run(recording);
  std::vector<std::vector<EstimateSample>> all;
  for (const Recording& recording : experiment.data.hold_out) all.push_back(estimator.run(recording));
  return all;
}

/// @param solve of estimation/identification/baseline.h. @return one answer a sample, NaN where there is none.
template <typename Solve>
auto solved(const MachineDescription& machine, const std::vector<EstimateSample>& samples, Solve solve) {
  const Kinematics kinematics(machine);
  using Answer = decltype(solve({}, {}, {}));
  std::vector<Answer> answers(samples.size(), Answer::Constant(std::nan("")));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const estimation::JointLoad& load = samples[i].load;
    if (samples[i].valid) answers[i] = solve(kinematics.tip_jacobian(load.joint_rad), load.joint_rad, load.torque_Nm);
  }
  return answers;
}

std::vector<PlanarVector> tip_forces(const std::vector<EstimateSample>& samples) {
  std::vector<PlanarVector> forces;
  for (const EstimateSample& sample : samples)
    forces.push_back(sample.valid ? sample.tip_N : PlanarVector::Constant(std::nan("")));
  return forces;
}

/// As slow as the reported force of the default method is.
template <typename Vector>
std::vector<Vector> slowed(std::vector<Vector> values, double step_s) {
  LowPass<Vector> filter(estimation::kSlowBand.observer_Hz, step_s, Vector::Zero());
  bool started = false;
  for (Vector& value : values) {
    const bool known = value.allFinite();
    if (known && !started) filter.reset(value);
    if (known) value = filter.step(value);
    started = known;
  }
  return values;
}

using Wrenches = std::vector<Eigen::Vector3d>;

double largest(const Wrenches& wrenches, Eigen::Index component) {
  double most = std::nan("");
  for (const Eigen::Vector3d& w : wrenches) most = std::fmax(most, std::abs(w[component]));  // fmax leaves NaN out
  return most;
}

/// Share of the known samples whose horizontal and vertical force are both as small as published.
double share_as_published(const Wrenches& wrenches) {
  double known = 0, small = 0;
  for (const Eigen::Vector3d& w : wrenches) {
    if (!w.allFinite()) continue;
    ++known;
    small += w.head<2>().cwiseAbs().maxCoeff() < kPublished_N ? 1 : 0;
  }
  return small / known;
}

// Parameters of the default method in the papers' terms.

std::string with_sigma(double value, double sigma) {
  return number_text(value, 4) + " ± " + number_text(sigma, 2);
}

/// @param gradient of the value to the default method's parameters.
std::string with_sigma(const Identified& ours, double value, const CalibrationVector& gradient) {
  return with_sigma(value, std::sqrt(gradient.dot(ours.summary.covariance * gradient)));
}

std::string parameter(const Identified& ours, int index) {
  const CalibrationVector unit = CalibrationVector::Unit(index);
  return with_sigma(ours, unit.dot(ours.machine.dynamics_calibration->parameters), unit);
}

/// What both directions have in common; the rest is mostly the transmitters' offset.
std::string coulomb(const Identified& ours, int joint) {
  CalibrationVector mean = CalibrationVector::Zero();
  mean[friction_index(joint, kCoulombExtend)] = mean[friction_index(joint, kCoulombRetract)] = 0.5;
  return with_sigma(ours, mean.dot(ours.machine.dynamics_calibration->parameters), mean);
}

/// In M's order, moments only or all.
std::vector<std::string> malaguti_parameters(const Identified& ours, bool moments_only) {
  using estimation::kInertia, estimation::kMomentX, estimation::kMomentZ;
  std::vector<std::string> all;
  if (!moments_only) {
    for (const int joint : {kBucket, kArm}) all.push_back(parameter(ours, kInertia + joint));
  }
  for (const int joint : {kBucket, kArm}) {
    for (const int moment : {kMomentX, kMomentZ}) all.push_back(parameter(ours, moment + joint));
  }
  if (moments_only) return all;
  for (const int joint : {kBucket, kArm}) {
    all.push_back(coulomb(ours, joint));
    all.push_back(parameter(ours, friction_index(joint, kViscous)));
  }
  return all;
}

/// m_i L_i and A_i, and the friction of the cylinder where K has one of the joint.
std::vector<std::string> kim_parameters(const MachineDescription& machine, const Identified& ours) {
  using estimation::kMomentX, estimation::kMomentZ;
  constexpr double kDegPerRad = 180 / std::numbers::pi, kKilo = 1e-3;
  const DynamicsCalibration& dynamics = *ours.machine.dynamics_calibration;
  std::vector<std::string> all;
  for (int i = 0; i < kJoints; ++i) {
    const PlanarVector own = identify::own_moment(machine, dynamics.base(), i);
    const double size = own.norm();
    CalibrationVector along = CalibrationVector::Zero(), across = along;
    along[kMomentX + i] = own.x() / size;
    along[kMomentZ + i] = own.y() / size;
    across[kMomentX + i] = -kDegPerRad * own.y() / (size * size);
    across[kMomentZ + i] = kDegPerRad * own.x() / (size * size);
    all.push_back(with_sigma(ours, size, along));
    all.push_back(with_sigma(ours, kDegPerRad * std::atan2(own.y(), own.x()), across));
    const FrictionCalibration friction = dynamics.friction(i);
    all.push_back("cylinder: " + number_text((friction.coulomb_extend_N + friction.coulomb_retract_N) / 2) + " N, " +
                  number_text(kKilo * friction.viscous_Ns_per_m) + " kN s/m");
  }
  return all;
}

TableRows parameter_rows(Paper paper, const std::vector<IdentifiedParameter>& theirs,
                         const std::vector<std::string>& ours, const std::map<std::string, double>& truth) {
  const std::vector<identify::PrintedParameter> printed = identify::printed_parameters(paper);
  TableRows rows = result_head();
  rows.front().front() = "parameter";
  rows.front().emplace_back("simulated machine");
  for (std::size_t i = 0; i < ours.size(); ++i) {
    const auto true_value = truth.find(theirs[i].name);
    rows.push_back({printed[i].symbol, theirs[i].unit, printed[i].value, with_sigma(theirs[i].value, theirs[i].sigma),
                    ours[i], true_value == truth.end() ? kNone : number_text(true_value->second, 4)});
  }
  return rows;
}

// What is above a paper's tables.

void write_experiment(std::ostream& out, const std::string& title, const std::vector<std::string>& paragraphs) {
  out << "<section id=\"" << report::anchor(title) << "\"><h2>" << title << "</h2>\n";
  for (const std::string& paragraph : paragraphs) out << "<p>" << paragraph << "</p>\n";
  out << "</section>\n";
}

std::string verdicts(const Experiment& experiment) {
  return "As <code>knuckle identify</code> judges by held-out torques, their method is " +
         report::escaped(identify::verdict(experiment.theirs)) + "; the default method is " +
         report::escaped(identify::verdict(experiment.ours)) + ".";
}

void write_figures(std::ostream& out, std::vector<report::PageFigure> figures, const std::string& command_line) {
  for (report::PageFigure& figure : figures)
    figure.caption += " Made by <code>" + report::escaped(command_line) + "</code>.";
  report::write_figures(out, figures);
}

// M ---------------------------------------------------------------------------------------------------------------

const std::vector<int> kTwo{kBucket, kArm};
const std::vector<std::string> kTwoNames{"τ<sub>2</sub>, bucket", "τ<sub>1</sub>, stick"};
struct PublishedError {
  double rms_Nm, percent;
};
const std::vector<PublishedError> kTable3{{43.12, 26.7}, {73.54, 18}};

struct Digging {
  estimation::MalagutiResult theirs;
  Torques fit, held_out;
};

Digging digging_of(const Experiment& experiment) {
  const MachineDescription machine = calibrated(experiment.data.machine);
  Digging digging{identify_malaguti(machine, experiment.data.training), {}, {}};
  const double cutoff_Hz = digging.theirs.options.filter_Hz;
  digging.fit = torques(experiment, digging.theirs, experiment.data.training.front(), cutoff_Hz);
  digging.held_out = torques(experiment, digging.theirs, experiment.data.hold_out.front(), cutoff_Hz);
  return digging;
}

TableRows table_3(const Digging& digging) {
  TableRows rows = result_head();
  for (const bool fit : {true, false}) {
    const Torques& both = fit ? digging.fit : digging.held_out;
    const std::string which = fit ? ", of the fit" : ", held out";
    for (std::size_t i = 0; i < kTwo.size(); ++i) {
      const int joint = kTwo[i];
      rows.push_back({kTwoNames[i] + ": RMS error" + which, "N m", fit ? number_text(kTable3[i].rms_Nm, 4) : kNotShown,
                      number_text(both.their_fit.rms_Nm[joint]), number_text(both.our_fit.rms_Nm[joint])});
      rows.push_back({kTwoNames[i] + ": percentage error" + which, "%",
                      fit ? number_text(kTable3[i].percent) : kNotShown, percent(both.their_fit.nrmse[joint]),
                      percent(both.our_fit.nrmse[joint])});
    }
  }
  for (std::size_t i = 0; i < kTwo.size(); ++i) {
    const auto whole = [&](const TorqueFit& fit) { return number_text(fit.rms_Nm[kTwo[i]] / fit.nrmse[kTwo[i]]); };
    rows.push_back({kTwoNames[i] + ": what 100 % is, of the fit", "N m",
                    number_text(100 * kTable3[i].rms_Nm / kTable3[i].percent), whole(digging.fit.their_fit),
                    whole(digging.fit.our_fit)});
  }
  return rows;
}

/// Torques of the poses that nobody was fitted to.
TableRows pose_rows(const Experiment& poses, const estimation::StaticResult& result) {
  const Torques both = torques(poses, result, poses.data.hold_out.front(), 0);
  TableRows rows = result_head();
  for (std::size_t i = 0; i < kTwo.size(); ++i)
    rows.push_back({kTwoNames[i] + ": percentage error, held-out poses", "%", kNotShown,
                    percent(both.their_fit.nrmse[kTwo[i]]), percent(both.our_fit.nrmse[kTwo[i]])});
  return rows;
}

TableRows two_cylinder_rows(const Experiment& experiment, const estimation::MalagutiResult& theirs) {
  const MachineDescription machine = calibrated(experiment.data.machine);
  const std::vector<EstimateSample> samples = estimates(experiment).front();
  const auto their_forces = external_force(theirs, machine, experiment.data.hold_out.front());
  TableRows rows = result_head();
  rows.push_back({"force from arm and bucket cylinder, RMS", "N", kNotShown,
                  number_text(identify::force_rms_N(their_forces)),
                  number_text(identify::force_rms_N(solved(machine, samples, estimation::force_of_two_joints)))});
  rows.push_back({"the same, their method behind 3 Hz as well", "N", kNotShown,
                  number_text(identify::force_rms_N(slowed(their_forces, theirs.options.sampling_s))), rows[1].back()});
  rows.push_back({"force from all three cylinders, RMS", "N", kNone, kNone,
                  number_text(identify::force_rms_N(tip_forces(samples)))});
  return rows;
}

void write_malaguti(const RepeatedPapers& papers, const std::string& command_line, std::ostream& out) {
  const Experiment &poses = papers.poses, &dynamic = papers.digging;
  const estimation::StaticResult still =
      identify_static(calibrated(poses.data.machine), std::span(poses.data.training));
  const Digging digging = digging_of(dynamic);
  write_experiment(
      out, "Malaguti and Zaghi: a force sensor of driving cylinders",
      {"<b>Static</b> (their 3.1): the arm stands still in " + std::to_string(still.poses) +
           " poses over its range, those near an end stop left out (" + std::to_string(still.near_stops) +
           " here). Identified: first moments of bucket and stick, without "
           "friction. Held out: 40 other poses.",
       "<b>Dynamic</b> (their 3.2): " + recorded_s(dynamic.data.training) +
           " of digging in the air, never twice the same, at 100 Hz. All joints move; the boom is a base whose motion "
           "is known. Identified: inertias, moments and friction of bucket and stick, from angles and the pressures of "
           "two cylinders. Held out: another " +
           recorded_s(dynamic.data.hold_out) + ", which they did not show.",
       "The default method has no use for poses at rest. It identifies all three links and cylinders from the same " +
           recorded_s(dynamic.data.training) + " of digging, at 200 Hz. " + verdicts(dynamic),
       "Their machine is a small excavator of unknown size with an electric motor, servovalves, angle sensors on two "
       "pins and a tilt sensor on the boom; simulated is " +
           report::escaped(dynamic.data.machine.name) +
           ", with length encoders, a tilt sensor on the hull, proportional valves and LuGre friction. Parameters "
           "differ with the machine, so percentages compare better than newton metres."});
  report::write_table(out, "Table 1: parameters from poses at rest",
                      "± standard deviation. Least squares takes what a transmitter has wrong and what friction holds "
                      "for independent noise, so its deviations are too small. The default column is from the digging.",
                      parameter_rows(Paper::kStatic, still.summary.parameters, malaguti_parameters(poses.ours, true),
                                     poses.data.truth));
  report::write_table(out, "Torques of poses at rest", "RMS error over the standard deviation of the measured torque.",
                      pose_rows(poses, still));
  report::write_table(out, "Table 2: parameters from motion",
                      "± standard deviation; the default method's contains usual errors of sensors and lengths, but "
                      "for friction. f_c and f_v are two of the six terms of its law; the others are breakaway, load "
                      "and seals, and each way has an f_c of its own. Why their inertias come out too small: "
                      "<code>knuckle identify --simulate --method malaguti --report</code>.",
                      parameter_rows(Paper::kMalaguti, digging.theirs.summary.parameters,
                                     malaguti_parameters(dynamic.ours, false), dynamic.data.truth));
  report::write_table(
      out, "Table 3: errors of the torques",
      "What they print as mean square error in N m is taken as its root, and as an error of the fit: their section 3.2 "
      "names no other data. Their percentage is not defined; here it is the error over the standard deviation of the "
      "measured torque. Both methods up to 20 Hz.",
      table_3(digging));
  report::write_table(out, "Force on the empty bucket, held out",
                      "The bucket touches nothing, so all of it is error; left out is where bucket and stick are in "
                      "line. The default method's force is the running estimator's, behind a 3 Hz observer; it has "
                      "learned from the recording that was identified from.",
                      two_cylinder_rows(dynamic, digging.theirs));
  std::vector<report::PageFigure> figures;
  for (const bool fit : {true, false}) {
    const Torques& both = fit ? digging.fit : digging.held_out;
    const std::string which = fit ? "of the fit" : "held out";
    const std::string caption =
        std::string("Measured torque, and what both methods estimate, above the errors of both, ") +
        (fit ? "on the recording that they were fitted to, as in the paper."
             : "on a recording that they were not fitted to.") +
        " Their torques are behind their 20 Hz filter, the default method's unfiltered.";
    figures.push_back(identify::torque_figure("Figure 3, " + which + ": torque of the bucket", caption, both.theirs,
                                              {kBucket}, &both.ours));
    figures.push_back(identify::torque_figure("Figure 4, " + which + ": torque of the stick", caption, both.theirs,
                                              {kArm}, &both.ours));
  }
  write_figures(out, std::move(figures), command_line);
}

// K ---------------------------------------------------------------------------------------------------------------

/// A recording that was verified with, or the one that was identified from.
struct Named {
  std::string name, published;
  const Recording& recording;
};

std::vector<Named> recordings_of(const Experiment& slow) {
  std::vector<Named> all{{"slow motion, of the fit", kNotShown, slow.data.training.front()}};
  for (std::size_t i = 0; i < slow.data.hold_out.size(); ++i)
    all.push_back({"verification " + std::to_string(i + 1), i == 0 ? "\"almost same\"" : "\"inertia affects\"",
                   slow.data.hold_out[i]});
  return all;
}

TableRows torque_rows(const Experiment& slow, const estimation::KimResult& theirs) {
  const auto cell = [](const TorqueFit& fit, int joint) {
    return number_text(fit.rms_Nm[joint]) + " (" + percent(fit.nrmse[joint]) + " %)";
  };
  TableRows rows = result_head();
  for (const Named& named : recordings_of(slow)) {
    const Torques both = torques(slow, theirs, named.recording, 0);
    for (int joint = 0; joint < kJoints; ++joint)
      rows.push_back({named.name + ": " + kJointNames[static_cast<std::size_t>(joint)], "N m", named.published,
                      cell(both.their_fit, joint), cell(both.our_fit, joint)});
  }
  return rows;
}

/// Force and torque at the tip of the empty bucket in one verification run.
struct TipError {
  Wrenches theirs, ours;
  double their_step_s = 0, our_step_s = 0;
  std::vector<PlanarVector> their_force, our_force;
};

std::vector<TipError> tip_errors(const Experiment& slow, const estimation::KimResult& theirs) {
  const MachineDescription machine = calibrated(slow.data.machine);
  const std::vector<std::vector<EstimateSample>> runs = estimates(slow);
  std::vector<TipError> errors;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Recording& recording = slow.data.hold_out[i];
    errors.push_back({external_wrench(theirs, machine, recording),
                      solved(machine, runs[i], estimation::wrench_of_three_joints),
                      compare_torque(theirs, machine, recording).step_s, recording.step_s,
                      external_force(theirs, machine, recording), tip_forces(runs[i])});
  }
  return errors;
}

TableRows force_rows(const std::vector<TipError>& errors) {
  TableRows rows = result_head();
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const TipError& e = errors[i];
    const std::string run = "verification " + std::to_string(i + 1) + ": ";
    const auto add = [&](const std::string& what, const std::string& unit, const std::string& published, double theirs,
                         double ours) {
      rows.push_back({run + what, unit, published, number_text(theirs), number_text(ours)});
    };
    const std::string under = "under " + number_text(kPublished_N);
    add("largest horizontal force", "N", under, largest(e.theirs, 0), largest(e.ours, 0));
    add("largest vertical force", "N", under, largest(e.theirs, 1), largest(e.ours, 1));
    add("time with both under 200 N", "%", "100", 100 * share_as_published(e.theirs), 100 * share_as_published(e.ours));
    add("largest torque about the tip", "N m", kNotShown, largest(e.theirs, 2), largest(e.ours, 2));
    add("force, RMS", "N", kNotShown, identify::force_rms_N(e.theirs), identify::force_rms_N(e.ours));
    add("the same, their method behind 3 Hz as well", "N", kNotShown,
        identify::force_rms_N(slowed(e.theirs, e.their_step_s)), identify::force_rms_N(e.ours));
    add("force without a torque about the tip, RMS", "N", kNone, identify::force_rms_N(e.their_force),
        identify::force_rms_N(e.our_force));
  }
  return rows;
}

report::PageFigure tip_figure(const std::string& title, const std::string& caption, const TipError& error) {
  const std::vector<double> their_t = identify::times(error.theirs.size(), error.their_step_s),
                            our_t = identify::times(error.ours.size(), error.our_step_s);
  const auto component = [](const Wrenches& wrenches, Eigen::Index k) {
    std::vector<double> values;
    for (const Eigen::Vector3d& w : wrenches) values.push_back(w[k]);
    return values;
  };
  constexpr const char* kPanels[] = {"horizontal, N", "vertical, N", "torque, N m"};
  report::PanelPlot plot;
  for (Eigen::Index k = 0; k < 3; ++k) {
    plot.panel(kPanels[k]);
    plot.line(their_t, component(error.theirs, k), "their method", report::kVermilion, "lw 1.2");
    plot.line(our_t, component(error.ours, k), "default method", report::kGreen, "lw 1.2");
    if (k == 2) continue;
    const std::vector<double> ends{our_t.front(), our_t.back()};
    plot.line(ends, std::vector<double>(2, kPublished_N), "200 N", report::kGrey, "dt 2 lw 1");
    plot.line(ends, std::vector<double>(2, -kPublished_N), "", report::kGrey, "dt 2 lw 1");
  }
  return {title, caption, plot.figure(our_t)};
}

void write_kim(const Experiment& slow, const std::string& command_line, std::ostream& out) {
  const MachineDescription machine = calibrated(slow.data.machine);
  const estimation::KimResult theirs = identify_kim(machine, slow.data.training);
  const Recording& moved = slow.data.training.front();
  write_experiment(
      out, "Kim et al.: a haptic device for an excavator with pressure transmitters",
      {"Bucket, arm and boom move in turn over their range and back, 3 cm/s of the rod, " +
           recorded_s(slow.data.training) +
           " in all. Identified: m L, A and a viscous friction of each joint, from three rod lengths and six pressures "
           "every 15 ms. Held out: <b>verification 1</b>, in which bucket and arm move slowly, and <b>verification "
           "2</b>, in which all links move and the boom speeds up and slows down. The bucket is empty.",
       "The default method identifies from the same recording, at 200 Hz. " + verdicts(slow),
       "Their machine is a Solar 015 Super; simulated is " + report::escaped(slow.data.machine.name) +
           ", with the same sensors and a tilt sensor. The links in the file solar015 have the moments of their table "
           "1; the simulated "
           "machine's are larger by the cylinders and the linkage, which hang on the links, and differ by what the "
           "seed samples. Pins, areas, valves, oil and LuGre friction are of the class, not of their machine."});
  write_figures(
      out,
      {identify::pressure_figure("Figure 4: pressures of the bucket cylinder when the bucket moves", machine, moved,
                                 kBucket),
       identify::pressure_figure("Figure 5: pressures of the arm cylinder when the arm moves", machine, moved, kArm),
       identify::pressure_figure("Figure 6: pressures of the boom cylinder when the boom moves", machine, moved,
                                 kBoom)},
      command_line);
  report::write_table(
      out, "Table 1: gravity and friction",
      "± standard deviation, which they do not give. m<sub>2</sub> and m<sub>3</sub> are the machine file's in both "
      "columns. The simulated machine has no friction of a joint but of its cylinders, as the default method assumes "
      "(Coulomb, viscous).",
      parameter_rows(Paper::kKim, {theirs.summary.parameters.begin(), theirs.summary.parameters.begin() + 9},
                     kim_parameters(machine, slow.ours), slow.data.truth));
  report::write_table(out, "Errors of the torques in figure 7",
                      "RMS error, in brackets over the standard deviation of the measured torque; nothing is filtered.",
                      torque_rows(slow, theirs));
  const std::vector<TipError> errors = tip_errors(slow, theirs);
  std::vector<report::PageFigure> figures;
  for (std::size_t i = 0; i < slow.data.hold_out.size(); ++i) {
    const Torques both = torques(slow, theirs, slow.data.hold_out[i], 0);
    figures.push_back(identify::torque_figure(
        std::string("Figure 7 (") + "ab"[i] + "): verification " + std::to_string(i + 1),
        "Measured torque of each joint and what both methods estimate, above the errors of both.", both.theirs,
        {kBoom, kArm, kBucket}, &both.ours));
  }
  write_figures(out, std::move(figures), command_line);
  report::write_table(
      out, "Force and torque without payload, figure 8",
      "By matrix inversion, in both columns; left out is where boom and arm are in line. All of it is error. The paper "
      "does not say of which run its figure is. The default method's torques are the running estimator's, behind a 3 "
      "Hz "
      "observer; it has learned from the slow motion. Last of each run: what three torques say of a force alone, "
      "theirs "
      "by least squares, the default method's as it is felt.",
      force_rows(errors));
  figures.clear();
  for (std::size_t i = 0; i < errors.size(); ++i)
    figures.push_back(tip_figure("Figure 8, in verification " + std::to_string(i + 1) + ": no payload",
                                 "Horizontal and vertical force and torque at the tip of the empty bucket, by matrix "
                                 "inversion.",
                                 errors[i]));
  write_figures(out, std::move(figures), command_line);
}

}  // namespace

void write_papers_page(const RepeatedPapers& papers, const report::Origin& origin, std::ostream& out) {
  report::write_page_head(out, "Knuckle: two papers, repeated");
  out << "<h1>Two papers, repeated in simulation</h1>\n<p class=\"soft\"><code>" << report::escaped(origin.command_line)
      << "</code>, " << report::escaped(origin.date_utc)
      << "</p>\n<p>Each experiment of M (F. Malaguti, S. Zaghi, <i>Force sensor by driving hydraulic cylinders</i>) "
         "and K "
         "(D. Kim et al., <i>Design of haptic device for excavator with pressure transmitter</i>) is driven on one "
         "simulated machine ("
      << report::escaped(papers.slow.data.source)
      << "), over its bus and through its valves. From the same recordings two methods identify: the authors', with "
         "their settings, and Knuckle's default one. Both use lengths and pins of a survey with 1 mm of error. "
         "<b>Published</b> is what the text of the paper says, of another machine. <b>Held out</b> is a recording that "
         "neither method was fitted to. A dash: there is no such value; forces of the default method need a usable "
         "calibration.</p>\n<p>What each paper did, what Knuckle does instead and why, misprints, and "
         "ten machines in place of this one: docs/theory.md, \"The two papers' methods\".</p>\n";
  write_malaguti(papers, origin.command_line, out);
  write_kim(papers.slow, origin.command_line, out);
  report::write_page_end(out);
}

}  // namespace knuckle::studies
