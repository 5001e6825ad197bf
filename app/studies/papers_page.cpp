// The page of `knuckle-studies papers`: its head, what came out in short, and what both papers' sections share.
#include "app/studies/papers_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "app/identify/scores.h"

namespace knuckle::studies {
namespace {

using identify::Identified;
using report::number_text;

constexpr const char* kMalagutiTitle = "M: Malaguti and Zaghi, a force sensor of driving cylinders";
constexpr const char* kKimTitle = "K: Kim et al., a haptic device for an excavator with pressure transmitters";

/// "kg m^2" as a paper prints it.
std::string printed_unit(std::string unit) {
  if (const std::size_t at = unit.find("^2"); at != std::string::npos) unit.replace(at, 2, "²");
  return unit;
}

std::string judged(const Identified& result) {
  if (result.summary.usable) return "<b>usable</b>";
  return "<b>not usable</b>" +
         (result.summary.reasons.empty() ? "" : " (" + report::escaped(result.summary.reasons.front()) + ")");
}

void write_title(std::ostream& out, const std::string& title) {
  out << "<h1 class=\"part\" id=\"" << report::anchor(title) << "\">" << title << "</h1>\n";
}

constexpr const char* kUsualCause =
    "The usual cause is a machine that does not go where it is led. Its controller knows the valves from the machine "
    "file, as these experiments identify none. The flow of a worn spool grows slowly at first (a curved edge, a "
    "metering "
    "notch), so the joints stay 10 to 35° behind their paths and a cylinder hardly moves, or one way only. Its "
    "friction "
    "can then not be told from the weight that it carries. The authors' operators led their machines by eye, and so "
    "moved further. Another seed is another machine.";

/// In place of a paper's tables and figures.
template <typename Experiments>
void write_why_not(std::ostream& out, const Repeated<Experiments>& part) {
  const std::string why = report::escaped(part.why_not) + ".";
  if (part.lacks.empty())
    write_experiment(out, {"<b>Not repeated: this machine could not be identified.</b> " + why, kUsualCause});
  else
    write_experiment(out, {"<b>Not repeated: this machine lacks what the experiment measures.</b> " + why});
}

template <typename Experiments, typename Write>
void write_part(const Repeated<Experiments>& part, const std::string& title, const Write& write, TableRows& summary,
                std::ostream& out) {
  write_title(out, title);
  if (!part.done) return write_why_not(out, part);
  const TableRows rows = write(*part.done, out);
  summary.insert(summary.end(), rows.begin(), rows.end());
}

void write_head(const RepeatedPapers& papers, const report::Origin& origin, std::ostream& out) {
  report::write_page_head(out, "Knuckle: two papers, repeated",
                          "h1.part{font-size:1.35rem;margin-top:40px}td,th{vertical-align:baseline}");
  out << "<h1>Two papers, repeated in simulation</h1>\n<p class=\"soft\"><code>" << report::escaped(origin.command_line)
      << "</code>, " << report::escaped(origin.date_utc) << "</p>\n<p>Each experiment of <a href=\"#"
      << report::anchor(kMalagutiTitle)
      << "\">M</a> (F. Malaguti, S. Zaghi, <i>Force sensor by driving hydraulic cylinders</i>) and <a href=\"#"
      << report::anchor(kKimTitle)
      << "\">K</a> (D. Kim et al., <i>Design of haptic device for excavator with pressure transmitter</i>) is driven "
         "on "
         "one simulated machine ("
      << report::escaped(papers.machine)
      << "), over its bus and through its valves. From the same recordings two methods identify: the authors', with "
         "their settings, and Knuckle's default one. Both use lengths and pins of a survey with 1 mm of error.</p>\n"
         "<p><b>Published</b> is what the paper's text says, of its own machine; the curves of its figures are printed "
         "without numbers, so the figures below show the simulated machine only. <b>Their method</b> and <b>default "
         "method</b> are both of the simulated machine. <b>Of the fit</b> is the recording that a method was fitted "
         "to, "
         "<b>held out</b> one that neither was fitted to. A dash: there is no such value; forces of the default method "
         "need a usable calibration.</p>\n<p>What each paper did, what Knuckle does instead and why, misprints, and "
         "ten "
         "machines in place of this one: docs/theory.md, \"The two papers' methods\".</p>\n";
}

}  // namespace

TableRows result_head() {
  return {{"", "unit", "published", "their method", "default method"}};
}

std::string percent(double share) {
  return tenths(100 * share);
}

std::string tenths(double value) {
  return std::isfinite(value) ? fmt::format("{:.1f}", value) : kNone;
}

std::string recorded_s(const std::vector<Recording>& recordings) {
  return number_text(identify::total_s(recordings), 2) + " s";
}

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

std::vector<PlanarVector> tip_forces(const std::vector<EstimateSample>& samples) {
  std::vector<PlanarVector> forces;
  for (const EstimateSample& sample : samples)
    forces.push_back(sample.valid ? sample.tip_N : PlanarVector::Constant(std::nan("")));
  return forces;
}

std::string with_sigma(double value, double sigma) {
  if (!(sigma > 0) || !std::isfinite(value)) return number_text(value, 4);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, 6);
  return fmt::format("{:.{}f} ± {:.{}f}", value, decimals, sigma, decimals);
}

std::string with_sigma(const Identified& ours, double value, const CalibrationVector& gradient) {
  return with_sigma(value, std::sqrt(gradient.dot(ours.summary.covariance * gradient)));
}

std::string parameter(const Identified& ours, int index) {
  const CalibrationVector unit = CalibrationVector::Unit(index);
  return with_sigma(ours, unit.dot(ours.machine.dynamics_calibration->parameters), unit);
}

std::string coulomb(const Identified& ours, int joint) {
  CalibrationVector mean = CalibrationVector::Zero();
  mean[friction_index(joint, kCoulombExtend)] = mean[friction_index(joint, kCoulombRetract)] = 0.5;
  return with_sigma(ours, mean.dot(ours.machine.dynamics_calibration->parameters), mean);
}

TableRows parameter_rows(identify::Paper paper, const std::vector<estimation::IdentifiedParameter>& theirs,
                         const std::vector<std::string>& ours, const std::map<std::string, double>& truth) {
  const std::vector<identify::PrintedParameter> printed = identify::printed_parameters(paper);
  TableRows rows = result_head();
  rows.front().front() = "parameter";
  rows.front().emplace_back("simulated machine");
  for (std::size_t i = 0; i < ours.size(); ++i) {
    const auto true_value = truth.find(theirs[i].name);
    rows.push_back({printed[i].symbol, printed_unit(theirs[i].unit), printed[i].value,
                    with_sigma(theirs[i].value, theirs[i].sigma), ours[i],
                    true_value == truth.end() ? kNone : number_text(true_value->second, 4)});
  }
  return rows;
}

void write_experiment(std::ostream& out, const std::vector<std::string>& paragraphs) {
  out << "<section>";
  for (const std::string& paragraph : paragraphs) out << "<p>" << paragraph << "</p>\n";
  out << "</section>\n";
}

std::string verdicts(const Experiment& experiment) {
  return "As <code>knuckle identify</code> judges by held-out torques, their method is " + judged(experiment.theirs) +
         ", the default method " + judged(experiment.ours) + "." +
         (experiment.ours.summary.usable ? "" : std::string(" ") + kUsualCause);
}

void write_papers_page(const RepeatedPapers& papers, const report::Origin& origin, std::ostream& out) {
  std::ostringstream parts;
  TableRows summary = result_head();
  write_part(papers.malaguti, kMalagutiTitle, write_malaguti, summary, parts);
  write_part(papers.kim, kKimTitle, write_kim, summary, parts);
  write_head(papers, origin, out);
  if (summary.size() > 1)
    report::write_table(out, "In short", "From the tables below, where each quantity is explained.", summary);
  out << parts.str();
  report::write_page_end(out);
}

}  // namespace knuckle::studies
