// Valves and one-second-ahead speeds of a wheel loader: of one made up, whose valve is known, and of the recorded one.
#include "app/studies/wheel_loader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "app/studies/loader_prediction.h"
#include "app/studies/real_recordings.h"
#include "core/error.h"
#include "tests/support/places.h"

namespace knuckle::studies {
namespace {

namespace fs = std::filesystem;

/// Lift and tilt by turns: lever ramps, delay 0.2 s, lag 0.1 s, dead band 0.3, saturation 0.8; the bucket stands while
/// the boom lifts, and the other way about. Between strokes both go back with the levers at zero.
LoaderRun made_up_run(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.005);
  LoaderRun run;
  run.source = "made up";
  run.step_s = 0.05;
  for (auto* channel : {&run.engine_rps, &run.drive_axle_rps, &run.throttle, &run.gear, &run.digging}) {
    channel->assign(size, 0);
  }
  for (std::size_t axis = 0; axis < kLoaderAxes; ++axis) {
    double angle = 0, speed = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t turn = i / 200 % 2, phase = i % 200;
      const double height = 0.35 + 0.65 * static_cast<double>((i / 200 * 2654435761U + seed) % 997) / 997;
      const double stroke = std::sin(M_PI * static_cast<double>(phase) / 100);
      run.lever[axis].push_back(turn == axis && phase < 100 ? height * stroke : 0);
      const double acts = i >= 4 ? run.lever[axis][i - 4] : 0;
      const double wanted =
          turn == axis && phase >= 125 && angle > 0 ? -0.3 : 0.2 * std::clamp((acts - 0.3) / 0.5, 0.0, 1.0);
      speed += (1 - std::exp(-0.5)) * (wanted - speed);
      angle += 0.05 * speed;
      run.angle_rad[axis].push_back(angle);
      run.speed_radps[axis].push_back(speed + noise(random));
      run.force_MN[axis].push_back(0.2);
    }
  }
  return run;
}

/// The recorded loader, or empty where it is not there.
fs::path recorded() {
  const fs::path folder = fs::path(test::source_dir()) / "../shared/data/wheel_loader";
  return fs::is_directory(folder) ? folder : fs::path();
}

/// First 70 % of the rows to train/, the rest to test/.
void split_rows(const fs::path& folder, const fs::path& into) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::ifstream file(entry.path());
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    const std::size_t train = 1 + (lines.size() - 1) * 7 / 10;
    for (const char* part : {"train", "test"}) {
      fs::create_directories(into / part / "wheel_loader");
      std::ofstream out(into / part / "wheel_loader" / entry.path().filename());
      out << lines[0] << '\n';
      const bool first = std::string(part) == "train";
      for (std::size_t i = first ? 1 : train; i < (first ? train : lines.size()); ++i) out << lines[i] << '\n';
    }
  }
}

TEST(LoaderValve, FindsTheKnownValveOfAMadeUpLoader) {
  const std::array train{made_up_run(6000, 1)}, test{made_up_run(2000, 2)};
  for (const LoaderAxis axis : {kLift, kTilt}) {
    const LoaderValve valve = identify_loader_valve(train, test, axis);
    EXPECT_NEAR(valve.dead_band, 0.3, 0.04);
    EXPECT_NEAR(valve.saturation, 0.8, 0.06);
    EXPECT_NEAR(valve.delay_s + valve.lag_s, 0.3, 0.06);
    EXPECT_NEAR(valve.full_radps, 0.2, 0.01);
    EXPECT_GT(valve.explained, 0.95);
  }
  EXPECT_NEAR(period_from_motion(train[0]), 0.05, 0.001);
}

TEST(LoaderValve, RefusesALeverThatNeverMoves) {
  std::array runs{made_up_run(2000, 1)};
  for (double& lever : runs[0].lever[kTilt]) lever = 0;
  EXPECT_THROW((void)identify_loader_valve(runs, runs, kTilt), InputError);
}

/// Nothing of the future may enter: a run that ends at a moment and one that goes on predict the same there.
TEST(LoaderPrediction, UsesNothingOfTheFuture) {
  const std::array train{made_up_run(3000, 1)};
  std::array test{made_up_run(400, 2)};
  const auto whole = predict_speeds(train, test, false);
  // Shuffle everything after the last prediction's moment but the speeds it is judged by.
  for (std::size_t i = test[0].size() - 20; i < test[0].size(); ++i) {
    for (auto& lever : test[0].lever) lever[i] = 1 - lever[i];
    for (auto& angle : test[0].angle_rad) angle[i] = -angle[i];
    test[0].engine_rps[i] = 99;
  }
  const auto disturbed = predict_speeds(train, test, false);
  const auto told = predict_speeds(train, test, true);
  for (std::size_t axis = 0; axis < kLoaderAxes; ++axis) {
    EXPECT_EQ(whole[axis].rmse_radps, disturbed[axis].rmse_radps);
    EXPECT_EQ(whole[axis].arx_radps, disturbed[axis].arx_radps);
    EXPECT_NE(whole[axis].rmse_radps, told[axis].rmse_radps);
  }
}

TEST(WheelLoader, BeatsPersistenceAndArxOnTheRecordedRun) {
  if (recorded().empty()) GTEST_SKIP() << "no ../shared/data/wheel_loader";
  const fs::path folder = fs::path(testing::TempDir()) / "knuckle_loader_split";
  fs::remove_all(folder);
  split_rows(recorded(), folder);
  const std::vector<RealRow> rows =
      wheel_loader_rows((folder / "train/wheel_loader").string(), (folder / "test/wheel_loader").string());
  fs::remove_all(folder);
  int predictions = 0;
  for (const RealRow& row : rows) {
    EXPECT_EQ(row.dataset, "wheel_loader");
    if (row.quantity.find("1 s ahead") == std::string::npos) continue;
    ++predictions;
    EXPECT_LT(row.value, 0.6 * row.baselines.at(0).second) << row.quantity;
    EXPECT_LT(row.value, 0.9 * row.baselines.at(1).second) << row.quantity;
  }
  EXPECT_EQ(predictions, 4);
}

TEST(RealRecordings, WritesRowsAndSaysInOneLineWhatIsMissing) {
  const fs::path folder = fs::path(testing::TempDir()) / "knuckle_real_none";
  fs::create_directories(folder);
  std::ostringstream said;
  try {
    (void)real_rows(folder.string(), folder.string(), said);
    ADD_FAILURE() << "an empty folder is taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("must share a folder excavator_dig_cycles or wheel_loader"),
              std::string::npos);
  }
  EXPECT_EQ(said.str(), "") << "all is in the one line";
  EXPECT_THROW((void)real_rows((folder / "nowhere").string(), folder.string(), said), InputError);
  fs::create_directories(folder / "wheel_loader");
  EXPECT_THROW((void)real_rows(folder.string(), folder.string(), said), InputError);  // no file in it
  fs::remove_all(folder);

  std::ostringstream json;
  write_real_rows({{"a", "b", 1.5, "m", {{"c", 2}}}, {"a", "d", NAN, "", {}}}, json);
  for (const char* part :
       {"\"schema\": \"knuckle-real-recordings/1\"", "\"value\": 1.5", "\"c\": 2", "\"value\": null"}) {
    EXPECT_NE(json.str().find(part), std::string::npos) << part;
  }
}

}  // namespace
}  // namespace knuckle::studies
