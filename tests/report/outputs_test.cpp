// What a session leaves behind: criteria, JSON, CSV, digest, report, and files that are whole or absent.
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/cli/interrupt.h"
#include "app/cli/output_file.h"
#include "app/programs/simulate_command.h"
#include "app/report/csv_table.h"
#include "app/report/filmstrip.h"
#include "app/report/report.h"
#include "app/report/result_json.h"
#include "app/report/summary.h"
#include "app/session/criteria.h"
#include "app/session/session_digest.h"
#include "core/error.h"
#include "tests/session/synthetic_session.h"

namespace knuckle::report {
namespace {
namespace fs = std::filesystem;

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("knuckle_outputs_" + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }
  [[nodiscard]] std::ptrdiff_t count() const {
    return std::distance(fs::directory_iterator(path_), fs::directory_iterator());
  }

 private:
  fs::path path_;
};

std::string content(const std::string& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) parts.push_back(part);
  return parts;
}

TEST(Criteria, EachBoundIsJudgedAtItsEdge) {
  session::Metrics metrics;
  metrics.tip_rms_m = 0.05;
  EXPECT_TRUE(session::all_passed(session::evaluate({{"tip_rms_m", 0.05, 0.05}}, metrics)));
  EXPECT_FALSE(session::all_passed(session::evaluate({{"tip_rms_m", {}, 0.0499}}, metrics)));
  EXPECT_FALSE(session::all_passed(session::evaluate({{"tip_rms_m", 0.0501, {}}}, metrics)));
}

TEST(Criteria, WhatWasNotMeasuredOrIsNotANumberFails) {
  session::Metrics metrics;
  EXPECT_FALSE(session::all_passed(session::evaluate({{"hold_error_N", {}, 1}}, metrics)));
  metrics.hold_error_N = std::nan("");
  EXPECT_FALSE(session::all_passed(session::evaluate({{"hold_error_N", {}, 1}}, metrics)));
}

TEST(Criteria, UnknownMetricsAndMissingBoundsAreRefused) {
  EXPECT_THROW(session::check_criteria({{"tip_rms", {}, 1}}, "x.toml"), InputError);
  EXPECT_THROW(session::check_criteria({{"tip_rms_m", {}, {}}}, "x.toml"), InputError);
}

TEST(ResultJson, HasEveryKeyToolsRelyOnEvenWhenNothingHappened) {
  const nlohmann::ordered_json json = result_json(session::judge(session::SessionResult{}));
  const std::vector<std::string> pointers = split(
      "/schema /version /scenario /machine /control /seed /digest /passed /criteria /timing/simulated_s /timing/wall_s "
      "/timing/real_time_factor /tracking/tip_rms_m /force/no_load_rms_N /force/contact_error_rel "
      "/force/direction_error_deg /force/detection_ms /payload/truth_kg /payload/estimate_kg /payload/sigma_kg "
      "/felt/contact_losses /felt/rise_t90_s /felt/settle_s /felt/hold_peak_to_peak_N /felt/hold_error_N "
      "/felt/drag_rms_N /felt/max_slew_N_per_ms /felt/net_energy_J /faults /realtime /latency_us /energy /modes "
      "/events",
      ' ');
  for (const std::string& pointer : pointers)
    EXPECT_TRUE(json.contains(nlohmann::ordered_json::json_pointer(pointer))) << pointer;
  EXPECT_TRUE(json["tracking"]["tip_rms_m"].is_null());
  EXPECT_TRUE(json["realtime"].is_null());
}

TEST(ResultJson, SaysWhatHappened) {
  session::SessionResult session = session::synthetic_session();
  session.record.faults = {{{ReasonCode::kLinkLost, 0, 200, 150}, 30.2, 30.0, 30.15, 0},
                           {{ReasonCode::kNodeSilent, 0, 1, 1}, 31.2, 31.0, 31.15, 31.2, false, 30.9}};
  session.loops = {{"slave", "SCHED_FIFO", {5, 20, 60}, {9, 15, 40}, 1}};
  const auto json = nlohmann::json::parse(result_json(session::judge(session)).dump());
  EXPECT_EQ(json["scenario"], "dismantle");
  EXPECT_EQ(json["passed"], false);  // the hold error is made too large for its bound
  ASSERT_EQ(json["criteria"].size(), 4u);
  EXPECT_EQ(json["criteria"][0]["name"], "tip_rms_m");
  EXPECT_EQ(json["criteria"][0]["bound"], 0.05);
  EXPECT_EQ(json["criteria"][0]["passed"], true);
  EXPECT_EQ(json["felt"]["contact_losses"], 0);
  EXPECT_EQ(json["faults"][0]["code"], "link_lost");
  EXPECT_NEAR(json["faults"][0]["command_neutral_ms"].get<double>(), 150, 1e-6);
  EXPECT_TRUE(json["faults"][0]["spool_neutral_ms"].is_null());
  EXPECT_TRUE(json["faults"][0]["since_injection_ms"].is_null());
  EXPECT_NEAR(json["faults"][1]["since_injection_ms"].get<double>(), 300, 1e-6);
  EXPECT_EQ(json["realtime"]["slave"]["wake_us"]["p99"], 20);
  EXPECT_EQ(json["latency_us"]["hand_to_valve"]["p50"], 14000);
  EXPECT_EQ(json["modes"][2]["mode"], name(Mode::kEngaged));
}

TEST(ResultJson, IsDocumentedKeyByKey) {
  const std::string documentation = content(std::string(KNUCKLE_SOURCE_DIR) + "/docs/results.md");
  const nlohmann::ordered_json json = result_json(session::judge(session::synthetic_session()));
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
  for (const std::string name : {"t_s", "boom_rad", "boom_A_bar", "bucket_B_bar", "valve_arm", "tip_force_x_N",
                                 "truth_tip_z_m", "truth_tip_force_x_N", "truth_boom_rad", "felt_z_N"})
    EXPECT_EQ(std::count(header.begin(), header.end(), name), 1) << name;
}

TEST(CsvTable, ValuesSitUnderTheirHeadersInTheirUnits) {
  session::SessionRecord record = session::engaged_record(0.005);
  record.samples[0].pressure_Pa[3] = 123.4e5;
  record.samples[0].truth_tip_force_N = {7, -8};
  std::ostringstream out;
  write_csv(record, out);
  const auto lines = split(out.str(), '\n');
  const auto header = split(lines[0], ','), row = split(lines[1], ',');
  const auto value = [&](const std::string& name) {
    return row.at(static_cast<std::size_t>(std::find(header.begin(), header.end(), name) - header.begin()));
  };
  EXPECT_EQ(value("arm_B_bar"), "123.4");
  EXPECT_EQ(value("truth_tip_force_z_N"), "-8");
  EXPECT_EQ(value("mode"), name(Mode::kEngaged));
}

TEST(cli::Digest, IsSha256OfValuesAndSeesEveryOne) {
  EXPECT_EQ(cli::Digest().finish(), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const auto digest_of = [](const session::Sample& s) {
    cli::Digest digest;
    session::add(digest, s);
    return digest.finish();
  };
  session::Sample a;
  const std::string base = digest_of(a);
  EXPECT_EQ(base, digest_of(session::Sample{}));
  a.felt_slew_N_per_ms = 1e-300;
  EXPECT_NE(base, digest_of(a));
  cli::Digest digest;
  session::add(digest, Time{1ns}, CanFrame{0x181, 2, {1, 2}});
  cli::Digest other;
  session::add(other, Time{1ns}, CanFrame{0x181, 2, {1, 3}});
  EXPECT_NE(digest.finish(), other.finish());
}

TEST(cli::OutputFile, LeavesTheOldFileUntilCommitted) {
  const Folder folder;
  const std::string target = folder.file("result.json");
  std::ofstream(target) << "old";
  {
    cli::OutputFile out("--json", target);
    out.stream() << "half";
  }
  EXPECT_EQ(content(target), "old");
  EXPECT_EQ(folder.count(), 1);
  cli::OutputFile out("--json", target);
  out.stream() << "new";
  EXPECT_EQ(content(target), "old");
  out.commit();
  EXPECT_EQ(content(target), "new");
  EXPECT_EQ(folder.count(), 1);
}

TEST(cli::OutputFile, RefusesWhatCannotBeWrittenBeforeAnythingIs) {
  const Folder folder;
  EXPECT_THROW(cli::OutputFile("--csv", folder.file("missing/x.csv")), InputError);
  EXPECT_THROW(cli::OutputFile("--csv", folder.file("")), InputError);
  EXPECT_EQ(folder.count(), 0);
}

TEST(cli::OutputFile, SaysWhyTheDiskRefusesHoweverMuchIsWritten) {
  for (const std::size_t size : {1UL, 100'000UL}) {
    cli::OutputFile out("--candump", "/dev/full");
    out.stream() << std::string(size, 'x');
    try {
      out.commit();
      ADD_FAILURE() << size;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()), "--candump /dev/full: cannot be written: No space left on device");
    }
  }
}

TEST(cli::OutputFile, WritesToDevicesInPlace) {
  cli::OutputFile out("--csv", "/dev/null");
  out.stream() << "x";
  out.commit();
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(SimulateCommand, WritesEveryOutputWhenTheSessionIsDone) {
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  options.json = folder.file("a.json");
  options.candump = folder.file("a.log");
  testing::internal::CaptureStdout();
  const int code =
      programs::simulate_command(options, [](const session::SimulateOptions&, const session::SessionHooks& hooks) {
        *hooks.candump << "(0.000000) can0 080#\n";
        return session::synthetic_session();
      });
  const std::string summary = testing::internal::GetCapturedStdout();
  EXPECT_EQ(code, 1);
  EXPECT_NE(summary.find("FAIL  hold_error_N"), std::string::npos) << summary;
  EXPECT_EQ(folder.count(), 3);
  EXPECT_EQ(content(options.candump), "(0.000000) can0 080#\n");
}

TEST(SimulateCommand, ASessionThatFailsLeavesNoOutput) {
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  const auto failing = [](const session::SimulateOptions&, const session::SessionHooks&) -> SessionResult {
    throw InputError("bad");
  };
  EXPECT_THROW(programs::simulate_command(options, failing), InputError);
  EXPECT_EQ(folder.count(), 0);
}

TEST(SimulateCommand, CtrlCEndsTheSessionAndLeavesNoOutput) {
  const Folder folder;
  session::SimulateOptions options;
  options.csv = folder.file("a.csv");
  const auto interrupted = [](const session::SimulateOptions&, const session::SessionHooks& hooks) {
    std::raise(SIGINT);
    hooks.progress(0.5);
    return session::synthetic_session();
  };
  EXPECT_THROW(programs::simulate_command(options, interrupted), cli::Interrupted);
  EXPECT_EQ(folder.count(), 0);
}

TEST(Report, IsOneSelfContainedPage) {
  std::ostringstream out;
  write_report(session::judge(session::synthetic_session()), out);
  const std::string page = out.str();
  if (const char* keep = std::getenv("KNUCKLE_KEEP_REPORT")) std::ofstream(keep) << page;
  for (const std::string fetched : {"http", "src=", "<script", "@import", "url(http"})
    EXPECT_EQ(page.find(fetched), std::string::npos)
        << fetched << ": " << page.substr(std::min(page.find(fetched), page.size() - 1), 80);
  for (const std::string part : {"Criteria", "Key moments", "Path of the bucket tip", "Cylinder pressures", "95 % band",
                                 "Felt force", "piece broke", "</html>"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_LT(page.size(), 2'000'000u);
}

TEST(Report, SurvivesASessionWithoutRows) {
  std::ostringstream out;
  session::SessionResult empty;
  write_report(session::judge(empty), out);
  EXPECT_NE(out.str().find("</html>"), std::string::npos);
}

TEST(Report, MarksHostileNamesAsText) {
  session::SessionResult session = session::synthetic_session();
  session.scenario = "<img>'&";
  session.record.events[0].what = "it's <b>";
  session.record.phases[1] = "don't";
  std::ostringstream out;
  write_report(session::judge(session), out);
  EXPECT_EQ(out.str().find("<img>"), std::string::npos);
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

}  // namespace
}  // namespace knuckle::report
