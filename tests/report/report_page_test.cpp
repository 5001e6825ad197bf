// What a person reads on a report: words, dates, numbers, labels and keys.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/report/report.h"
#include "app/report/result_text.h"
#include "tests/session/synthetic_session.h"
#include "tests/support/patterns.h"
#include "tests/support/says.h"

namespace knuckle::report {
namespace {

using test::says;

std::string page(const session::SessionResult& session, const Origin& origin = {}) {
  std::ostringstream out;
  write_report(session::judge(session), origin, out);
  return out.str();
}

TEST(NumberText, NeverWritesAPowerOfTen) {
  for (int exponent = -12; exponent <= 12; ++exponent) {
    for (const double digits : {1.0, 1.234567, 9.999, -5.5})
      EXPECT_EQ(number_text(digits * std::pow(10, exponent)).find('e'), std::string::npos) << digits << "e" << exponent;
  }
  EXPECT_EQ(number_text(3510), "3510");
  EXPECT_EQ(number_text(1e3), "1000");
  EXPECT_EQ(number_text(0.03971), "0.0397");
  EXPECT_EQ(number_text(1.5), "1.5");
  EXPECT_EQ(number_text(150), "150");
  EXPECT_EQ(number_text(-0.25), "-0.25");
  EXPECT_EQ(number_text(0), "0");
  EXPECT_EQ(number_text(1.96e-07), "< 0.000001");
  EXPECT_EQ(number_text(-1.96e-07), "> -0.000001");
  EXPECT_EQ(number_text(std::nan("")), "-");
  EXPECT_EQ(number_text(52341.7, 4), "52342");
  EXPECT_EQ(shown(3510.0, "N"), "3510 N");
}

TEST(MetricText, AreThereForEveryMetricAndDifferent) {
  std::vector<std::string> all;
  for (const session::MetricEntry& entry : session::metric_table()) {
    const std::string text = metric_text(entry.name);
    EXPECT_NE(text, entry.name);
    EXPECT_EQ(std::count(all.begin(), all.end(), text), 0) << text;
    all.push_back(text);
  }
  EXPECT_EQ(metric_text("another"), "another");
}

const PageFigure& figure(const std::vector<PageFigure>& figures, const std::string& title) {
  for (const PageFigure& one : figures) {
    if (one.title == title) return one;
  }
  throw std::runtime_error("no figure " + title);
}

/// One missed bound of each kind, one met.
session::SessionResult missing_one_of_each() {
  session::SessionResult session = session::synthetic_session();
  using session::CriterionKind;
  session.record.events.push_back({27.0, "piece_down"});
  session.record.faults = {{{ReasonCode::kLinkLost, 0, 200, 150}, 20.0, 19.8, 19.95, 20.05}};
  session.criteria = {{"faults", {}, 0, CriterionKind::kSafety},
                      {"spool_neutral_ms", {}, 320, CriterionKind::kSafety},
                      {"max_slew_N_per_ms", {}, 1e-9, CriterionKind::kRequirement},
                      {"felt_error_rel", {}, 1e-9, CriterionKind::kGoal},
                      {"engaged_s", 1, {}, CriterionKind::kGoal}};
  return session;
}

/// These parts follow each other.
void expect_in_order(const std::string& text, const std::vector<std::string>& parts) {
  std::size_t at = 0;
  for (const std::string& part : parts) {
    const std::size_t found = text.find(part, at);
    ASSERT_NE(found, std::string::npos) << part << " in\n" << text;
    at = found;
  }
}

TEST(Summary, SaysWhatWasDoneThenWhatFailedThenWhichGoalsAreNotReachedAndWhen) {
  const session::SessionResult session = missing_one_of_each();
  const session::Judged judged = session::judge(session);
  const std::string text = summary_text(judged, "");
  expect_in_order(text, {"piece broken off, 52 kg lifted and weighed within",
                         "; 1 fault, valves closed within 250 ms, no motion resumed",
                         "FAILED:\n    latched faults: 1, at most 0; at 20.0 s, release [faults]\n",
                         "[max_slew_N_per_ms]", "1 of 2 goals not reached:\n", ", goal < 0.000001; at ",
                         "NOT passed: 1 of 2 safety bounds, 0 of 1 requirement met\n"});
  EXPECT_FALSE(says(text, "engaged_s")) << "what was met";
  EXPECT_TRUE(says(summary_text(judged, "", true), "engaged_s"));
}

TEST(Summary, JudgesNothingOfASessionCutShortAndSaysWhereRequirementsDoNotDecide) {
  session::SessionResult session = missing_one_of_each();
  session.criteria.erase(session.criteria.begin());
  session.requirements_decide = false;
  std::string text = summary_text(session::judge(session), "");
  EXPECT_FALSE(says(text, "FAILED"));
  EXPECT_TRUE(says(text, "requirements not met; they decide with the default machine, or with --judge:"));
  EXPECT_TRUE(says(text, "\npassed: 1 of 1 safety bound met\n"));
  session.requirements_decide = true;
  session.record.cut_short = true;
  text = summary_text(session::judge(session), "");
  EXPECT_TRUE(says(text, "\nended by --duration: not judged\n"));
  EXPECT_FALSE(says(text, "FAILED") || says(text, "not reached"));
  for (session::FaultRecord& fault : session.record.faults) fault.spool_neutral_s = 0;
  EXPECT_TRUE(says(summary_text(session::judge(session), ""), "1 fault, valves not closed,"));
}

TEST(Verdict, OfUnfeltForceSaysHowMuchOfItTheDeviceCannotShow) {
  session::SessionResult session = session::synthetic_session();
  session.criteria = {{"unfelt_s", {}, 0, session::CriterionKind::kGoal}};
  session::Judged judged = session::judge(session);
  judged.metrics.unfelt_s = 0.5;
  judged.metrics.unfelt_showable_s = 0.38;
  judged.criteria = session::evaluate(session.criteria, judged.metrics, session.record);
  const std::string excuse = "; the device cannot show 0.12 s of it";
  EXPECT_TRUE(says(summary_text(judged, ""), "0.5 s, goal 0 s" + excuse));
  std::ostringstream report;
  write_report(judged, {}, report);
  EXPECT_TRUE(says(report.str(), "0.5 s, goal 0 s" + excuse));
  EXPECT_TRUE(says(report.str(), "<br><span class=\"soft\">the device cannot show 0.12 s of it</span>"));
  judged.metrics.unfelt_s = 0.0;
  judged.criteria = session::evaluate(session.criteria, judged.metrics, session.record);
  EXPECT_FALSE(says(summary_text(judged, "", true), "cannot show"));
}

TEST(Report, HasItsCommandAndTheVerdictThenWhatFailedInWordsWithItsMomentInThePlots) {
  const std::string text =
      page(missing_one_of_each(), {"knuckle simulate --scenario 'my <wall>'", "2026-11-25T12:00:00Z"});
  EXPECT_TRUE(says(text, "knuckle simulate --scenario 'my &lt;wall&gt;'"));
  EXPECT_TRUE(says(text, "2026-11-25T12:00:00Z"));
  expect_in_order(text, {"NOT passed: 1 of 2 safety bounds, 0 of 1 requirement met", "piece broken off, 52 kg lifted",
                         "1 of 2 goals not reached: ", "✗ failed", "goal not reached", "2 met", "Key moments"});
  EXPECT_TRUE(says(text, "piece down"));
  EXPECT_FALSE(says(text, "piece_down") || says(text, "link_lost"));
  const auto link = test::matches(text, "<a href=\"#([a-z-]+)\">20.0 s, release</a>");
  ASSERT_FALSE(link.empty());
  EXPECT_TRUE(says(text, "<section id=\"" + link[0][1] + "\">"));
}

TEST(ReportPlots, ShowTheMomentsThatThePageNames) {
  for (const PageFigure& one : report_plots(session::synthetic_session(), {{12.5, "3"}})) {
    if (says(one.figure.script, "xlabel 'time, s'")) {
      EXPECT_TRUE(says(one.figure.script, "set label '3' at 12.5,")) << one.title;
    }
  }
}

TEST(Report, SaysCriteriaAndLatenciesInWordsAndNamesThem) {
  session::SessionResult session = session::synthetic_session();
  session.hops = {{"hand_to_valve", 12, {14000, 21000, 23500}}};
  const std::string text = page(session);
  for (const std::string& part : {std::string("error of the tip in free motion, RMS"), std::string("tip_rms_m"),
                                  hop_text("hand_to_valve"), std::string("14 ms"), std::string("23.5 ms")})
    EXPECT_TRUE(says(text, part));
  EXPECT_FALSE(test::has_match(text, R"(>[<≤≥ ]*-?[0-9.]+e[+-]?[0-9]+ )")) << "a power of ten";
}

TEST(ReportPlots, ShowValveCommandsAndFeltAgainstTrueForceOfContactAndLoad) {
  session::SessionResult session = session::synthetic_session();
  for (session::Sample& s : session.record.samples) {
    s.truth.tip_force_N.setZero();
    s.truth.weight_N = {0, -500};
  }
  session.record.force_scale = 1e-3;
  const auto figures = report_plots(session);
  const std::string valves = figure(figures, "Valve commands").figure.script;
  for (const char* joint : {"boom, %", "arm, %", "bucket, %"}) EXPECT_TRUE(says(valves, joint));
  EXPECT_EQ(test::matches(valves, "title 'command'").size(), 3u);
  EXPECT_TRUE(says(figure(figures, "Felt force").figure.script, "0 0.5\n")) << "the load's weight is felt, too";
  EXPECT_TRUE(says(figure(figures, "Felt against true force").figure.script, "ylabel 'felt force, N'"));
}

}  // namespace
}  // namespace knuckle::report
