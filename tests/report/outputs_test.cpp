// What a session leaves behind: criteria, JSON, CSV, digest, report, and files that are whole or absent.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/report/machine_drawing.h"
#include "app/report/report.h"
#include "app/report/result_text.h"
#include "machine/kinematics.h"
#include "tests/session/synthetic_session.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::report {
namespace {
std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

TEST(ResultJson, HasEveryKeyToolsRelyOnEvenWhenNothingHappened) {
  const auto json = nlohmann::json::parse(result_json(session::judge(session::SessionResult{})).dump());
  const std::vector<std::string> pointers = split(
      "/schema /version /scenario /machine /control /seed /digest /passed /safety /criteria /requirements /goals "
      "/requirements_decide /timing/simulated_s /timing/wall_s "
      "/timing/real_time_factor /tracking/tip_rms_m /force/no_load_rms_N /force/contact_error_rel "
      "/force/direction_error_deg /force/detection_ms /payload/truth_kg /payload/estimate_kg /payload/sigma_kg "
      "/felt/contact_losses /felt/rise_t90_s /felt/settle_s /felt/hold_peak_to_peak_N /felt/hold_error_N "
      "/felt/drag_rms_N /felt/max_slew_N_per_ms /felt/net_energy_J /faults /realtime /latency_us /energy /modes "
      "/events",
      ' ');
  for (const std::string& pointer : pointers)
    EXPECT_TRUE(json.contains(nlohmann::json::json_pointer(pointer))) << pointer;
  EXPECT_TRUE(json["tracking"]["tip_rms_m"].is_null());
  EXPECT_TRUE(json["realtime"].is_null());
}

TEST(ResultJson, SaysWhatHappenedAndListsEachKindApartWithTheMomentOfItsWorst) {
  session::SessionResult session = session::synthetic_session();
  using session::CriterionKind;
  session.record.faults = {{{ReasonCode::kNodeSilent, 0, 1, 1}, 29.2, 29.0, 29.15, 29.2, false, 28.9},
                           {{ReasonCode::kLinkLost, 0, 200, 150}, 30.2, 30.0, 30.15, 0}};
  session.loops = {{"slave", "SCHED_FIFO", {5, 20, 60}, {9, 15, 40}, 1}};
  session.criteria = {{"tip_rms_m", {}, 0.05},
                      {"faults", {}, 0, CriterionKind::kSafety},
                      {"peak_N", {}, 3000, CriterionKind::kRequirement},
                      {"felt_error_rel", {}, 0.001, CriterionKind::kGoal}};
  const auto judged = [&] { return nlohmann::json::parse(result_json(session::judge(session)).dump()); };
  auto json = judged();
  EXPECT_EQ(json["schema"], "knuckle-session/2");
  EXPECT_EQ(json["scenario"], "dismantle");
  EXPECT_EQ(json["passed"], false);
  ASSERT_EQ(json["criteria"].size(), 1u);
  EXPECT_EQ(json["criteria"][0]["name"], "tip_rms_m");
  EXPECT_EQ(json["criteria"][0]["bound"], 0.05);
  EXPECT_EQ(json["criteria"][0]["passed"], true);
  EXPECT_EQ(json["safety"][0]["at_s"], 30.2);
  EXPECT_EQ(json["safety"][0]["phase"], "weigh");
  EXPECT_EQ(json["safety"][0]["passed"], false);
  EXPECT_EQ(json["requirements"][0]["passed"], true);
  EXPECT_EQ(json["goals"][0]["reached"], false);
  EXPECT_FALSE(json["goals"][0].contains("passed"));
  EXPECT_NEAR(json["faults"][0]["since_injection_ms"].get<double>(), 300, 1e-6);
  EXPECT_EQ(json["faults"][1]["code"], "link_lost");
  EXPECT_NEAR(json["faults"][1]["command_neutral_ms"].get<double>(), 150, 1e-6);
  EXPECT_TRUE(json["faults"][1]["spool_neutral_ms"].is_null());
  EXPECT_TRUE(json["faults"][1]["since_injection_ms"].is_null());
  EXPECT_EQ(json["realtime"]["slave"]["wake_us"]["p99"], 20);
  EXPECT_EQ(json["latency_us"]["hand_to_valve"]["p50"], 14000);
  session.record.cut_short = true;
  session.criteria.erase(session.criteria.begin(), session.criteria.begin() + 2);
  json = judged();
  EXPECT_TRUE(json["passed"].is_null());
  EXPECT_TRUE(json["requirements"][0]["passed"].is_null());
  EXPECT_TRUE(json["goals"][0]["reached"].is_null());
}

TEST(ResultJson, IsDocumentedKeyByKey) {
  const std::string documentation = test::content(test::source_dir() + "/docs/scenarios.md");
  const auto json = nlohmann::json::parse(result_json(session::judge(session::synthetic_session())).dump());
  for (const auto& [key, value] : json.items()) {
    EXPECT_NE(documentation.find('`' + key), std::string::npos) << key;
    if (!value.is_object() || key == "latency_us" || key == "realtime") continue;
    for (const auto& [inner, unused] : value.items()) EXPECT_NE(documentation.find(inner), std::string::npos) << inner;
  }
  for (const session::MetricEntry& entry : session::metric_table())
    EXPECT_NE(documentation.find('`' + std::string(entry.name) + '`'), std::string::npos) << entry.name;
}

TEST(CsvTable, HasOneHeaderOneRowPerSampleAndTheSameColumnsInEach) {
  const session::SessionResult session = session::synthetic_session();
  std::ostringstream out;
  write_csv(session.record, out);
  const auto lines = split(out.str(), '\n');
  ASSERT_EQ(lines.size(), session.record.samples.size() + 1);
  const auto header = split(lines[0], ',');
  for (const std::string& line : lines) ASSERT_EQ(split(line, ',').size(), header.size()) << line;
  for (const std::string name :
       {"time_s", "phase", "boom_rad", "boom_head_Pa", "bucket_rod_Pa", "arm_valve", "tip_force_x_N", "truth_tip_z_m",
        "truth_tip_force_x_N", "truth_boom_rad", "hand_felt_z_N", "operator_round_trip_s"})
    EXPECT_EQ(std::count(header.begin(), header.end(), name), 1) << name;
}

TEST(CsvTable, ValuesSitUnderTheirHeadersInTheirUnitsAndWhatNobodyKnowsIsNan) {
  session::SessionRecord record = session::engaged_record(0.05);
  ASSERT_GE(record.samples.size(), 2U);
  slave::SlaveState& known = record.samples[0].machine;
  known.line_offset_m = 0.25;
  known.line_sigma_m = 0.1;
  known.pressure_Pa[3] = 123.4e5;
  record.samples[0].truth.tip_force_N = {7, -8};
  record.samples[0].truth.contact_m = {0.3, 0};
  record.samples[1].machine.unknown_torques = 1U << kBoom;
  std::ostringstream out;
  write_csv(record, out);
  const auto lines = split(out.str(), '\n');
  const auto header = split(lines[0], ',');
  const auto value = [&](std::size_t row, const std::string& name) {
    const auto column = std::find(header.begin(), header.end(), name) - header.begin();
    return split(lines[row], ',').at(static_cast<std::size_t>(column));
  };
  for (const std::string name : {"boom_head_Pa", "boom_rod_Pa", "line_offset_m", "line_sigma_m", "truth_contact_x_m"}) {
    EXPECT_NE(value(1, name), "nan") << name;
    EXPECT_EQ(value(2, name), "nan") << name;
  }
  EXPECT_NE(value(2, "arm_head_Pa"), "nan");
  EXPECT_EQ(value(1, "truth_contact_z_m"), "0");
  EXPECT_EQ(value(1, "arm_rod_Pa"), "12340000");
  EXPECT_EQ(value(1, "truth_tip_force_z_N"), "-8");
  EXPECT_EQ(value(1, "mode"), name(Mode::kEngaged));
}

TEST(ResultJson, SaysWhenHomeOnTwoWasOfferedRefusedAndChosen) {
  session::SessionResult session = session::synthetic_session();
  const auto told = [&] { return nlohmann::json::parse(result_json(session::judge(session)).dump())["home_on_two"]; };
  EXPECT_TRUE(told().is_null());
  auto& samples = session.record.samples;
  ASSERT_GE(samples.size(), 4U);
  const Reason offered{ReasonCode::kHomeOffered, kBoom, 0, 0}, pressed{ReasonCode::kHomePressed, kBoom, 0, 0};
  for (std::size_t i = 0; i < 3; ++i) samples[i].machine.home_offered = true;
  samples[0].machine.blocking = offered;
  samples[1].machine.blocking = samples[2].machine.blocking = pressed;
  samples[3].machine.home_on_two = true;
  EXPECT_EQ(told()["offered_at_s"], samples[0].t_s);
  EXPECT_EQ(told()["chosen_at_s"], samples[3].t_s);
  ASSERT_EQ(told()["refused"].size(), 1U);
  EXPECT_EQ(told()["refused"][0]["code"], "home_pressed");
  EXPECT_EQ(told()["refused"][0]["at_s"], samples[1].t_s);
}

TEST(Report, IsOneSelfContainedPage) {
  std::ostringstream out;
  write_report(session::judge(session::synthetic_session()), {}, out);
  const std::string page = out.str();
  if (const char* keep = std::getenv("KNUCKLE_KEEP_REPORT")) std::ofstream(keep) << page;
  for (const std::string fetched : {"http", "src=", "<script", "@import", "url(http"})
    EXPECT_EQ(page.find(fetched), std::string::npos)
        << fetched << ": " << page.substr(std::min(page.find(fetched), page.size() - 1), 80);
  for (const std::string part : {"What was asked for", "Key moments", "Path of the bucket tip", "Cylinder pressures",
                                 "95 % band", "Felt force", "piece broke", "</html>"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_LT(page.size(), 2'000'000u);
}

TEST(Report, MarksHostileNamesAsTextAndSurvivesASessionWithoutRows) {
  session::SessionResult session = session::synthetic_session();
  session.scenario = "<img>'&";
  session.record.events[0].what = "it's <b>";
  session.record.phases[1] = "don't";
  std::ostringstream out;
  write_report(session::judge(session), {}, out);
  EXPECT_EQ(out.str().find("<img>"), std::string::npos);
  std::ostringstream empty;
  write_report(session::judge(session::SessionResult{}), {}, empty);
  EXPECT_NE(empty.str().find("</html>"), std::string::npos);
}

TEST(Filmstrip, ShowsTheFirstEventOfEachKindInTimeOrderAndTheEnd) {
  session::SessionRecord record = session::synthetic_session().record;
  for (int i = 0; i < 20; ++i) record.events.insert(record.events.begin(), {8.1 + i * 0.4, "contact"});
  const auto moments = key_moments(record);
  EXPECT_EQ(moments.back().row, record.samples.size() - 1);
  ASSERT_LE(moments.size(), kMostMoments);
  EXPECT_TRUE(
      std::is_sorted(moments.begin(), moments.end(), [](const Moment& a, const Moment& b) { return a.row < b.row; }));
  const auto broke = std::find_if(moments.begin(), moments.end(),
                                  [](const Moment& m) { return m.label.find("piece broke") != std::string::npos; });
  EXPECT_NE(broke, moments.end());
}

/// The made-up session while it presses on the wall, as a machine knows it that learns of a force beside the tip.
session::SessionResult pressing_beside_the_tip(double line_offset_m) {
  session::SessionResult session = session::synthetic_session();
  for (session::Sample& s : session.record.samples) {
    s.machine.tip_force_N = s.truth.tip_force_N;
    s.machine.line_offset_m = line_offset_m;
    s.machine.line_sigma_m = 0.05;
    s.machine.tip_torque_Nm = -line_offset_m * s.truth.tip_force_N.norm();
    s.machine.tip_torque_sigma_Nm = 100;
    s.machine.touched_share = {0.1, 0.72, 0.1, 0, 0, 0};
    s.truth.contact_m = bucket_outline(session.machine)[1];
  }
  return session;
}

/// While the operator holds the press.
Frame frame_of_hold(const session::SessionResult& session) {
  for (const Frame& frame : filmstrip(session))
    if (std::abs(frame.t_s - 10) < 0.01) return frame;
  return {};
}

/// Where an arrow begins, frame M.
PlanarVector beginning(const std::string& svg, const std::string& arrow) {
  const std::string points = "<polyline class=\"" + arrow + "\" points=\"";
  const std::size_t at = svg.find(points);
  EXPECT_NE(at, std::string::npos) << arrow;
  std::istringstream in(svg.substr(at + points.size()));
  double x = 0, y = 0;
  char comma = 0;
  in >> x >> comma >> y;
  return {x, -y};
}

double distance_to_side(const PlanarVector& p, const PlanarVector& a, const PlanarVector& b) {
  const double share = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - share * (b - a)).norm();
}

constexpr double kDrawn_m = 2e-3;  // coordinates have four digits

TEST(Filmstrip, DrawsTheEstimatedForceFromWhereItsLineOfActionMeetsTheBucket) {
  const session::SessionResult tip = pressing_beside_the_tip(0);
  const session::Sample& sample = tip.record.samples[2000];
  const MachinePose pose = pose_of(tip.machine, sample.truth.joint_rad);
  const PlanarVector along = sample.truth.tip_force_N.normalized(), left(-along.y(), along.x());
  std::vector<PlanarVector> corners;
  double low_m = 0, high_m = 0;  // the tip is a corner
  for (const PlanarVector& corner : bucket_outline(tip.machine)) {
    corners.push_back(pose.bucket * corner);
    low_m = std::min(low_m, left.dot(corners.back() - pose.tip_m));
    high_m = std::max(high_m, left.dot(corners.back() - pose.tip_m));
  }
  ASSERT_GT(high_m - low_m, 0.1);
  for (const double share : {0.2, 0.5, 0.8}) {
    const double offset_m = low_m + share * (high_m - low_m);
    const PlanarVector from = beginning(frame_of_hold(pressing_beside_the_tip(offset_m)).svg, "estimate");
    EXPECT_NEAR(left.dot(from - pose.tip_m), offset_m, kDrawn_m);
    double nearest_m = 1;
    const PlanarVector ahead = from + 0.02 * along;
    bool inside = true;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const PlanarVector a = corners[i], side = corners[(i + 1) % corners.size()] - a;
      nearest_m = std::min(nearest_m, distance_to_side(from, a, a + side));
      inside = inside && side.x() * (ahead - a).y() > side.y() * (ahead - a).x();
    }
    EXPECT_LT(nearest_m, kDrawn_m) << share;
    EXPECT_TRUE(inside) << share << ": the world pushes, so the bucket is ahead of where it touches";
  }
  // A line that passes the bucket by.
  const PlanarVector from = beginning(frame_of_hold(pressing_beside_the_tip(high_m + 0.2)).svg, "estimate");
  EXPECT_LT((from - pose.tip_m - (high_m + 0.2) * left).norm(), kDrawn_m);
}

TEST(Filmstrip, DrawsTheTrueForceFromWhereItActs) {
  session::SessionResult session = pressing_beside_the_tip(0.1);
  const session::Sample& sample = session.record.samples[2000];
  const MachinePose pose = pose_of(session.machine, sample.truth.joint_rad);
  EXPECT_LT((beginning(frame_of_hold(session).svg, "truth") - pose.bucket * sample.truth.contact_m).norm(), kDrawn_m);
  for (session::Sample& s : session.record.samples) s.truth.contact_m.setZero();
  EXPECT_LT((beginning(frame_of_hold(session).svg, "truth") - pose.tip_m).norm(), kDrawn_m);
}

TEST(Filmstrip, SaysTheTorqueAboutTheTipAndTheSideThatIsMostLikelyTouchedWhereTheyAreKnown) {
  session::SessionResult session = pressing_beside_the_tip(0.1);
  EXPECT_EQ(frame_of_hold(session).force,
            "estimated torque about the tip -202 ± 196 N m; most likely touched: floor (72 %)");
  std::ostringstream out;
  write_report(session::judge(session), {}, out);
  EXPECT_NE(out.str().find("hold<br>estimated torque about the tip -202"), std::string::npos);
  for (const Frame& frame : filmstrip(session))
    EXPECT_EQ(frame.force.empty(), frame.svg.find("\"estimatehead\"") == std::string::npos) << frame.t_s;
  for (const Frame& frame : filmstrip(session::synthetic_session())) EXPECT_EQ(frame.force, "") << "nothing is known";
  EXPECT_NE(frame_of_hold(session).svg.find("class=\"line\""), std::string::npos);
  for (session::Sample& s : session.record.samples) s.machine.line_offset_m = s.machine.line_sigma_m = 0;
  const Frame frame = frame_of_hold(session);
  EXPECT_LT((beginning(frame.svg, "estimate") - session.record.samples[2000].truth.tip_m).norm(), kDrawn_m);
  EXPECT_EQ(frame.svg.find("class=\"line\""), std::string::npos);
  EXPECT_EQ(frame.force, "estimated torque about the tip -202 ± 196 N m; line of action not known");
}

}  // namespace
}  // namespace knuckle::report
