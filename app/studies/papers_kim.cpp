// K on the page of `knuckle-studies papers`: slow motion, two verification runs, force and torque without payload.
#include <numbers>

#include "app/identify/identify_output.h"
#include "app/identify/scores.h"
#include "app/studies/papers_page.h"

namespace knuckle::studies {
namespace {

using estimation::Recording;
using estimation::TorqueFit;
using identify::Identified;
using identify::Paper;
using report::number_text;

constexpr double kPublished_N = 200;  // "horizontal and vertical forces which are under 200N"

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

/// m_i L_i and A_i, and nothing for the friction of the joint.
std::vector<std::string> kim_parameters(const MachineDescription& machine, const Identified& ours) {
  using estimation::kMomentX, estimation::kMomentZ;
  constexpr double kDegPerRad = 180 / std::numbers::pi;
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
    all.emplace_back(kNone);
  }
  return all;
}

/// Below K's table: the friction that its μ stands for where the simulated machine has it.
TableRows cylinder_friction_rows(const Experiment& slow) {
  TableRows rows;
  for (int i = 0; i < kJoints; ++i) {
    const std::string cylinder = std::string(kJointNames[static_cast<std::size_t>(i)]) + " cylinder";
    const std::string link = std::to_string(i + 1);
    const auto add = [&](const std::string& index, const std::string& unit, const std::string& ours) {
      rows.push_back({"f<sub>" + index + "</sub>, " + cylinder, unit, kNone, kNone, ours,
                      number_text(slow.data.truth.at("f_" + index + link), 4)});
    };
    add("c", "N", coulomb(slow.ours, i));
    add("v", "kg/s", parameter(slow.ours, friction_index(i, kViscous)));
  }
  return rows;
}

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
    return tenths(fit.rms_Nm[joint]) + " (" + percent(fit.nrmse[joint]) + " %)";
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
      rows.push_back({run + what, unit, published, tenths(theirs), tenths(ours)});
    };
    constexpr const char* kUnder = "under 200 (run not named)";
    add("largest horizontal force", "N", kUnder, largest(e.theirs, 0), largest(e.ours, 0));
    add("largest vertical force", "N", kUnder, largest(e.theirs, 1), largest(e.ours, 1));
    add("time with both forces under 200 N", "%", kNotShown, 100 * share_as_published(e.theirs),
        100 * share_as_published(e.ours));
    add("largest torque about the tip", "N m", kNotShown, largest(e.theirs, 2), largest(e.ours, 2));
    add("force, RMS", "N", kNotShown, identify::force_rms_N(e.theirs), identify::force_rms_N(e.ours));
    add("force, RMS, both behind 3 Hz", "N", kNotShown, identify::force_rms_N(slowed(e.theirs, e.their_step_s)),
        identify::force_rms_N(e.ours));
    add("force from three torques, no torque about the tip, RMS", "N", kNone, identify::force_rms_N(e.their_force),
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

/// The rows of force_rows() that sum it up.
TableRows summary_of(const TableRows& forces) {
  TableRows summary;
  for (const std::vector<std::string>& row : forces) {
    if (!row.front().ends_with("under 200 N") && !row.front().ends_with("behind 3 Hz")) continue;
    summary.push_back(row);
    summary.back().front() = "K: " + row.front();
  }
  return summary;
}

}  // namespace

TableRows write_kim(const Experiment& slow, std::ostream& out) {
  const MachineDescription machine = calibrated(slow.data.machine);
  const estimation::KimResult theirs = identify_kim(machine, slow.data.training);
  const Recording& moved = slow.data.training.front();
  write_experiment(
      out,
      {"Bucket, arm and boom move in turn over their range and back. The paper says \"slow motion\"; 3 cm/s of the "
       "rod, " +
           recorded_s(slow.data.training) +
           " in all, are Knuckle's choice. Identified: m L, A and a viscous friction of each joint, from three rod "
           "lengths and six pressures "
           "every 15 ms: of each link the mass m, the distance L and the direction A of its centre of mass from its "
           "joint. Held out: <b>verification 1</b>, in which bucket and arm move slowly, and <b>verification "
           "2</b>, in which all links move and the boom speeds up and slows down. The bucket is empty.",
       "The default method identifies from the same recording, at 200 Hz. " + verdicts(slow),
       "Their machine is a Solar 015 Super; simulated is " + report::escaped(slow.data.machine.name) +
           ", with the same sensors and a tilt sensor. The links in the file solar015 have the moments of their table "
           "1; the simulated machine's are larger by the cylinders and the linkage, which hang on the links, and "
           "differ "
           "by what the seed samples. Pins, areas, valves, oil and LuGre friction are of the class, not of their "
           "machine."});
  std::vector<report::PageFigure> pressures{
      identify::pressure_figure("K, figure 4: pressures of the bucket cylinder when the bucket moves", machine, moved,
                                kBucket),
      identify::pressure_figure("K, figure 5: pressures of the arm cylinder when the arm moves", machine, moved, kArm),
      identify::pressure_figure("K, figure 6: pressures of the boom cylinder when the boom moves", machine, moved,
                                kBoom)};
  pressures.back().caption += " (The paper prints \"when the arm moves\".)";
  report::write_figures(out, pressures);
  TableRows parameters =
      parameter_rows(Paper::kKim, {theirs.summary.parameters.begin(), theirs.summary.parameters.begin() + 9},
                     kim_parameters(machine, slow.ours), slow.data.truth);
  const TableRows friction = cylinder_friction_rows(slow);
  parameters.insert(parameters.end(), friction.begin(), friction.end());
  report::write_table(
      out, "K, table 1: gravity and friction",
      "± standard deviation, which they do not give. m<sub>2</sub> and m<sub>3</sub> are the machine "
      "file's in both columns. Their friction μ is one of the joint; the simulated machine and the default "
      "method have friction of the cylinders instead: Coulomb f<sub>c</sub> and viscous f<sub>v</sub>, "
      "last.",
      parameters);
  report::write_table(out, "K: errors of the torques in figure 7",
                      "RMS error, in brackets over the standard deviation of the measured torque. Nothing is filtered. "
                      "The paper prints "
                      "curves and no number.",
                      torque_rows(slow, theirs));
  std::vector<report::PageFigure> figures;
  for (std::size_t i = 0; i < slow.data.hold_out.size(); ++i) {
    const Torques both = torques(slow, theirs, slow.data.hold_out[i], 0);
    figures.push_back(identify::torque_figure(
        std::string("K, figure 7 (") + "ab"[i] + "): verification " + std::to_string(i + 1),
        "Measured torque of each joint and what both methods estimate; below each, the errors of both. Nothing is "
        "filtered.",
        both.theirs, {kBoom, kArm, kBucket}, &both.ours));
  }
  report::write_figures(out, figures);
  const std::vector<TipError> errors = tip_errors(slow, theirs);
  const TableRows forces = force_rows(errors);
  report::write_table(
      out, "K, figure 8: force and torque without payload",
      "By matrix inversion, in both columns. All of it is error. Left out is where boom and arm are in line. The paper "
      "does not say of which run its figure is. The default method's torques are the running estimator's, behind a 3 "
      "Hz "
      "observer; it has learned from the slow motion. Last of each run: the force alone, theirs by least squares, the "
      "default method's as it is felt.",
      forces);
  figures.clear();
  for (std::size_t i = 0; i < errors.size(); ++i)
    figures.push_back(tip_figure("K, figure 8: no payload, verification " + std::to_string(i + 1),
                                 "Horizontal and vertical force and torque at the tip of the empty bucket, by matrix "
                                 "inversion; theirs unfiltered, the default method's behind its 3 Hz observer. Dashed: "
                                 "the 200 N that they state.",
                                 errors[i]));
  report::write_figures(out, figures);
  return summary_of(forces);
}

}  // namespace knuckle::studies
