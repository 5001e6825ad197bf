// Dirty data: a good recording passes untouched; every defect put into it is named by column and row, or refused.
#include "app/commissioning/data_check.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>

#include "app/commissioning/data_physics.h"
#include "core/error.h"
#include "tests/commissioning/recorded_motion.h"

namespace knuckle::app {
namespace {

using estimation::Measurement;
using estimation::Recording;

std::size_t unusable(const Recording& recording) {
  return static_cast<std::size_t>(std::count(recording.usable.begin(), recording.usable.end(), std::uint8_t{0}));
}

/// What is said of the recording after `spoil`; "accepted" where it is not refused.
std::string refusal(const std::function<void(Measurement&)>& spoil) {
  RecordedFile file = as_file(recorded_motion());
  for (Measurement& m : file.recording.samples) spoil(m);
  try {
    (void)require_data(recorded_machine(), file);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

bool names(const std::string& text, const std::vector<std::string>& words) {
  return std::all_of(words.begin(), words.end(),
                     [&](const std::string& w) { return text.find(w) != std::string::npos; });
}

TEST(DataCheck, LeavesAGoodRecordingAsItIs) {
  RecordedFile file = as_file(recorded_motion());
  const DataCheck check = require_data(recorded_machine(), file);
  EXPECT_TRUE(check.findings.empty()) << check.lines().front();
  EXPECT_EQ(unusable(file.recording), unusable(recorded_motion()));
  for (std::size_t i = 0; i < file.recording.samples.size(); ++i)
    for (std::size_t c = 0; c < kSignalChannels; ++c)
      ASSERT_EQ(signal(file.recording.samples[i], c), signal(recorded_motion().samples[i], c)) << i << " " << c;
  for (int j = 0; j < kJoints; ++j) EXPECT_NEAR(check.weight_ratio[j], 1, 0.5) << j;
}

TEST(DataCheck, NamesSwappedChannels) {
  for (std::size_t j = 0; j < kJoints; ++j) {
    const std::string said =
        refusal([&](Measurement& m) { std::swap(m.pressure_Pa[2 * j], m.pressure_Pa[2 * j + 1]); });
    EXPECT_TRUE(names(said, {kSignalNames[2 * j], kSignalNames[2 * j + 1], "swapped"})) << said;
  }
  for (const auto& [a, b] : {std::pair<std::size_t, std::size_t>{6, 7}, {6, 8}, {7, 8}}) {
    const std::string lengths = refusal([&](Measurement& m) { std::swap(signal(m, a), signal(m, b)); });
    EXPECT_TRUE(names(lengths, {kSignalNames[a], kSignalNames[b], "look swapped"})) << lengths;
  }
  const std::string pairs = refusal([](Measurement& m) {
    std::swap(m.pressure_Pa[0], m.pressure_Pa[2]);
    std::swap(m.pressure_Pa[1], m.pressure_Pa[3]);
  });
  EXPECT_TRUE(names(pairs, {"boom_head_Pa", "arm_rod_Pa", "swapped"})) << pairs;
}

TEST(DataCheck, NamesWrongUnits) {
  constexpr double kBar = 1e5, kPsi = 6894.757;
  const auto pressures = [](double factor) {
    return refusal([factor](Measurement& m) {
      for (double& p : m.pressure_Pa) p *= factor;
    });
  };
  EXPECT_TRUE(names(pressures(1 / kBar), {"boom_head_Pa", "bucket_rod_Pa", "bar taken as Pa"})) << pressures(1 / kBar);
  EXPECT_TRUE(names(pressures(1 / kPsi), {"psi taken as Pa"})) << pressures(1 / kPsi);
  EXPECT_TRUE(names(pressures(kBar / kPsi), {"boom_head_Pa", "psi taken as bar"})) << pressures(kBar / kPsi);
  EXPECT_TRUE(names(pressures(kBar), {"boom_head_Pa", "Pa taken as bar"})) << pressures(kBar);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const std::string one = refusal([j](Measurement& m) {
      m.pressure_Pa[2 * j] /= kBar;
      m.pressure_Pa[2 * j + 1] /= kBar;
    });
    EXPECT_TRUE(names(one, {kSignalNames[2 * j], "bar taken as Pa"})) << one;
    const std::string mm = refusal([j](Measurement& m) { m.cylinder_m[static_cast<Eigen::Index>(j)] *= 1000; });
    EXPECT_TRUE(names(mm, {kSignalNames[kPressureChannels + j], "millimetres taken as metres"})) << mm;
  }
  const std::string tilt = refusal([](Measurement& m) { m.hull_pitch_rad *= 180 / std::numbers::pi; });
  EXPECT_TRUE(names(tilt, {"hull_pitch_rad", "degrees taken as radians"})) << tilt;
}

TEST(DataCheck, RefusesPressuresOfAnotherTransmitterRange) {
  for (const double factor : {0.625, 1.6}) {
    const std::string said = refusal([&](Measurement& m) {
      for (double& p : m.pressure_Pa) p *= factor;
    });
    EXPECT_TRUE(names(said, {"range"})) << factor << ": " << said;
  }
}

TEST(DataCheck, NamesWrongSigns) {
  for (std::size_t c = 0; c + 1 < kSignalChannels; ++c) {
    const std::string said = refusal([c](Measurement& m) { signal(m, c) = -signal(m, c); });
    EXPECT_TRUE(names(said, {kSignalNames[c]})) << said;
    EXPECT_TRUE(c == 1 || c == 3 || c == 5 || names(said, {"wrong sign"})) << said;
  }
}

TEST(DataCheck, RefusesAllZeroPressuresAndAnyChannelThatIsZeroThroughout) {
  EXPECT_TRUE(names(refusal([](Measurement& m) { m.pressure_Pa.fill(0); }), {"boom_head_Pa is zero throughout"}));
  for (std::size_t c = 0; c + 1 < kSignalChannels; ++c) {
    const std::string said = refusal([c](Measurement& m) { signal(m, c) = 0; });
    EXPECT_TRUE(names(said, {std::string(kSignalNames[c]) + " is zero throughout"})) << said;
  }
}

/// Defects of single samples and stretches: what is done to samples first ... first + count - 1 of a channel.
struct Defect {
  const char* name;
  std::size_t count;
  std::function<double(double)> spoil;
  std::vector<std::size_t> channels;
};

TEST(DataCheck, NamesAndTakesOutDropOutsSpikesAndStretchesOutOfRange) {
  const std::vector<Defect> defects{
      {"drop-out", 1, [](double) { return 0.0; }, {0, 2, 6, 7, 8}},
      {"drop-out", 3, [](double) { return 0.0; }, {0, 2, 6, 7, 8}},
      {"drop-out", 50, [](double) { return 0.0; }, {0, 2, 6, 7, 8}},
      {"spike", 1, [](double x) { return x + 60e5; }, {0, 1, 2, 3, 4, 5}},
      {"spike", 1, [](double x) { return x - 0.03; }, {6, 7, 8}},
      {"outside", 20, [](double x) { return x + 2; }, {6, 7, 8}},
      {"outside", 1, [](double) { return 450e5; }, {0, 3, 5}},
      {"outside", 5, [](double) { return 1.5; }, {9}},
  };
  std::mt19937 random(7);
  for (const Defect& defect : defects) {
    for (const std::size_t c : defect.channels) {
      RecordedFile file = as_file(recorded_motion());
      std::size_t first = 0;
      do {
        first = std::uniform_int_distribution<std::size_t>(100, file.recording.samples.size() - 200)(random);
      } while (signal(file.recording.samples[first - 1], c) < 8e5 && c < 6 && std::string(defect.name) == "drop-out");
      for (std::size_t i = first; i < first + defect.count; ++i)
        signal(file.recording.samples[i], c) = defect.spoil(signal(file.recording.samples[i], c));
      const DataCheck check = require_data(recorded_machine(), file);
      ASSERT_FALSE(check.findings.empty()) << defect.name << " in " << kSignalNames[c] << " at " << first;
      const DataFinding& found = check.findings.front();
      EXPECT_EQ(found.column, kSignalNames[c]) << defect.name;
      EXPECT_EQ(found.first_row, first + 2) << defect.name << " in " << kSignalNames[c];
      EXPECT_EQ(found.last_row, first + defect.count + 1) << defect.name << " in " << kSignalNames[c];
      EXPECT_NE(found.what.find(defect.name), std::string::npos) << found.what;
      // Short ones are bridged between their neighbours, long ones are not usable; nothing of them is left.
      for (std::size_t i = first; i < first + defect.count; ++i) {
        if (file.recording.usable[i] == 0) continue;
        const double was = signal(recorded_motion().samples[i], c), is = signal(file.recording.samples[i], c);
        EXPECT_NEAR(is, was, c < 6 ? 15e5 : c < 9 ? 2e-3 : 0.01) << defect.name << " in " << kSignalNames[c];
      }
    }
  }
}

TEST(DataCheck, NamesAStuckPressureAndAStuckLength) {
  for (std::size_t c = 0; c + 1 < kSignalChannels; ++c) {
    RecordedFile file = as_file(recorded_motion());
    // Where the cylinder moves for three seconds.
    const std::size_t length = c < 6 ? 6 + c / 2 : c;
    std::size_t first = 0;
    const auto& samples = recorded_motion().samples;
    for (std::size_t i = 200; i + 800 < samples.size() && first == 0; ++i)
      if (std::abs(signal(samples[i + 600], length) - signal(samples[i], length)) > 0.06) first = i;
    ASSERT_GT(first, 0u);
    for (std::size_t i = first + 1; i < first + 600; ++i)
      signal(file.recording.samples[i], c) = signal(file.recording.samples[first], c);
    const DataCheck check = require_data(recorded_machine(), file);
    ASSERT_FALSE(check.findings.empty()) << kSignalNames[c];
    const DataFinding& found = check.findings.front();
    EXPECT_EQ(found.column, kSignalNames[c]);
    EXPECT_NE(found.what.find("stuck"), std::string::npos) << found.what;
    EXPECT_LE(found.first_row, first + 3) << "a cylinder may have stood still before";
    EXPECT_EQ(found.last_row, first + 601);
    EXPECT_EQ(file.recording.usable[first + 300], 0);
  }
}

}  // namespace
}  // namespace knuckle::app
