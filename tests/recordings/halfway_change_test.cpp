// Tables in which a unit changes or two channels are exchanged half-way are refused with columns and row; what machines
// really do is not.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "app/recordings/csv_reader.h"
#include "app/recordings/recording_reader.h"
#include "machine/kinematics.h"
#include "tests/identify/recorded_motion.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::recordings {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

/// A motion of the simulated machine as a logger may have written it: pressures in bar, lengths in m, angles in deg.
MappedTable log_of_motion() {
  const estimation::Recording& motion = identify::recorded_motion();
  const Kinematics kinematics(test::solar());
  MappedTable table;
  table.source = "log.csv";
  constexpr std::size_t kFirst = 1000, kCount = 2000;
  for (std::size_t c = 0; c < kSignalChannels; ++c) {
    const double factor = c < kPressureChannels ? 1e5 : 1;
    table.channels.push_back({kSignalNames[c], {}, std::string("col ") + kSignalNames[c], factor, 0});
  }
  for (const char* joint : kJointNames)
    table.channels.push_back({joint + std::string("_rad"), {}, joint + std::string(" angle"), -kDeg, 0.3});
  for (std::size_t i = 0; i < kCount; ++i) {
    const estimation::Measurement& sample = motion.samples[kFirst + i];
    table.time_s.push_back(motion.step_s * static_cast<double>(i));
    table.rows.push_back(i + 2);
    for (std::size_t c = 0; c < kSignalChannels; ++c) table.channels[c].values.push_back(signal(sample, c));
    for (int j = 0; j < kJoints; ++j)
      table.channels[kSignalChannels + static_cast<std::size_t>(j)].values.push_back(
          kinematics.joint_at(j, sample.cylinder_m[j]).value());
  }
  return table;
}

/// Made once: it costs more than what is asked of it.
const MappedTable& logged() {
  static const MappedTable table = log_of_motion();
  return table;
}

std::string refusal(MappedTable table) {
  return test::refusal([&] { refuse_halfway_changes(table); });
}

MappedChannel& channel(MappedTable& table, const std::string& name) {
  return *std::find_if(table.channels.begin(), table.channels.end(), [&](const auto& c) { return c.name == name; });
}

constexpr std::size_t kChanges[] = {150, 411, 800, 1203, 1777};

TEST(HalfwayChange, OfAUnitIsToldWithItsColumnAndRow) {
  struct Case {
    std::vector<const char*> channels;  ///< In the table's order, of which the first is told.
    double ratio;                       ///< Of cells, from the change on.
    const char* what;
  };
  const Case cases[] = {{{"boom_head_Pa"}, 1e5, "Pa after bar"},
                        {{"boom_head_Pa", "arm_head_Pa"}, 0.1, "MPa after bar"},
                        {{"boom_head_Pa", "bucket_head_Pa"}, 100, "kPa after bar"},
                        {{"boom_head_Pa", "arm_rod_Pa"}, 14.5037738, "psi after bar"},
                        {{"boom_cylinder_m"}, 1000, "mm after m"},
                        {{"arm_cylinder_m"}, 100, "cm after m"},
                        {{"boom_rad"}, kDeg, "rad after deg"}};
  int told = 0;
  for (const Case& c : cases) {
    for (const std::size_t at : kChanges) {
      for (const bool first : {false, true}) {  // the other unit before, or behind
        MappedTable table = logged();
        const bool open_to_tank = std::any_of(c.channels.begin(), c.channels.end(), [&](const char* name) {
          return std::string(name).ends_with("_Pa") && channel(table, name).values[at] < 5e5;
        });
        if (open_to_tank && std::abs(std::log(c.ratio)) < std::log(500)) continue;
        ++told;
        for (const char* name : c.channels) {
          MappedChannel& other = channel(table, name);
          const std::size_t begin = first ? 0 : at, end = first ? at : other.values.size();
          for (std::size_t i = begin; i < end; ++i)
            other.values[i] = (other.values[i] - other.offset) * c.ratio + other.offset;
        }
        const MappedChannel& changed = channel(table, c.channels.front());
        const std::string said = refusal(table);
        EXPECT_TRUE(test::begins(said, "log.csv: column '" + changed.column + "' changes its unit: from row " +
                                           std::to_string(at + 2) + " on it is "))
            << c.what << ": from " << changed.values[at - 1] << " to " << changed.values[at];
        const std::string words = c.what;
        const std::size_t between = words.find(" after ");
        const std::string reversed = words.substr(between + 7) + " after " + words.substr(0, between);
        EXPECT_TRUE(test::says(said, ": " + (first ? reversed : words)));
      }
    }
  }
  EXPECT_GE(told, 60) << "of 70";
}

TEST(HalfwayChange, OfAUnitIsToldAlsoWhereItChangesBackAndWhereCellsAreMissing) {
  MappedTable table = logged();
  MappedChannel& changed = channel(table, "boom_head_Pa");
  for (std::size_t i = 600; i < 650; ++i) changed.values[i] *= 1e5;
  for (std::size_t i = 590; i < 602; ++i) changed.values[i] = std::nan("");
  EXPECT_TRUE(test::says(refusal(table), "' changes its unit: from row 604 on it is "));
}

/// A load that is held, then let down within one sample: what a release valve does, 20 samples a second.
void release(MappedChannel& pressure, std::size_t at, double held_bar, double released_bar) {
  for (std::size_t i = 0; i < pressure.values.size(); ++i)
    pressure.values[i] = 1e5 * (i < at ? held_bar : released_bar) * (1 + 1e-3 * std::sin(static_cast<double>(i)));
}

TEST(HalfwayChange, IsNotedOnlyWhereOnePressureAloneJumpsByFewerThanHundreds) {
  struct Case {
    double held_bar, released_bar;
    const char* what;
  };
  for (const Case& c : {Case{150, 15, "MPa after bar"},
                        {15, 150, "bar after MPa"},
                        {220, 15.2, "bar after psi"},
                        {600, 6, "bar after kPa"}}) {
    MappedTable table = logged();
    release(channel(table, "boom_head_Pa"), 800, c.held_bar, c.released_bar);
    release(channel(table, "arm_rod_Pa"), 900, c.held_bar, c.released_bar);
    EXPECT_EQ(refusal(table), "accepted") << c.what << ": also where another one jumps later";
    refuse_halfway_changes(table);
    ASSERT_EQ(table.notes.size(), 2u) << c.what;
    EXPECT_TRUE(test::begins(table.notes[0], "column 'col boom_head_Pa' jumps "));
    EXPECT_TRUE(test::says(table.notes[0], " at row 802 "));
    EXPECT_TRUE(test::says(table.notes[0], c.what));
  }
}

TEST(HalfwayChange, ThatExchangesTwoChannelsIsToldWithBothAndTheRow) {
  const std::pair<const char*, const char*> cases[] = {{"boom_head_Pa", "boom_rod_Pa"},
                                                       {"boom_head_Pa", "bucket_rod_Pa"},
                                                       {"boom_cylinder_m", "arm_cylinder_m"},
                                                       {"arm_cylinder_m", "bucket_cylinder_m"},
                                                       {"boom_rad", "bucket_rad"}};
  for (const auto& [a, b] : cases) {
    for (const std::size_t at : kChanges) {
      MappedTable table = logged();
      MappedChannel &first = channel(table, a), &second = channel(table, b);
      if (std::abs(first.values[at] - second.values[at]) < 1e6 && first.name.ends_with("_Pa")) continue;
      for (std::size_t i = at; i < first.values.size(); ++i) std::swap(first.values[i], second.values[i]);
      const std::string said = refusal(table);
      EXPECT_TRUE(test::begins(
          said, "log.csv: columns '" + first.column + "' and '" + second.column + "' exchange their values: "))
          << "at " << at;
      EXPECT_TRUE(test::says(said, " from row " + std::to_string(at + 2) + " on"));
    }
  }
}

TEST(HalfwayChange, IsNotSeenInWhatAMachineDoes) {
  EXPECT_EQ(refusal(logged()), "accepted");
}

TEST(HalfwayChange, IsNotSeenInRealRecordings) {
  const std::filesystem::path folder = test::source_dir() + "/../shared/data/excavator_dig_cycles";
  if (!std::filesystem::exists(folder))
    GTEST_SKIP() << "NOT TESTED: real recordings: no ../shared/data/excavator_dig_cycles";
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".csv") continue;
    ++files;
    const MappedTable table =
        read_mapped_csv(entry.path().string(), test::source_dir() + "/config/maps/excavator_dig_cycles.toml");
    EXPECT_EQ(refusal(table), "accepted") << entry.path();
  }
  EXPECT_GT(files, 0);
}

}  // namespace
}  // namespace knuckle::recordings
