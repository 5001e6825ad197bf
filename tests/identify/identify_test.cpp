// `knuckle identify`: one command commissions the simulated machine, the same answer comes from the files it leaves,
// and recordings that cannot tell are refused with the reason.
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
#include "tests/support/says.h"

namespace knuckle::identify {
namespace {
namespace fs = std::filesystem;
using estimation::Recording;
using test::ProgramRun;
using test::says;

class IdentifyProgram : public test::IdentifyFolder {
 protected:
  void write(const std::string& name, const Recording& recording, const std::string& more = "") const {
    std::ofstream file(path(name));
    recordings::write_recording(recording, file);
    file << more;
  }
};

IdentifyData data_of(const Recording& training, const std::vector<Recording>& hold_out) {
  IdentifyData data;
  data.machine = test::solar();
  data.training = {training};
  data.hold_out = hold_out;
  return data;
}

/// From the shared recording, validated on itself.
const Identified& straight() {
  static const Identified result = identify(data_of(recorded_motion(), {recorded_motion()}), std::nullopt);
  return result;
}

TEST_F(IdentifyProgram, CommissionsTheSimulatedMachineAndSaysTheSameFromTheFilesItLeaves) {
  const ProgramRun driven = test::run_program(
      test::program("knuckle"), {"identify", "--simulate", "--seed", "5", "--slow", "40", "--fast", "20", "--record",
                                 path("rec"), "--out", path("cal.toml"), "--json", path("driven.json")});
  ASSERT_EQ(driven.exit_code, 0) << driven.out << driven.err;
  const ProgramRun read =
      identify({path("rec/slow.csv"), path("rec/fast.csv"), "--hold-out", path("rec/hold_out_slow.csv"), "--hold-out",
                path("rec/hold_out_digging.csv"), "--survey", path("rec/survey.csv"), "--json", path("read.json")});
  ASSERT_EQ(read.exit_code, 0) << read.out << read.err;
  const nlohmann::json a = json("driven.json"), b = json("read.json");
  EXPECT_EQ(a["parameters"], b["parameters"]);
  EXPECT_EQ(a["data"]["sha256"], b["data"]["sha256"]);
  EXPECT_EQ(a["valves"], b["valves"]);
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
  for (const std::optional<ValveCalibration>& valve : machine.valve_calibration) {
    ASSERT_TRUE(valve);
    EXPECT_NEAR(valve->dead_band_extend, 0.11, 0.04);
  }
}

TEST_F(IdentifyProgram, SaysWhetherAnEnsembleMeasuredWhatItsSigmasContainBesideTheResiduals) {
  EXPECT_TRUE(says(identify_summary(data_of(recorded_motion(), {}), straight()),
                   "contain usual errors of sensors, lengths and the friction law"));
  write("a.csv", recorded_motion());
  const ProgramRun held =
      identify({path("a.csv"), "--ensemble", "2", "--slow", "20", "--fast", "20", "--json", path("held.json")});
  EXPECT_TRUE(says(held.out, "with the model's own error")) << held.err;
  EXPECT_TRUE(json("held.json")["model_error"]);
}

/// By papers' methods, which are not shown how oil pushes beside the weight.
TEST_F(IdentifyProgram, GivesTheSameVerdictInItsWordsItsJsonAndThePapersPage) {
  write("a.csv", recorded_motion());
  Recording other = recorded_motion();
  for (std::size_t i = 0; i < other.samples.size(); ++i)
    for (const std::size_t head : {0U, 2U, 4U})
      other.samples[i].pressure_Pa[head] += 8e5 * (1 + std::sin(2.5 * other.step_s * static_cast<double>(i)));
  write("b.csv", other);
  for (const std::string method : {"static", "malaguti", "kim"}) {
    std::vector<std::string> arguments{path("a.csv"), "--hold-out", path("b.csv"), "--method",
                                       method,        "--json",     path("a.json")};
    if (method == "kim") arguments.insert(arguments.end(), {"--report", path("a.html")});
    const ProgramRun run = identify(arguments);
    EXPECT_EQ(run.exit_code, 1) << method << run.out << run.err;
    const nlohmann::json result = json("a.json");
    EXPECT_EQ(result["method"], method);
    EXPECT_FALSE(result["usable"]);
    ASSERT_FALSE(result["reasons"].empty()) << method;
    for (const auto& reason : result["reasons"]) EXPECT_TRUE(says(run.out, reason.get<std::string>()));
    if (method != "kim") continue;
    for (const auto& held : result["hold_out"]) {
      EXPECT_GT(held["tip_force_rms_N"], 10);
      EXPECT_GT(held["tip_wrench_rms_N"], 10);
    }
  }
  EXPECT_NE(test::content(path("a.html")).find(">not usable<"), std::string::npos);
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
  const auto two = objections(std::array{held(0.1, 0.1, 0.1), held(0.1, 0.26, 0.3)}, kAll);
  ASSERT_EQ(two.size(), 2U);
  EXPECT_TRUE(says(two[0], "limit 25 %"));
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
  EXPECT_TRUE(straight().summary.usable);
  const Identified result = identify(data_of(recorded_motion(), {}), std::nullopt);
  EXPECT_FALSE(result.summary.usable);
  EXPECT_TRUE(says(result.summary.reasons.at(0), "no held-out recording"));
}

/// Pressures that come so much later than lengths [s].
Recording skewed(double lag_s) {
  return estimation::without_pressure_lag(recorded_motion(), -lag_s);
}

TEST(Identify, TakesOffTheSkewOfPressuresAndLengthsAndSaysSo) {
  for (const std::string& reason : straight().summary.reasons) EXPECT_FALSE(says(reason, "than lengths"));
  const Identified result = identify(data_of(skewed(-0.1), {skewed(-0.1)}), std::nullopt);
  EXPECT_TRUE(result.summary.usable);
  EXPECT_TRUE(says(result.summary.reasons.back(), " ms earlier than lengths: corrected"));
  for (int j = 0; j < kJoints; ++j)
    EXPECT_LT(result.hold_out[0].judged().nrmse[j], 1.3 * straight().hold_out[0].judged().nrmse[j]) << j;
}

TEST(Identify, RefusesMoreSkewThanCanBeTakenOffAndRecordingsOfDifferentSkew) {
  for (const auto& [lag_s, told] :
       {std::pair{0.3, "250 ms or more later"}, std::pair{-0.3, "250 ms or more earlier"}}) {
    IdentifyData data = data_of(skewed(lag_s), {recorded_motion()});
    const TimeSkew skew = take_off_skew(calibrated(test::solar()), data);
    EXPECT_TRUE(skew.refuses);
    EXPECT_TRUE(says(skew.what, told));
  }
  IdentifyData data = data_of(recorded_motion(), {recorded_motion()});
  data.training.push_back(skewed(0.15));
  const Identified mixed = identify(data, std::nullopt);
  EXPECT_FALSE(mixed.summary.usable);
  EXPECT_TRUE(says(mixed.summary.reasons.at(0), "not sampled by one clock"));
}

TEST_F(IdentifyProgram, RefusesToValidateWithWhatItIdentifiesFrom) {
  write("a.csv", recorded_motion());
  write("copy.csv", recorded_motion(), "\n");  // other bytes, the same recording
  write("part.csv", recordings::part_of(recorded_motion(), 2000, 5000));
  for (const auto& [held, why] : {std::pair{"a.csv", ": is given twice"},
                                  {"copy.csv", ": 100 % of it is the same as in"},
                                  {"part.csv", ": 100 % of it is the same as in"}})
    EXPECT_TRUE(says(refusal({path("a.csv"), "--hold-out", path(held)}), std::string(held) + why));
}

TEST(Identify, SaysOfEveryValveWhyItStaysAsDrawn) {
  Recording recording = recorded_motion();
  for (JointVector& command : recording.valve) command[kArm] = std::nan("");
  Identified result = straight();
  MachineDescription drawing = test::solar();
  result.valves = learn_valves(drawing, std::array{recording});
  const std::string text = identify_summary(data_of(recording, {}), result);
  EXPECT_TRUE(says(text, "boom valve: dead band"));
  EXPECT_TRUE(says(text, "arm valve: the drawing's values are kept\n    arm: no stretch"));
}

/// What is found in the data refuses them before anything is identified. Lengths that the linkage gives only beyond its
/// toggle have no angle.
TEST_F(IdentifyProgram, RefusesRecordingsThatCannotBeAndWritesNothing) {
  struct Spoilt {
    void (*sample)(estimation::Measurement&);
    const char* told;
  };
  for (const auto& [sample, told] : {Spoilt{[](auto& m) { m = recorded_motion().samples.front(); }, "repeated row"},
                                     Spoilt{[](auto& m) { m.cylinder_m[kBucket] += 0.2; }, "bucket_cylinder_m"}}) {
    Recording recording = recorded_motion();
    std::for_each(recording.samples.begin(), recording.samples.end(), sample);
    recording.valve.clear();
    write("a.csv", recording);
    EXPECT_TRUE(says(refusal({path("a.csv"), "--out", path("out.toml")}), told));
    EXPECT_FALSE(fs::exists(path("out.toml")));
  }
}

TEST_F(IdentifyProgram, NamesWhatIsWrongWithTheCommandOrItsFiles) {
  std::ofstream(path("a.csv")) << "time_s,boom_head_Pa\n0,1\n1,2\n";
  std::ofstream(path("m.toml")) << "name = 'm'\n";
  fs::create_directory(path("kept"));
  std::ofstream(path("kept/fast.csv")) << "mine";
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases{
      {{}, "identify: needs recordings"},
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
      {{"--simulate", "--seed", "1", "--seed", "2"}, "--seed: is given more than once"},
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
      {{"--simulate", "--out", path("m.toml/a.toml")}, "--out " + path("m.toml/a.toml") + ": cannot be written"},
      {{"--simulate", "--report", path("kept")}, "--report " + path("kept") + ": cannot be written"},
      {{"--simulate", "--record", path("m.toml/rec")}, "cannot be written: Not a directory"},
      {{"--simulate", "--record", path("kept")}, "--record " + path("kept") + ": has fast.csv already"},
  };
  for (const auto& [arguments, named] : cases) {
    EXPECT_TRUE(says(refusal(arguments), named));
    EXPECT_FALSE(says(refusal(arguments), "\n"));
  }
  EXPECT_EQ(folder_.count(), 3) << "nothing is written";
  EXPECT_EQ(identify({}).exit_code, 2);
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
  EXPECT_TRUE(says(refusal({path("a.csv"), "--survey", path("few.csv"), "--out", path("m.toml")}),
                   "few.csv: cannot be used: "));
  EXPECT_FALSE(fs::exists(path("m.toml")));
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
  EXPECT_TRUE(says(text, "usable: no - the data cannot separate J1, X1 and Z1\n"));
  EXPECT_TRUE(says(text,
                   "\n  cannot be separated: J1, X1 and Z1; the data determine only\n    the sum J1 + 2 X1\n"
                   "    the sum Z1 - 3 X1\n  boom F_b does not show in the data\n"));
  EXPECT_FALSE(says(text, "note:"));
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
