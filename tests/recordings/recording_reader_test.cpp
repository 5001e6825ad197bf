// Recordings as CSV: what is written is read again bit for bit; foreign files come out the same in Knuckle's units.
#include "app/recordings/recording_reader.h"

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>
#include <sstream>

#include "app/recordings/csv_reader.h"
#include "machine/kinematics.h"
#include "tests/identify/recorded_motion.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::recordings {
namespace {

class RecordingReader : public testing::Test {
 protected:
  [[nodiscard]] std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.file(name)) << text;
    return folder_.file(name);
  }
  [[nodiscard]] RecordedFile read(const std::string& text) const {
    return read_recording(file("a.csv", text), "", test::solar());
  }
  [[nodiscard]] std::string refusal(const std::string& text) const {
    return test::refusal([&] { (void)read(text); });
  }
  test::TemporaryFolder folder_;
};

std::string as_csv(const estimation::Recording& recording) {
  std::ostringstream out;
  write_recording(recording, out);
  return out.str();
}

const std::string& csv() {
  static const std::string text = as_csv(part_of(identify::recorded_motion(), 1000, 2000));
  return text;
}

TEST_F(RecordingReader, ReadsAgainWhatWasWrittenBitForBit) {
  estimation::Recording written = part_of(identify::recorded_motion(), 1000, 2000);
  for (std::size_t i = 300; i < 320; ++i) written.usable[i] = 0;
  const RecordedFile again = read(as_csv(written));
  ASSERT_EQ(again.recording.samples.size(), written.samples.size());
  EXPECT_EQ(again.recording.step_s, written.step_s);
  EXPECT_EQ(again.recording.usable, written.usable);
  ASSERT_EQ(again.recording.valve.size(), written.valve.size());
  for (std::size_t i = 0; i < written.samples.size(); ++i) {
    if (written.usable[i] == 0) continue;
    EXPECT_EQ(again.recording.valve[i], written.valve[i]);
    for (std::size_t c = 0; c < kSignalChannels; ++c)
      ASSERT_EQ(signal(again.recording.samples[i], c), signal(written.samples[i], c)) << i << " " << c;
  }
  EXPECT_EQ(again.rows[10], 12u);
}

TEST_F(RecordingReader, ReadsForeignColumnsThroughAMapping) {
  const estimation::Recording truth = part_of(identify::recorded_motion(), 1000, 2000);
  const Kinematics kinematics(test::solar());
  std::ostringstream out;
  out.precision(17);
  out << "ms,junk,bucketR,bucketH,armR,armH,boomR,boomH,boom,stick,spoon,slope\n";
  for (std::size_t i = 0; i < truth.samples.size(); ++i) {
    const estimation::Measurement& m = truth.samples[i];
    out << 5 * i + 1000 << ',' << i;
    for (std::size_t c = 6; c-- > 0;) out << ',' << m.pressure_Pa[c] / 1e5;
    out << ',' << *kinematics.joint_at(0, m.cylinder_m[0]) * 180 / std::numbers::pi << ',' << 1e3 * m.cylinder_m[1]
        << ',' << m.cylinder_m[2] << ',' << -m.hull_pitch_rad << '\n';
  }
  std::string map = "[time]\ncolumn = \"ms\"\nunit = \"ms\"\ngap_s = 0.1\n";
  const auto channel = [&](const char* name, const char* column, const char* unit, int sign) {
    map += std::string("[[channel]]\nname = \"") + name + "\"\ncolumn = \"" + column + "\"\nunit = \"" + unit +
           "\"\noffset = 0\nsign = " + std::to_string(sign) + "\n";
  };
  const std::array<const char*, 6> columns{"boomH", "boomR", "armH", "armR", "bucketH", "bucketR"};
  for (std::size_t c = 0; c < 6; ++c) channel(kSignalNames[c], columns[c], "bar", 1);
  channel("boom_rad", "boom", "deg", 1);
  channel("arm_cylinder_m", "stick", "mm", 1);
  channel("bucket_cylinder_m", "spoon", "m", 1);
  channel("hull_pitch_rad", "slope", "rad", -1);
  const RecordedFile foreign = read_recording(file("foreign.csv", out.str()), file("map.toml", map), test::solar());
  EXPECT_EQ(foreign.columns[0], "boomH");
  EXPECT_EQ(foreign.columns[6], "boom");
  ASSERT_EQ(foreign.recording.samples.size(), truth.samples.size());
  for (std::size_t i = 0; i < truth.samples.size(); ++i)
    for (std::size_t c = 0; c < kSignalChannels; ++c)
      ASSERT_NEAR(signal(foreign.recording.samples[i], c), signal(truth.samples[i], c), c < 6 ? 1e-6 : 1e-9);
}

TEST_F(RecordingReader, LeavesMissingCommandsUnknownAndKeepsTheirSamples) {
  estimation::Recording written = part_of(identify::recorded_motion(), 1000, 2000);
  for (std::size_t i = 300; i < 350; ++i) written.valve[i][kArm] = std::nan("");
  const RecordedFile again = read(as_csv(written));
  for (std::size_t i = 0; i < written.valve.size(); ++i) {
    EXPECT_EQ(std::isnan(again.recording.valve[i][kArm]), i >= 300 && i < 350) << i;
    EXPECT_EQ(again.recording.valve[i][kBoom], written.valve[i][kBoom]);
  }
  EXPECT_EQ(again.recording.usable, written.usable);
  EXPECT_NE(std::find(again.notes.begin(), again.notes.end(),
                      "50 samples of arm_valve lie in longer holes: not used for this valve"),
            again.notes.end());
  std::string without = csv();
  without.replace(without.find("arm_valve"), 9, "elsewhere");
  EXPECT_TRUE(
      read(without).recording.valve[500].array().isNaN().cwiseEqual(Eigen::Array3<bool>(false, true, false)).all());
}

TEST_F(RecordingReader, NamesEveryMissingColumn) {
  std::string text = csv();
  for (const char* name : {"arm_rod_Pa", "hull_pitch_rad"}) text.replace(text.find(name), 3, "xyz");
  const std::string said = refusal(text);
  EXPECT_TRUE(test::says(said, "no column 'arm_rod_Pa', 'hull_pitch_rad'"));
  EXPECT_TRUE(test::says(refusal("t_s,boom_rad,boom_A_bar\n0,1,2\n"), "an older `knuckle simulate --csv`"));
}

TEST_F(RecordingReader, NamesOnlyTheColumnThatIsEmptyThroughout) {
  std::istringstream in(csv());
  std::string text, line;
  std::getline(in, line);
  text = line + "\n";
  while (std::getline(in, line)) {  // the third cell is boom_rod_Pa's
    const std::size_t second = line.find(',', line.find(',') + 1);
    text += line.substr(0, second + 1) + "nan" + line.substr(line.find(',', second + 1)) + "\n";
  }
  const std::string said = refusal(text);
  EXPECT_TRUE(test::says(said, "column 'boom_rod_Pa' has no usable value"));
  for (const char* other : kSignalNames) EXPECT_EQ(bool(test::says(said, other)), std::string(other) == "boom_rod_Pa");
}

TEST_F(RecordingReader, InterpolatesShortHolesAndLeavesLongOnesOut) {
  const auto cut = [](std::size_t first, std::size_t last) {
    std::istringstream in(csv());
    std::string out, line;
    for (std::size_t r = 1; std::getline(in, line); ++r) out += r >= first && r <= last ? "" : line + "\n";
    return out;
  };
  const RecordedFile brief = read(cut(500, 502)), lasting = read(cut(500, 599));
  const std::size_t count = part_of(identify::recorded_motion(), 1000, 2000).samples.size();
  EXPECT_EQ(brief.recording.samples.size(), count);
  EXPECT_EQ(brief.recording.usable, std::vector<std::uint8_t>(count, 1));
  for (std::size_t i = 498; i < 501; ++i)
    EXPECT_NEAR(brief.recording.samples[i].cylinder_m[0], identify::recorded_motion().samples[1000 + i].cylinder_m[0],
                5e-4);
  EXPECT_EQ(std::count(lasting.recording.usable.begin(), lasting.recording.usable.end(), 0), 100);
  EXPECT_EQ(lasting.recording.usable[498], 0);
  EXPECT_EQ(lasting.recording.usable[597], 0);
}

/// csv() with another time in each row.
std::string with_times(const std::function<std::string(int)>& time) {
  std::istringstream in(csv());
  std::string out, line;
  std::getline(in, line);
  out = line + "\n";
  for (int i = 0; std::getline(in, line); ++i) out += time(i) + line.substr(line.find(',')) + "\n";
  return out;
}

TEST_F(RecordingReader, TakesTimeInAnyUnitByItsStepOrAsUnixTimeAndRefusesOneThatIsNone) {
  const RecordedFile plain = read(csv());
  struct Case {
    const char* unit;
    std::int64_t from, step;
  };
  for (const Case& c : {Case{"ms", 0, 5}, Case{"us", 0, 5000}, Case{"ns", 0, 5'000'000},
                        Case{"ms", 1'766'147'454'233, 5}, Case{"ns", 1'766'147'454'233'218'048, 5'000'000}}) {
    const RecordedFile other = read(with_times([&](int i) { return std::to_string(c.from + i * c.step); }));
    EXPECT_EQ(other.recording.step_s, 0.005) << c.unit;
    EXPECT_EQ(other.recording.samples.size(), plain.recording.samples.size());
    EXPECT_EQ(other.recording.usable, plain.recording.usable);
    const std::string note = std::string("time_s holds ") + c.unit + ", not s: read as such";
    EXPECT_NE(std::find(other.notes.begin(), other.notes.end(), note), other.notes.end()) << note;
  }
  EXPECT_EQ(read(with_times([](int i) { return std::to_string(1'766'147'454 + 0.005 * i); })).recording.step_s, 0.005);
  EXPECT_TRUE(test::says(refusal(with_times([](int i) { return std::to_string(0.1 * i); })),
                         "its usual step in time is 0.1 s, must be within"));
}

TEST_F(RecordingReader, OneWildTimeIsLeftOutAndAClockThatWasSetIsToldWithItsRow) {
  const auto wild = [](int from) {
    return with_times([from](int i) { return std::to_string(0.005 * i + (i >= from ? 1'766'147'473.0 : 0.0)); });
  };
  const RecordedFile table = read(wild(999));
  EXPECT_EQ(table.recording.samples.size(), 999u);
  EXPECT_NE(
      std::find(table.notes.begin(), table.notes.end(), "1 x time far from all others (left out) in time_s: row 1001"),
      table.notes.end());
  EXPECT_TRUE(
      test::says(refusal(wild(500)), "more than 4000000 samples: its longest gap, 1.76614747e+09 s, ends at row 502"));
}

}  // namespace
}  // namespace knuckle::recordings
