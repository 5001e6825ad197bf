// M on the page of `knuckle-studies papers`: poses at rest, digging in the air, forces from two cylinders.
#include <span>

#include "app/identify/scores.h"
#include "app/studies/papers_page.h"
#include "estimation/identification/static_poses.h"

namespace knuckle::studies {
namespace {

using identify::Identified;
using identify::Paper;
using report::number_text;

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

const std::vector<int> kTwo{kBucket, kArm};
const std::vector<std::string> kTwoNames{"τ<sub>2</sub>, bucket", "τ<sub>1</sub>, stick"};
constexpr const char* kLikeOurs = ", RMS, both behind 3 Hz";
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

/// First of the fit, then held out, then what the percentages refer to.
TableRows table_3(const Digging& digging) {
  TableRows rows = result_head();
  for (const bool fit : {true, false}) {
    const Torques& both = fit ? digging.fit : digging.held_out;
    const std::string which = fit ? ", of the fit" : ", held out";
    for (std::size_t i = 0; i < kTwo.size(); ++i) {
      const int joint = kTwo[i];
      rows.push_back({kTwoNames[i] + ": RMS error" + which, "N m", fit ? number_text(kTable3[i].rms_Nm, 4) : kNotShown,
                      tenths(both.their_fit.rms_Nm[joint]), tenths(both.our_fit.rms_Nm[joint])});
      rows.push_back({kTwoNames[i] + ": percentage error" + which, "%",
                      fit ? number_text(kTable3[i].percent) : kNotShown, percent(both.their_fit.nrmse[joint]),
                      percent(both.our_fit.nrmse[joint])});
    }
  }
  for (std::size_t i = 0; i < kTwo.size(); ++i) {
    const auto whole = [&](const estimation::TorqueFit& fit) {
      return tenths(fit.rms_Nm[kTwo[i]] / fit.nrmse[kTwo[i]]);
    };
    rows.push_back({kTwoNames[i] + ": standard deviation of the measured torque (100 %), of the fit", "N m",
                    "(" + number_text(100 * kTable3[i].rms_Nm / kTable3[i].percent) + ")", whole(digging.fit.their_fit),
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
  rows.push_back({"force from the cylinders of stick and bucket, RMS", "N", kNotShown,
                  tenths(identify::force_rms_N(their_forces)),
                  tenths(identify::force_rms_N(solved(machine, samples, estimation::force_of_two_joints)))});
  rows.push_back({std::string("force from the cylinders of stick and bucket") + kLikeOurs, "N", kNotShown,
                  tenths(identify::force_rms_N(slowed(their_forces, theirs.options.sampling_s))), rows[1].back()});
  if (machine.sensors.without_pressures != SensorDescription::kNone) return rows;
  rows.push_back({"force from all three cylinders, RMS, behind 3 Hz", "N", kNone, kNone,
                  tenths(identify::force_rms_N(tip_forces(samples)))});
  return rows;
}

}  // namespace

TableRows write_malaguti(const MalagutiRepeated& repeated, std::ostream& out) {
  const Experiment &poses = repeated.poses, &dynamic = repeated.digging;
  const estimation::StaticResult still =
      identify_static(calibrated(poses.data.machine), std::span(poses.data.training));
  const Digging digging = digging_of(dynamic);
  const bool all_measured = dynamic.data.machine.sensors.without_pressures == SensorDescription::kNone;
  const char* const identified =
      all_measured ? "all three links and cylinders"
                   : "arm and bucket, and of the boom, whose pressures nobody measures, only what they show of it,";
  write_experiment(
      out,
      {"<b>Static</b> (their 3.1): the arm stands still in " + std::to_string(still.poses) +
           " poses over its range (theirs: about 150), those near an end stop left out (" +
           std::to_string(still.near_stops) +
           " here). Identified: first moments of bucket and stick, without friction. Held out: 40 other poses.",
       "<b>Dynamic</b> (their 3.2): " + recorded_s(dynamic.data.training) +
           " of digging in the air, never twice the same, at 100 Hz. All joints move; the boom is a base whose motion "
           "is known. Identified: inertias, moments and friction of bucket and stick, from angles and the pressures of "
           "two cylinders. Held out: another " +
           recorded_s(dynamic.data.hold_out) + ", which they did not show. Their <i>stick</i> is Knuckle's <i>arm</i>.",
       "The default method has no use for poses at rest. It identifies " + std::string(identified) + " from the same " +
           recorded_s(dynamic.data.training) + " of digging, at 200 Hz. " + verdicts(dynamic),
       "Their machine is a small excavator of unknown size with an electric motor, servovalves, angle sensors on two "
       "pins and a tilt sensor on the boom; simulated is " +
           report::escaped(dynamic.data.machine.name) +
           ", with length encoders, a tilt sensor on the hull, proportional valves and LuGre friction. Parameters "
           "differ with the machine, so percentages compare better than newton metres."});
  report::write_table(
      out, "M, table 1: parameters from poses at rest",
      "± standard deviation. X and Z: first moments along and across the link, its mass times the place "
      "of its centre; the stick's contain the bucket's mass at their pin. The standard deviations of "
      "their method are too small: least squares takes offsets of transmitters and friction at rest for "
      "independent noise. The default column is from the digging.",
      parameter_rows(Paper::kStatic, still.summary.parameters, malaguti_parameters(poses.ours, true),
                     poses.data.truth));
  report::write_table(out, "M: torques of poses at rest, held out",
                      "RMS error over the standard deviation of the measured torque.", pose_rows(poses, still));
  report::write_table(
      out, "M, table 2: parameters from motion",
      "± standard deviation; the default method's contains usual errors of sensors and lengths, but "
      "not for friction. J: moment of inertia about the link's joint. f<sub>c</sub> and f<sub>v</sub> "
      "are two of the six terms of the default method's friction; the others are breakaway, load, seals "
      "and a second f<sub>c</sub>, one for each direction. Why their inertias come out too small: "
      "<code>knuckle identify --simulate --method malaguti --report FILE</code>.",
      parameter_rows(Paper::kMalaguti, digging.theirs.summary.parameters, malaguti_parameters(dynamic.ours, false),
                     dynamic.data.truth));
  const TableRows errors = table_3(digging), forces = two_cylinder_rows(dynamic, digging.theirs);
  report::write_table(
      out, "M, table 3: errors of the torques",
      "What they print as mean square error in N m is taken as its root, and as an error of the fit: their section 3.2 "
      "names no other data. Their percentage is not defined; here it is the error over the standard deviation of the "
      "measured torque, which for their machine would be the value in brackets. Both methods up to 20 Hz.",
      errors);
  std::vector<report::PageFigure> figures;
  for (const bool fit : {true, false}) {
    const Torques& both = fit ? digging.fit : digging.held_out;
    const std::string which = fit ? "of the fit" : "held out";
    const std::string caption =
        std::string("Measured torque and what both methods estimate; below, the errors of both, ") +
        (fit ? "on the recording that they were fitted to, as in the paper."
             : "on a recording that they were not fitted to.") +
        " All behind a 20 Hz filter: their own, and one without delay for the default method.";
    figures.push_back(identify::torque_figure("M, figure 3, " + which + ": torque of the bucket", caption, both.theirs,
                                              {kBucket}, &both.ours));
    figures.push_back(identify::torque_figure("M, figure 4, " + which + ": torque of the stick", caption, both.theirs,
                                              {kArm}, &both.ours));
  }
  report::write_figures(out, figures);
  report::write_table(out, "M: force on the empty bucket, held out",
                      "The bucket touches nothing, so all of it is error. Left out is where bucket and stick are in "
                      "line. The default method's force is the running estimator's, behind a 3 Hz observer; it has "
                      "learned from the recording that was identified from.",
                      forces);
  TableRows summary;
  for (const TableRows* rows : {&errors, &forces}) {
    for (const std::vector<std::string>& row : *rows) {
      if (row.front().find("percentage error") == std::string::npos && !row.front().ends_with(kLikeOurs)) continue;
      summary.push_back(row);
      summary.back().front() = "M: " + row.front();
    }
  }
  return summary;
}

}  // namespace knuckle::studies
