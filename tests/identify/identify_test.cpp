// `knuckle identify` from outside: one command commissions the simulated machine, the same answer comes from the files
// it leaves, and recordings that cannot tell are refused with the reason.
#include "app/identify/identify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "app/identify/data_check.h"
#include "app/identify/identify_output.h"
#include "estimation/identification/motion.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "tests/identify/identify_program.h"
#include "tests/identify/recorded_motion.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::identify {
namespace {
namespace fs = std::filesystem;
using estimation::Recording;
using test::ProgramRun;

class IdentifyProgram : public test::IdentifyFolder {
 protected:
  void write(const std::string& name, const Recording& recording, const std::string& more = "") const {
    std::ofstream file(path(name));
    recordings::write_recording(recording, file);
    file << more;
  }
  /// What the program says to a recording, and that it writes no calibration; its exit code is asked for.
  [[nodiscard]] std::string said(const Recording& recording, int exit_code) const {
    write("a.csv", recording);
    const ProgramRun run = identify({path("a.csv"), "--out", path("out.toml")});
    EXPECT_EQ(run.exit_code, exit_code) << run.out << run.err;
    EXPECT_FALSE(fs::exists(path("out.toml")));
    return run.out + run.err;
  }
};

bool names(const std::string& text, const std::string& word) {
  return text.find(word) != std::string::npos;
}

TEST_F(IdentifyProgram, CommissionsTheSimulatedMachineAndSaysTheSameFromTheFilesItLeaves) {
  const std::vector<std::string> outputs{"--out", path("cal.toml"), "--json", path("driven.json")};
  std::vector<std::string> arguments{"--simulate", "--seed", "5",        "--slow",   "40",
                                     "--fast",     "20",     "--record", path("rec")};
  arguments.insert(arguments.end(), outputs.begin(), outputs.end());
  const ProgramRun driven = identify(arguments);
  ASSERT_EQ(driven.exit_code, 0) << driven.out << driven.err;
  const ProgramRun read =
      identify({path("rec/slow.csv"), path("rec/fast.csv"), "--hold-out", path("rec/hold_out_slow.csv"), "--hold-out",
                path("rec/hold_out_digging.csv"), "--survey", path("rec/survey.csv"), "--json", path("read.json")});
  ASSERT_EQ(read.exit_code, 0) << read.out << read.err;
  const nlohmann::json a = json("driven.json"), b = json("read.json");
  EXPECT_EQ(a["parameters"], b["parameters"]);
  EXPECT_EQ(a["data"]["sha256"], b["data"]["sha256"]);
  EXPECT_EQ(a["parameters"].size(), 27u);

  const MachineDescription machine = load_machine(path("cal.toml"));
  ASSERT_TRUE(machine.dynamics_calibration && machine.geometry_calibration && machine.calibration_provenance);
  EXPECT_EQ(machine.calibration_provenance->data_sha256, a["data"]["sha256"]);
  EXPECT_DOUBLE_EQ(machine.dynamics_calibration->parameters[0], a["parameters"][0]["value"].get<double>());
  for (const auto& held : a["hold_out"]) {
    if (held["method"] != "full") continue;
    for (const char* joint : {"boom", "arm", "bucket"})
      EXPECT_LT(held["to_2Hz"]["nrmse"][joint], 0.1) << held["source"] << " " << joint;
  }
  EXPECT_EQ(a["valves"], b["valves"]);
  for (const std::optional<ValveCalibration>& valve : machine.valve_calibration) {
    ASSERT_TRUE(valve);
    EXPECT_NEAR(valve->dead_band_extend, 0.11, 0.04);
  }
  const ProgramRun session =
      test::run_program(test::program("knuckle"),
                        {"simulate", "--scenario", "free_motion", "--duration", "3", "--machine", path("cal.toml")});
  EXPECT_EQ(session.err, "");
}

TEST_F(IdentifyProgram, SaysWhetherAnEnsembleMeasuredWhatItsSigmasContainBesideTheResiduals) {
  write("a.csv", recorded_motion());
  const ProgramRun usual = identify({path("a.csv"), "--json", path("usual.json")});
  const ProgramRun held =
      identify({path("a.csv"), "--ensemble", "2", "--slow", "20", "--fast", "20", "--json", path("held.json")});
  EXPECT_TRUE(names(usual.out, "contain usual errors of sensors, lengths and the friction law"))
      << usual.out << usual.err;
  EXPECT_TRUE(names(held.out, "with the model's own error")) << held.out << held.err;
  const nlohmann::json a = json("usual.json"), b = json("held.json");
  EXPECT_FALSE(a["model_error"]);
  EXPECT_TRUE(b["model_error"]);
  ASSERT_EQ(a["parameters"].size(), 27U);
  for (std::size_t i = 0; i < a["parameters"].size(); ++i) {
    const auto &one = a["parameters"][i], &other = b["parameters"][i];
    EXPECT_EQ(one["value"], other["value"]);
    EXPECT_EQ(one["sigma"].is_null(), other["sigma"].is_null()) << "what does not show in the data";
    EXPECT_TRUE(one["sigma"].is_null() || one["sigma"] != other["sigma"]) << i;
  }
}

/// Kim's model has no inertia: its fast verification is what it cannot explain.
TEST_F(IdentifyProgram, GivesTheSameVerdictInItsWordsItsJsonAndThePapersPage) {
  const ProgramRun run =
      identify({"--simulate", "--method", "kim", "--json", path("a.json"), "--report", path("a.html")});
  EXPECT_EQ(run.exit_code, 1) << run.out << run.err;
  const nlohmann::json result = json("a.json");
  EXPECT_FALSE(result["usable"]);
  ASSERT_FALSE(result["reasons"].empty());
  const std::string page = test::content(path("a.html"));
  EXPECT_TRUE(names(page, ">not usable<"));
  for (const auto& reason : result["reasons"]) {
    EXPECT_TRUE(names(run.out, reason.get<std::string>())) << run.out;
    EXPECT_TRUE(names(page, "% of the")) << reason;
  }
  EXPECT_TRUE(names(run.out, "limit 25 %")) << run.out;
  for (const auto& held : result["hold_out"]) {
    EXPECT_GT(held["tip_force_rms_N"], 10);
    EXPECT_GT(held["tip_wrench_rms_N"], held["tip_force_rms_N"]);
  }
}

TEST(HeldOut, ObjectsToEachJointThatIsLeftUnexplainedAndToNothingElse) {
  constexpr PerJoint<bool> kAll{true, true, true}, kNone{};
  const double nan = std::nan("");
  const auto held = [](double boom, double arm, double bucket) {
    HoldOut one{"run", "kim", {}, {}};
    one.to_2Hz.nrmse = one.unfiltered.nrmse = {boom, arm, bucket};
    one.to_2Hz.rms_Nm = one.to_2Hz.nrmse;
    return one;
  };
  EXPECT_TRUE(objections(std::array{held(0.25, 0.1, 0.1)}, kAll).empty());
  EXPECT_EQ(objections(std::array{held(0.1, 0.1, 0.1), held(0.1, 0.26, 0.3)}, kAll).size(), 2U);
  EXPECT_TRUE(objections(std::array{held(nan, 0.1, 0.1)}, kNone).empty()) << "a joint that it does not model";
  EXPECT_EQ(objections(std::array{held(nan, 0.1, 0.1)}, kAll),
            std::vector<std::string>{"the boom cannot be validated: no held-out recording covers it"});
  EXPECT_EQ(objections(std::array{held(nan, nan, nan)}, kNone).size(), 1U);
  EXPECT_EQ(objections({}, kNone).size(), 1U);
  HoldOut constant = held(0.1, 0.1, nan);
  constant.to_2Hz.rms_Nm[kBucket] = 5;
  EXPECT_EQ(objections(std::array{constant}, kNone),
            std::vector<std::string>{"the bucket cannot be validated: its held-out torque never changes"});
}

TEST(Identify, IsUsableOnlyWhereHeldOutMotionSaysSo) {
  IdentifyData data;
  data.machine = test::solar();
  data.training = data.hold_out = {recorded_motion()};
  EXPECT_TRUE(identify(data, std::nullopt).summary.usable);
  Recording unknown = recorded_motion();
  std::fill(unknown.usable.begin(), unknown.usable.end(), std::uint8_t{0});
  for (const std::vector<Recording>& nothing :
       {std::vector<Recording>{}, {recordings::part_of(recorded_motion(), 0, 20)}, {unknown}}) {
    data.hold_out = nothing;
    const Identified result = identify(data, std::nullopt);
    EXPECT_FALSE(result.summary.usable);
    EXPECT_TRUE(names(result.summary.reasons.at(0), "no held-out recording")) << result.summary.reasons.at(0);
  }
}

/// Pressures that come so much later than lengths [s].
Recording skewed(double lag_s) {
  return estimation::without_pressure_lag(recorded_motion(), -lag_s);
}

TEST(Identify, TakesOffTheSkewOfPressuresAndLengthsAndSaysSo) {
  IdentifyData data;
  data.machine = test::solar();
  data.training = data.hold_out = {recorded_motion()};
  const Identified straight = identify(data, std::nullopt);
  for (const std::string& reason : straight.summary.reasons) EXPECT_FALSE(names(reason, "than lengths")) << reason;
  data.training = data.hold_out = {skewed(-0.1)};
  const Identified result = identify(data, std::nullopt);
  EXPECT_TRUE(result.summary.usable);
  EXPECT_TRUE(names(result.summary.reasons.back(), " ms earlier than lengths: corrected"))
      << result.summary.reasons.back();
  for (int j = 0; j < kJoints; ++j)
    EXPECT_LT(result.hold_out[0].judged().nrmse[j], 1.3 * straight.hold_out[0].judged().nrmse[j]) << j;
}

TEST(Identify, RefusesMoreSkewThanCanBeTakenOffAndRecordingsOfDifferentSkew) {
  IdentifyData data;
  data.machine = test::solar();
  data.hold_out = {recorded_motion()};
  for (const auto& [lag_s, told] :
       {std::pair{0.3, "250 ms or more later"}, std::pair{-0.3, "250 ms or more earlier"}}) {
    data.training = {skewed(lag_s)};
    const Identified result = identify(data, std::nullopt);
    EXPECT_FALSE(result.summary.usable);
    EXPECT_TRUE(names(result.summary.reasons.at(0), told)) << result.summary.reasons.at(0);
  }
  data.training = {recorded_motion(), skewed(0.15)};
  const Identified mixed = identify(data, std::nullopt);
  EXPECT_FALSE(mixed.summary.usable);
  EXPECT_TRUE(names(mixed.summary.reasons.at(0), "not sampled by one clock")) << mixed.summary.reasons.at(0);
}

TEST_F(IdentifyProgram, RefusesToValidateWithWhatItIdentifiesFrom) {
  write("a.csv", recorded_motion());
  write("copy.csv", recorded_motion(), "\n");  // other bytes, the same recording
  write("part.csv", recordings::part_of(recorded_motion(), 2000, 5000));
  for (const auto& [held, why] : {std::pair{"a.csv", ": is given twice"},
                                  {"copy.csv", ": 100 % of it is the same as in"},
                                  {"part.csv", ": 100 % of it is the same as in"}}) {
    const ProgramRun run = identify({path("a.csv"), "--hold-out", path(held)});
    EXPECT_EQ(run.exit_code, 2) << held << run.out;
    EXPECT_TRUE(names(run.err, std::string(held) + why)) << run.err;
  }
}

TEST_F(IdentifyProgram, SaysOfEveryValveWhyItStaysAsDrawn) {
  Recording recording = recorded_motion();
  for (JointVector& command : recording.valve) command[kArm] = std::nan("");
  write("a.csv", recording);
  const ProgramRun run = identify({path("a.csv")});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_TRUE(names(run.out, "boom valve: dead band")) << run.out;
  EXPECT_TRUE(names(run.out, "arm valve: the drawing's values are kept\n    arm: no stretch")) << run.out;
}

/// What is found in the data refuses them before anything is identified. Lengths that the linkage gives only beyond its
/// toggle have no angle.
TEST_F(IdentifyProgram, RefusesRecordingsThatCannotBeAndWritesNothing) {
  struct Spoilt {
    void (*sample)(estimation::Measurement&);
    const char* told;
  };
  for (const auto& [sample, told] : {Spoilt{[](auto& m) { m = recorded_motion().samples.front(); }, "repeated row"},
                                     Spoilt{[](auto& m) { m.pressure_Pa.fill(0); }, "boom_head_Pa is zero throughout"},
                                     Spoilt{[](auto& m) { m.cylinder_m[kBucket] += 0.2; }, "bucket_cylinder_m"}}) {
    Recording recording = recorded_motion();
    std::for_each(recording.samples.begin(), recording.samples.end(), sample);
    recording.valve.clear();
    const std::string text = said(recording, 2);
    EXPECT_TRUE(names(text, told)) << text;
  }
}

/// Boom and bucket move, the arm stays as straight as it gets.
TEST_F(IdentifyProgram, RefusesAnArmThatIsHeldStraight) {
  const JointVector middle(0.3, test::solar().links[kArm].max_rad - 0.08, -0.9);
  estimation::JointPath motion{0.02, {}};
  constexpr double kDuration_s = 32;
  for (double t = 0; t < kDuration_s; t += motion.step_s) {
    const double fade = std::min(1.0, std::min(t, kDuration_s - t) / 3);
    motion.joint_rad.push_back(middle + fade * JointVector(0.25 * std::sin(0.5 * t), 0, 0.6 * std::sin(0.4 * t)));
  }
  motion::MachineRun run(test::solar(), sim::sample_truth(test::solar(), 2), {}, middle, 2);
  const std::string text = said(run.follow(motion).recording, 1);
  EXPECT_TRUE(names(text, "usable: no - ") && names(text, "arm")) << text;
}

TEST_F(IdentifyProgram, NamesWhatIsWrongWithTheCommandOrItsFiles) {
  std::ofstream(path("a.csv")) << "time_s,boom_head_Pa\n0,1\n1,2\n";
  std::ofstream(path("m.toml")) << "name = 'm'\n";
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
      {{}, "knuckle: identify: needs recordings"},
      {{"--hold-out", path("a.csv")}, "named before --hold-out"},
      {{path("a.csv"), path("a.csv")}, "a.csv: is given twice"},
      {{path("a.csv"), "--hold-out", path("a.csv")}, "validation needs data not used"},
      {{path("a.csv"), "--hold-out", "0.25", "--hold-out", "0.3"}, "--hold-out 0.25: a share is given once"},
      {{"--simulate", "--record", path("rec"), "--json", path("rec/slow.csv")}, "lies in the folder of --record"},
      {{path("a.csv"), "--hold-out", "nan"}, "--hold-out nan: no such file, nor is it a number from 0.05 to 0.6"},
      {{path("a.csv"), "--seed", "3"}, "--seed: only goes with --simulate or --ensemble"},
      {{path("a.csv"), "--slow", "50"}, "--slow: only goes with --simulate or --ensemble"},
      {{path("a.csv"), "--survey-sigma-mm", "3"}, "--survey-sigma-mm: only goes with --survey or --simulate"},
      {{"--simulate", "--method", "kim", "--fast", "50"}, "--fast: only goes with --method full"},
      {{"--simulate", "--hold-out", "0.3"}, "--hold-out 0.3: --simulate drives its own"},
      {{"--simulate", "--fast", "abc"}, "--fast abc: is not a number"},
      {{"--simulate", "--ensemble", "1.5"}, "--ensemble 1.5: must be a whole number from 2 to 10000"},
      {{"--simulate", "--seed", "1", "--seed", "2"}, "--seed: is given more than once (see knuckle identify --help)"},
      {{path("a.csv"), "--map"}, "--map: needs a value"},
      {{"--simulate=3"}, "--simulate: takes no value"},
      {{path("a.csv"), "--machine", path("m.toml"), "--json", path("m.toml")}, "already taken by --machine"},
      {{path("none.csv")}, "no such file"},
      {{path("a.csv")}, "no column 'boom_rod_Pa'"},
      {{path("a.csv"), "--method", "guess"}, "--method guess: must be full, static, malaguti or kim"},
      {{path("a.csv"), "--method", "kim", "--out", path("o.toml")}, "--out"},
      {{path("a.csv"), "--hold-out", "0.9"}, "--hold-out 0.9: must be from 0.05 to 0.6"},
      {{path("a.csv"), "--hold-out", path("none.csv")}, "no such file"},
      {{path("a.csv"), "--json", path("a.csv")}, "already taken by the recordings"},
      {{"--simulate", "--ensemble", "1"}, "--ensemble 1: must be a whole number from 2 to 10000 machines, or 0: none"},
      {{"--simulate", "--ensemble", "2", "--method", "kim"}, "only goes with --method full"},
      {{path("a.csv"), "--simulate"}, "makes its own recordings"},
      {{path("a.csv"), "--record", path("rec")}, "only goes with --simulate"},
      {{"--simulate", "--slow", "3"}, "--slow 3: must be from 20 to 1200"},
  };
  for (const auto& [arguments, named] : cases) {
    const ProgramRun run = identify(arguments);
    EXPECT_EQ(run.exit_code, 2) << named;
    EXPECT_TRUE(names(run.err, named)) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  }
}

TEST_F(IdentifyProgram, ByAPapersMethodThatDoesNotExplainHeldOutMotionIsNotUsableAndSaysWhy) {
  write("a.csv", recorded_motion());
  auto other = recorded_motion();
  for (std::size_t i = 0; i < other.samples.size(); ++i)
    for (const std::size_t head : {0U, 2U, 4U})
      other.samples[i].pressure_Pa[head] += 8e5 * (1 + std::sin(2.5 * other.step_s * static_cast<double>(i)));
  write("b.csv", other);
  for (const std::string method : {"static", "malaguti", "kim"}) {
    const ProgramRun run =
        identify({path("a.csv"), "--hold-out", path("b.csv"), "--method", method, "--json", path(method + ".json")});
    EXPECT_EQ(run.exit_code, 1) << method << run.out << run.err;
    const nlohmann::json result = json(method + ".json");
    EXPECT_EQ(result["method"], method);
    EXPECT_FALSE(result["usable"]);
    ASSERT_FALSE(result["reasons"].empty()) << method;
    for (const auto& reason : result["reasons"]) EXPECT_TRUE(names(run.out, reason.get<std::string>())) << run.out;
  }
}

TEST_F(IdentifyProgram, RefusesASurveyThatCannotBeUsedInsteadOfGoingOnWithoutIt) {
  estimation::Survey few;
  const Kinematics kinematics(test::solar());
  for (const std::size_t i : {0U, 3000U}) {
    const JointVector length_m = recorded_motion().samples[i].cylinder_m;
    JointVector joint_rad;
    for (int j = 0; j < kJoints; ++j) joint_rad[j] = kinematics.joint_at(j, length_m[j]).value();
    const PlanarVector none = PlanarVector::Constant(std::nan(""));
    few.poses.push_back({length_m, none, none, kinematics.tip(joint_rad)});
  }
  write("a.csv", recorded_motion());
  {
    std::ofstream survey(path("few.csv"));
    write_survey(few, survey);
  }
  const ProgramRun run = identify({path("a.csv"), "--survey", path("few.csv"), "--out", path("m.toml")});
  EXPECT_EQ(run.exit_code, 2) << run.out;
  EXPECT_TRUE(names(run.err, "few.csv: cannot be used: ")) << run.err;
  EXPECT_FALSE(fs::exists(path("m.toml")));
}

TEST_F(IdentifyProgram, RefusesOutputsThatCannotBeWrittenBeforeItDrives) {
  fs::create_directory(path("folder"));
  fs::create_directory(path("folder.toml"));
  std::ofstream(path("file")) << "mine";
  for (const std::string option : {"--out", "--report", "--json"}) {
    const std::string end = option == "--out" ? ".toml" : "";
    for (const std::string& target : {path("folder" + end), path("file/b/a" + end), path("file/a" + end)}) {
      const ProgramRun run = identify({"--simulate", "--slow", "1200", "--record", path("rec"), option, target});
      EXPECT_EQ(run.exit_code, 2) << run.out;
      EXPECT_TRUE(names(run.err, option + " " + target + ": cannot be written")) << run.err;
    }
  }
  for (const char* record : {"file", "file/rec"}) {
    const ProgramRun run = identify({"--simulate", "--slow", "1200", "--record", path(record)});
    EXPECT_EQ(run.exit_code, 2) << run.out;
    EXPECT_TRUE(names(run.err, "--record " + path(record)) && names(run.err, "cannot be written: Not a directory"))
        << run.err;
  }
  EXPECT_FALSE(fs::exists(path("rec")));
}

TEST_F(IdentifyProgram, RecordsOverNothingThatIsThere) {
  fs::create_directory(path("rec"));
  std::ofstream(path("rec/fast.csv")) << "mine";
  const ProgramRun run = identify({"--simulate", "--slow", "1200", "--record", path("rec")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(names(run.err, "--record " + path("rec") + ": has fast.csv already")) << run.err;
  EXPECT_EQ(test::content(path("rec/fast.csv")), "mine");
}

TEST(Identify, TellsCombinationsThatTheDataDoNotSeparateOneALine) {
  IdentifyData data;
  data.machine = test::solar();
  Identified result;
  result.method = "full";
  result.machine = data.machine;
  result.summary.indistinct = {"J1, X1 and Z1 only together: J1 + 2 X1; Z1 - 3 X1",
                               "boom F_b does not show in the data"};
  result.summary.reasons = result.summary.indistinct;
  const std::string text = identify_summary(data, result);
  EXPECT_TRUE(names(text, "usable: no - the data cannot separate J1, X1 and Z1\n")) << text;
  EXPECT_TRUE(names(text,
                    "\n  cannot be separated: J1, X1 and Z1; the data determine only\n    the sum J1 + 2 X1\n"
                    "    the sum Z1 - 3 X1\n  boom F_b does not show in the data\n"))
      << text;
  EXPECT_FALSE(names(text, "note:")) << text;
}

TEST_F(IdentifyProgram, InterruptedLeavesNothingBehind) {
  const ProgramRun run = test::run_program(
      test::program("knuckle"), {"identify", "--simulate", "--out", path("cal.toml"), "--json", path("a.json")},
      std::chrono::milliseconds(300));
  EXPECT_EQ(run.exit_code, 130) << run.err;
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

/// Spikes, drop-outs and values out of range of single samples, scattered by the seed.
void spoil_samples(Recording& recording, std::mt19937& random) {
  const auto sample = [&]() -> auto& {
    return recording.samples[std::uniform_int_distribution<std::size_t>(10, recording.samples.size() - 10)(random)];
  };
  const auto channel = [&](std::size_t first, std::size_t last) {
    return std::uniform_int_distribution<std::size_t>(first, last)(random);
  };
  for (int n = 0; n < 12; ++n) {
    recordings::signal(sample(), channel(0, 5)) += 80e5;
    recordings::signal(sample(), channel(6, 8)) = 0;
    recordings::signal(sample(), channel(6, 8)) += n % 2 == 0 ? 0.05 : -0.05;
    recordings::signal(sample(), 9) = 2;
  }
}

/// A drop-out of 0.3 s and a pressure stuck for 2 s.
void spoil_stretches(Recording& recording, std::mt19937& random) {
  const auto place = [&](std::size_t length) {
    return std::uniform_int_distribution<std::size_t>(10, recording.samples.size() - length - 10)(random);
  };
  const std::size_t hole = place(60), stuck = place(400);
  const std::size_t length = 6 + random() % 3, pressure = random() % 6;
  for (std::size_t i = hole; i < hole + 60; ++i) recordings::signal(recording.samples[i], length) = 0;
  for (std::size_t i = stuck; i < stuck + 400; ++i)
    recordings::signal(recording.samples[i], pressure) = recordings::signal(recording.samples[stuck], pressure);
}

/// With the sigmas that residuals show.
estimation::FullResult identified(const Recording& recording) {
  estimation::FullOptions options;
  options.usual_errors = false;
  return estimation::identify_full(test::solar(), std::array{recording}, options);
}

/// Largest move of a parameter, in its sigma.
double largest_move(const estimation::FullResult& from, const Recording& recording) {
  const estimation::FullResult to = identified(recording);
  double largest = 0;
  for (std::size_t i = 0; i < from.summary.parameters.size(); ++i) {
    const auto &a = from.summary.parameters[i], &b = to.summary.parameters.at(i);
    largest = std::max(largest, std::abs(a.value - b.value) / a.sigma);
  }
  return largest;
}

TEST(DirtyData, MovesNoParameterByMuchOfItsSigmaOnceItIsTakenOut) {
  const estimation::FullResult reference = identified(recorded_motion());
  ASSERT_EQ(reference.summary.parameters.size(), 27u);
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::mt19937 random(seed);
    recordings::RecordedFile samples = as_file(recorded_motion());
    spoil_samples(samples.recording, random);
    recordings::RecordedFile stretches = samples;
    spoil_stretches(stretches.recording, random);
    EXPECT_GT(largest_move(reference, samples.recording), 3) << "or the defects would not have mattered";
    EXPECT_GE(require_data(test::solar(), samples).findings.size(), 40u);
    EXPECT_LT(largest_move(reference, samples.recording), 0.5) << "seed " << seed;
    // Without a stretch there is less data, and a 40 s recording's sigma does not hold what the model leaves out: so
    // against the clean recording with the same stretches left out.
    EXPECT_GE(require_data(test::solar(), stretches).findings.size(), 42u);
    Recording masked = recorded_motion();
    masked.usable = stretches.recording.usable;
    EXPECT_LT(largest_move(identified(masked), stretches.recording), 0.5) << seed;
  }
}

}  // namespace
}  // namespace knuckle::identify
