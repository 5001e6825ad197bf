// What a person reads on a report: words, dates, numbers, labels and keys.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/report/metric_words.h"
#include "app/report/number_text.h"
#include "app/report/report.h"
#include "app/report/report_plots.h"
#include "app/report/summary.h"
#include "tests/session/synthetic_session.h"

namespace knuckle::report {
namespace {

std::string page(const session::SessionResult& session, const Origin& origin = {}) {
  std::ostringstream out;
  write_report(session::judge(session), origin, out);
  return out.str();
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
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

TEST(MetricWords, AreThereForEveryMetricAndDifferent) {
  std::vector<std::string> all;
  for (const session::MetricEntry& entry : session::metric_table()) {
    const std::string words = metric_words(entry.name);
    EXPECT_NE(words, entry.name);
    EXPECT_EQ(std::count(all.begin(), all.end(), words), 0) << words;
    all.push_back(words);
  }
  EXPECT_EQ(metric_words("another"), "another");
}

TEST(Report, SaysByWhichCommandItWasMadeAndWhen) {
  const std::string text =
      page(session::synthetic_session(), {"knuckle simulate --scenario 'my <wall>'", "2026-11-25T12:00:00Z"});
  EXPECT_TRUE(has(text, "knuckle simulate --scenario 'my &lt;wall&gt;'"));
  EXPECT_TRUE(has(text, "2026-11-25T12:00:00Z"));
}

TEST(Report, IsTheSamePageForTheSameSessionAndOrigin) {
  const session::SessionResult session = session::synthetic_session();
  EXPECT_EQ(page(session, {"a", "b"}), page(session, {"a", "b"}));
}

TEST(Report, SaysCriteriaInWordsAndNamesThem) {
  const std::string text = page(session::synthetic_session());
  EXPECT_TRUE(has(text, "error of the tip in free motion, RMS"));
  EXPECT_TRUE(has(text, "tip_rms_m"));
  EXPECT_FALSE(std::regex_search(text, std::regex(R"(>[<≤≥ ]*-?[0-9.]+e[+-]?[0-9]+ )"))) << "a power of ten";
}

TEST(Report, ListsLatenciesInWords) {
  session::SessionResult session = session::synthetic_session();
  session.hops = {{"hand_to_valve", 12, {14000, 21000, 23500}}};
  const std::string text = page(session);
  for (const std::string& part :
       {std::string("Latencies"), hop_words("hand_to_valve"), std::string("14 ms"), std::string("23.5 ms")})
    EXPECT_TRUE(has(text, part)) << part;
}

const PageFigure& figure(const std::vector<PageFigure>& figures, const std::string& title) {
  for (const PageFigure& one : figures) {
    if (one.title == title) return one;
  }
  throw std::runtime_error("no figure " + title);
}

std::size_t times_in(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(ReportPlots, ShowValveCommandsAndFeltAgainstTrueForce) {
  const auto figures = report_plots(session::synthetic_session());
  const std::string valves = figure(figures, "Valve commands").figure.script;
  for (const char* joint : {"boom, %", "arm, %", "bucket, %"}) EXPECT_TRUE(has(valves, joint)) << joint;
  EXPECT_EQ(times_in(valves, "title 'command'"), 3u);
  const std::string felt = figure(figures, "Felt against true force").figure.script;
  EXPECT_TRUE(has(felt, "ylabel 'felt force, N'"));
  EXPECT_TRUE(has(felt, "xlabel 'true force, scaled to the hand, N'"));
}

TEST(ReportPlots, EachPanelHasItsOwnKeyAndALabelInsideThePicture) {
  for (const PageFigure& one : report_plots(session::synthetic_session())) {
    const std::string& script = one.figure.script;
    if (!has(script, "multiplot")) continue;
    EXPECT_TRUE(has(script, "set key at graph 1, graph")) << one.title << ": keys of panels lie on each other";
    EXPECT_FALSE(has(script, "set ylabel")) << one.title << ": leaves the picture where numbers are long";
    EXPECT_EQ(times_in(script, "set label 1 '"), times_in(script, "\nplot ")) << one.title;
  }
}

TEST(ReportPlots, ColourTheSidesOfACylinderAlikeInEveryPanel) {
  const auto figures = report_plots(session::synthetic_session());
  const std::string script = figure(figures, "Cylinder pressures").figure.script;
  const std::regex curve(R"(lc rgb '(#[0-9A-F]+)' [^']*title '([AB]), )");
  std::map<std::string, std::set<std::string>> colours;
  for (std::sregex_iterator it(script.begin(), script.end(), curve), end; it != end; ++it)
    colours[(*it)[2]].insert((*it)[1]);
  ASSERT_EQ(colours.size(), 2u);
  for (const auto& [side, used] : colours) EXPECT_EQ(used.size(), 1u) << side;
  EXPECT_NE(colours["A"], colours["B"]);
}

}  // namespace
}  // namespace knuckle::report
