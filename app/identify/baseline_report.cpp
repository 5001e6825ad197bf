#include "app/identify/baseline_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/identify/scores.h"
#include "core/quantile.h"
#include "estimation/identification/baseline.h"
#include "estimation/identification/static_poses.h"

namespace knuckle::identify {
namespace {

using estimation::IdentifiedParameter;
using estimation::Recording;
using estimation::TorqueComparison;
using estimation::TorqueFit;

/// In the papers' manner: two decimals.
std::string number(double value, const char* format = "{:.2f}") {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

void write_head(std::ostream& out, const std::string& title, const std::string& what,
                const estimation::Identification& summary, const MachineDescription& machine) {
  report::write_page_head(out, "Knuckle: " + title);
  out << "<h1>" << title << "</h1><p class=\"soft\">" << what << "</p>\n<span class=\"verdict"
      << (summary.usable ? "" : " bad") << "\">" << (summary.usable ? "usable" : "not usable") << "</span>\n"
      << "<p>" << report::escaped(machine.name) << "; " << number(summary.duration_s, "{:.0f}") << " s of data; rank "
      << summary.rank << " of " << summary.columns << ", condition number "
      << number(summary.condition_number, "{:.3g}")
      << ".</p>\n<p class=\"soft\">Usable: on every held-out recording the torque error of each joint, to 2 Hz, is at "
         "most "
      << number(100 * kWorstNrmse, "{:.0f}") << " % of the torque (RMS error over standard deviation).</p>\n";
  if (summary.reasons.empty() && summary.indistinct.empty()) return;
  out << "<ul>";
  for (const std::string& reason : summary.reasons) out << "<li>" << report::escaped(reason) << "</li>\n";
  for (const std::string& line : summary.indistinct) out << "<li>" << report::escaped(line) << "</li>\n";
  out << "</ul>\n";
}

std::string truth_of(const BaselineData& data, const IdentifiedParameter& p, double factor = 1) {
  const auto found = data.truth.find(p.name);
  return found == data.truth.end() ? "-" : number(found->second * factor);
}

/// What to show as "not identified with": the first verification run, or what was identified with.
const Recording& shown_recording(const BaselineData& data) {
  return data.verification.empty() ? data.identification.front() : data.verification.front();
}

std::string which_recording(const BaselineData& data) {
  return data.verification.empty() ? "On the data used for identification: there is no other."
                                   : "On a recording not used for identification.";
}

// M ---------------------------------------------------------------------------------------------------------------

std::vector<PoseTorque> pose_torques(const MachineDescription& machine, const estimation::StaticResult& result,
                                     const BaselineData& data) {
  std::vector<PoseTorque> torques(static_cast<std::size_t>(kJoints - result.first_link));
  int ignored = 0;
  for (const Recording& recording : data.identification) {
    for (const estimation::RestingPose& pose : resting_poses(machine, recording, {}, ignored)) {
      const JointVector estimated = estimation::joint_torque(
          estimation::RigidArm::gravity(estimation::Pose(pose.joint_rad, pose.hull_pitch_rad)) * result.parameters);
      for (int joint = result.first_link; joint < kJoints; ++joint) {
        PoseTorque& torque = torques[static_cast<std::size_t>(joint - result.first_link)];
        torque.joint = kJointNames[static_cast<std::size_t>(joint)];
        torque.measured_Nm.push_back(pose.torque_Nm[joint]);
        torque.estimated_Nm.push_back(estimated[joint]);
      }
    }
  }
  return torques;
}

/// Tables 1 and 2 in one: φ, meaning, estimate, σ, truth, the paper's.
std::vector<std::vector<std::string>> parameter_rows(Paper paper, const estimation::Identification& summary,
                                                     const BaselineData& data) {
  const std::vector<PrintedParameter> printed = printed_parameters(paper);
  std::vector<std::vector<std::string>> rows{
      {"parameter", "estimated value", "standard deviation", "unit", "simulated machine", "the paper's machine"}};
  for (std::size_t i = 0; i < summary.parameters.size(); ++i) {
    const IdentifiedParameter& p = summary.parameters[i];
    rows.push_back({printed[i].symbol, number(p.value), number(p.sigma), p.unit, truth_of(data, p), printed[i].value});
  }
  return rows;
}

/// Table 3: M calls it mean square error, its unit says root mean square.
std::vector<std::vector<std::string>> error_rows(const TorqueFit& authors, const TorqueFit& repaired) {
  std::vector<std::vector<std::string>> rows{
      {"torque", "RMS error", "percentage error", "RMS error, repaired", "percentage, repaired", "the paper"}};
  const auto add = [&](const std::string& name, int joint, const std::string& paper) {
    rows.push_back({name, number(authors.rms_Nm[joint]) + " N m", number(100 * authors.nrmse[joint], "{:.1f}") + " %",
                    number(repaired.rms_Nm[joint]) + " N m", number(100 * repaired.nrmse[joint], "{:.1f}") + " %",
                    paper});
  };
  add("τ₂, bucket", kBucket, "43.12 N m, 26.7 %");
  add("τ₁, stick", kArm, "73.54 N m, 18 %");
  return rows;
}

std::string spread(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return number(median(values)) + " (" + number(*low) + " to " + number(*high) + ")";
}

void write_bias(std::ostream& out, const std::vector<InertiaBias>& bias) {
  if (bias.empty()) return;
  std::vector<std::vector<std::string>> rows{{"variant", "J of the bucket over truth", "J of the stick over truth",
                                              "95 % intervals that contain the true value"}};
  for (const InertiaBias& row : bias)
    rows.push_back({row.variant, spread(row.bucket), spread(row.stick),
                    std::to_string(row.covered) + " of " + std::to_string(row.intervals)});
  report::write_table(
      out, "Why the inertias are too small",
      "Median and range over " + std::to_string(bias.front().stick.size()) +
          " randomly sampled machines, 40 s each. An inertia multiplies a speed, taken from seven samples of an angle "
          "that comes in steps; behind a 20 Hz filter most of that column is noise, and noise in a column pulls its "
          "parameter towards zero (errors in variables). It goes below zero because the noise of boom and stick "
          "reaches the later rows also through X, which gravity holds where it is: the inertia bends to cancel it. "
          "Least squares assumes noise in the torque only, so its standard deviations stay small. With exact rod "
          "lengths the bias vanishes, with 0.1 mm of noise it appears; a slower filter and a longer window remove the "
          "noise and keep the motion. What remains is friction that is not a function of the speed's sign alone, and "
          "pressure offsets: therefore intervals miss the true value even then.",
      rows);
}

// K ---------------------------------------------------------------------------------------------------------------

/// Table 1 of K: a row a link, three columns of parameters.
std::vector<std::vector<std::string>> kim_rows(const estimation::Identification& summary, const BaselineData& data) {
  const std::vector<PrintedParameter> printed = printed_parameters(Paper::kKim);
  std::vector<std::vector<std::string>> rows{{"link", "m<sub>i</sub> L<sub>OiGi</sub>, kg m", "A<sub>mc</sub>, degree",
                                              "μ, N m/(deg/s)", "simulated machine", "the paper's machine"}};
  for (std::size_t i = 0; i < kJoints; ++i) {
    std::vector<std::string> row{kJointNames[i]};
    for (std::size_t k = 0; k < 3; ++k) {
      const IdentifiedParameter& p = summary.parameters[3 * i + k];
      row.push_back(number(p.value) + " ± " + number(p.sigma));
    }
    row.push_back(truth_of(data, summary.parameters[3 * i]) + " kg m, " +
                  truth_of(data, summary.parameters[3 * i + 1]) + "°");
    row.push_back(printed[3 * i].value + " kg m, " + printed[3 * i + 1].value + "°, " + printed[3 * i + 2].value);
    rows.push_back(row);
  }
  const IdentifiedParameter &m2 = summary.parameters[9], &m3 = summary.parameters[10];
  rows.push_back({"fixed", "m<sub>2</sub> = " + number(m2.value) + " kg", "m<sub>3</sub> = " + number(m3.value) + " kg",
                  "", "", "not given"});
  return rows;
}

void add_fit_row(std::vector<std::vector<std::string>>& rows, const std::string& name,
                 const MachineDescription& machine, const estimation::KimResult& result, const Recording& recording) {
  const TorqueFit fit = torque_fit(compare_torque(result, machine, recording), 0);
  std::vector<std::string> row{name};
  for (int joint = 0; joint < kJoints; ++joint)
    row.push_back(number(fit.rms_Nm[joint], "{:.1f}") + " N m, " + number(100 * fit.nrmse[joint], "{:.0f}") + " %");
  row.push_back(number(force_rms_N(external_wrench(result, machine, recording)), "{:.0f}") + " N");
  row.push_back(number(force_rms_N(external_force(result, machine, recording)), "{:.0f}") + " N");
  rows.push_back(row);
}

std::string letter(std::size_t i) {
  return {'(', static_cast<char>('a' + i), ')'};
}

void write_kim_results(std::ostream& out, const MachineDescription& machine, const estimation::KimResult& result,
                       const BaselineData& data) {
  report::write_table(
      out, "Table 1: Estimation results of dynamic parameter",
      "Gravity at the joints and a viscous friction of the joint. The ± is least squares' own standard "
      "deviation, which the paper does not give: it knows neither Coulomb friction nor inertia, both of which "
      "are in the data. m L of the simulated machine counts its cylinders' weight.",
      kim_rows(result.summary, data));
  std::vector<std::vector<std::string>> rows{
      {"recording", "boom", "arm", "bucket", "no-load force, wrench", "no-load force, two unknowns"}};
  add_fit_row(rows, "slow motion, used for identification", machine, result, data.identification.front());
  for (std::size_t i = 0; i < data.verification.size(); ++i)
    add_fit_row(rows, "verification " + std::to_string(i + 1), machine, result, data.verification[i]);
  report::write_table(
      out, "Measured against estimated",
      "RMS of the torque error, also as a share of the measured torque's standard deviation, and RMS of the "
      "force at an empty bucket tip: by matrix inversion for force and torque, as in the paper, and as a force "
      "alone by least squares. The paper has forces under 200 N.",
      rows);
}

void write_static(const MachineDescription& machine, const BaselineData& data, std::ostream& out) {
  const estimation::StaticResult result =
      identify_static(machine, data.identification, estimation::all_measured_links(machine));
  write_head(out, "Static estimation", "Malaguti and Zaghi, section 3.1: poses at rest, no friction.", data.verdict,
             machine);
  if (!result.summary.parameters.empty()) {
    report::write_table(
        out, "Table 1: Parameter estimation of static conditions",
        std::to_string(result.poses) + " poses at rest, " + std::to_string(result.near_stops) +
            " near end stops left out. At rest, friction takes any value up to its break-away force: the "
            "standard deviation comes from this scatter. It assumes independent poses; a pressure offset, the "
            "same in all of them, does not show in it.",
        parameter_rows(Paper::kStatic, result.summary, data));
    report::write_figures(out,
                          {pose_figure("Torques of all poses", "Each dot is one pose; the line is a perfect model.",
                                       pose_torques(machine, result, data))});
  }
}

void write_malaguti(const MachineDescription& machine, const BaselineData& data, std::ostream& out) {
  const estimation::MalagutiResult result = identify_malaguti(machine, data.identification);
  write_head(out, "Dynamic estimation", "Malaguti and Zaghi, section 3.2: stick and bucket, filtered regressor.",
             data.verdict, machine);
  if (!result.summary.parameters.empty()) {
    const estimation::MalagutiResult repaired =
        identify_malaguti(machine, data.identification, estimation::repaired_malaguti_options());
    const Recording& recording = shown_recording(data);
    const TorqueComparison torque = compare_torque(result, machine, recording);
    report::write_table(out, "Table 2: Parameter estimation in dynamic conditions",
                        "Sampled at 100 Hz, 20 Hz filter, seven-sample quadratic for speeds, least squares.",
                        parameter_rows(Paper::kMalaguti, result.summary, data));
    report::write_table(
        out, "Table 3: Errors of the torques",
        which_recording(data) +
            " RMS error, and that over the standard deviation of the measured torque; repaired: 2 Hz filter "
            "and 41-sample cubic. Both after the method's own filter.",
        error_rows(torque_fit(torque, 0), torque_fit(compare_torque(repaired, machine, recording), 0)));
    report::write_figures(out, {torque_figure("Figure 3: torques of bucket",
                                              "Measured (full line) and estimated (dashed).", torque, {kBucket}),
                                torque_figure("Figure 4: torques of stick",
                                              "Measured (full line) and estimated (dashed).", torque, {kArm})});
    report::write_table(out, "Table 2 again, repaired", "2 Hz filter, 41-sample cubic, all else as above.",
                        parameter_rows(Paper::kMalaguti, repaired.summary, data));
    write_bias(out, data.bias);
  }
}

void write_kim(const MachineDescription& machine, const BaselineData& data, std::ostream& out) {
  const estimation::KimResult result = identify_kim(machine, data.identification);
  write_head(out, "Slow motion", "Kim et al.: gravity and joint friction by nonlinear least squares.", data.verdict,
             machine);
  if (!result.summary.parameters.empty()) {
    const Recording& slow = data.identification.front();
    write_kim_results(out, machine, result, data);
    std::vector<report::PageFigure> figures{
        pressure_figure("Figure 4: Pressure of bucket cylinder when the bucket moves", machine, slow, kBucket),
        pressure_figure("Figure 5: Pressure of arm cylinder when the arm moves", machine, slow, kArm),
        pressure_figure("Figure 6: Pressure of boom cylinder when the boom moves", machine, slow, kBoom)};
    for (std::size_t i = 0; i < data.verification.size(); ++i)
      figures.push_back(torque_figure("Figure 7 " + letter(i) + ": Verification test " + std::to_string(i + 1),
                                      "Estimated and measured torque of each joint.",
                                      compare_torque(result, machine, data.verification[i]), {kBoom, kArm, kBucket}));
    const Recording& empty = data.verification.empty() ? slow : data.verification.back();
    figures.push_back(wrench_figure("Figure 8: Estimation result of no payload",
                                    "Horizontal and vertical force and torque at the tip of an empty bucket, by matrix "
                                    "inversion; " +
                                        which_recording(data),
                                    empty.step_s, external_wrench(result, machine, empty)));
    report::write_figures(out, figures);
  }
}

}  // namespace

std::vector<PrintedParameter> printed_parameters(Paper paper) {
  switch (paper) {
    case Paper::kStatic:
      return {{"S1, bucket X", "6.17 ± 2.95"},
              {"S2, bucket Z", "12.05 ± 4.45"},
              {"S3, stick X", "103.31 ± 23.67"},
              {"S4, stick Z", "22.78 ± 7.08"},
              {"S5, boom X", "-"},
              {"S6, boom Z", "-"}};
    case Paper::kMalaguti:
      return {{"φ<sub>D1</sub>, bucket J", "100.32 ± 25.7"},
              {"φ<sub>D2</sub>, stick J", "186.73 ± 33.4"},
              {"φ<sub>S1</sub>, bucket X", "3.50 ± 1.54"},
              {"φ<sub>S2</sub>, bucket Z", "13.71 ± 3.28"},
              {"φ<sub>S3</sub>, stick X", "71.81 ± 10.07"},
              {"φ<sub>S4</sub>, stick Z", "35.56 ± 5.68"},
              {"φ<sub>f1</sub>, bucket f<sub>c</sub>", "52.23 ± 25.5"},
              {"φ<sub>f2</sub>, bucket f<sub>v</sub>", "31444.87 ± 1257"},
              {"φ<sub>f3</sub>, stick f<sub>c</sub>", "35.67 ± 20.6"},
              {"φ<sub>f4</sub>, stick f<sub>v</sub>", "30167 ± 1320"}};
    case Paper::kKim:
      return {{"m<sub>1</sub> L<sub>O1G1</sub>, boom", "98.65"},
              {"A<sub>mc1</sub>, boom", "11.48"},
              {"μ<sub>1</sub>, boom", "37.19"},
              {"m<sub>2</sub> L<sub>O2G2</sub>, arm", "28.30"},
              {"A<sub>mc2</sub>, arm", "-2.67"},
              {"μ<sub>2</sub>, arm", "15.60"},
              {"m<sub>3</sub> L<sub>O3G3</sub>, bucket", "26.01"},
              {"A<sub>mc3</sub>, bucket", "31.82"},
              {"μ<sub>3</sub>, bucket", "3.57"}};
  }
  return {};
}

void write_baseline_report(Paper paper, const MachineDescription& machine, const BaselineData& data,
                           std::ostream& out) {
  switch (paper) {
    case Paper::kStatic:
      write_static(machine, data, out);
      break;
    case Paper::kMalaguti:
      write_malaguti(machine, data, out);
      break;
    case Paper::kKim:
      write_kim(machine, data, out);
      break;
  }
  report::write_page_end(out);
}

}  // namespace knuckle::identify
