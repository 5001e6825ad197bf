// Tables as recordings: what is read back is what the table said, and nothing is made up.
#include "app/recordings/import.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>

#include "app/recordings/own_table.h"
#include "core/error.h"
#include "machine/load.h"
#include "recording/events.h"
#include "recording/fields.h"
#include "recording/recording.h"
#include "recording/replay.h"
#include "slave/slave_state.h"
#include "tests/identify/recorded_motion.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/shipped.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::recordings {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

class Import : public testing::Test {
 protected:
  /// The table has a hole that no line may cross, and commands that are not known.
  Import() {
    estimation::Recording written = part_of(identify::recorded_motion(), 1000, 2000);
    for (std::size_t i = 300; i < 320; ++i) written.usable[i] = 0;
    for (std::size_t i = 500; i < 540; ++i) written.valve[i][kArm] = kUnknown;
    std::ofstream file(csv_);
    write_recording(written, file);
    file.close();
    table_ = read_recording(csv_, "", machine_);
    recording::Head head;
    head.program = "knuckle import";
    head.machine_file = "machine";
    head.mapping_file = "mapping";
    write_imported(table_, head, machine_, mcap_);
  }

  MachineDescription machine_ = [] {
    MachineDescription machine = test::solar();
    machine.sensors.encoder_offset_m = {0.001, -0.002, 0.003};
    return machine;
  }();
  test::TemporaryFolder folder_;
  std::string csv_ = folder_.file("table.csv"), mcap_ = folder_.file("new/table.mcap");
  RecordedFile table_;
};

TEST_F(Import, EverySampleOfTheTableIsAStateOfTheMachine) {
  const Kinematics kinematics(machine_);
  recording::Recording recording({mcap_});
  std::size_t i = 0;
  while (const auto entry = recording.next()) {
    if (entry->topic != recording::Topic::kMachineState) continue;
    ASSERT_LT(i, table_.recording.samples.size());
    slave::SlaveState state;
    ASSERT_TRUE(recording::decode(entry->data, state));
    const estimation::Measurement& sample = table_.recording.samples[i];
    EXPECT_EQ(state.at, entry->at);
    EXPECT_EQ(to_seconds(state.at), std::round(1e9 * table_.recording.step_s * static_cast<double>(i)) / 1e9);
    EXPECT_EQ(state.measured, table_.recording.usable[i] != 0);
    for (int j = 0; j < kJoints; ++j) {
      const double told = table_.recording.valve[i][j];
      EXPECT_TRUE(std::isnan(told) ? std::isnan(state.valve_command[j]) : state.valve_command[j] == told);
    }
    if (state.measured) {
      EXPECT_EQ(state.pressure_Pa, sample.pressure_Pa);
      EXPECT_EQ(state.cylinder_m, sample.cylinder_m);
      EXPECT_EQ(state.hull_pitch_rad, sample.hull_pitch_rad);
    } else {
      for (const double untold : {state.pressure_Pa[0], state.pressure_Pa[5], state.cylinder_m[1], state.hull_pitch_rad,
                                  state.joint_rad[2], state.oldest_age_s})
        EXPECT_TRUE(std::isnan(untold)) << "in a hole";
    }
    for (int j = 0; j < kJoints && state.measured; ++j) {
      const double length_m = sample.cylinder_m[j] - machine_.sensors.encoder_offset_m[j];
      EXPECT_EQ(state.joint_rad[j], kinematics.joint_at(j, length_m).value());
    }
    EXPECT_EQ(state.mode, Mode::kOff);
    for (const double untold : {state.confidence, state.payload_kg, state.payload_sigma_kg, state.tip_force_N.x(),
                                state.joint_radps[0], state.spool[0], state.setpoint_rad[0], state.covariance_N2[0]})
      EXPECT_TRUE(std::isnan(untold)) << "no table tells it";
    ++i;
  }
  EXPECT_EQ(i, table_.recording.samples.size());
  EXPECT_TRUE(recording.complete());
  EXPECT_TRUE(std::isnan(table_.recording.valve[520][kArm]));
  EXPECT_EQ(table_.recording.usable[310], 0);
}

TEST_F(Import, IsReadAgainAsTheTable) {
  const RecordedFile again = read_recording(mcap_, "", machine_);
  EXPECT_EQ(again.recording.step_s, table_.recording.step_s);
  EXPECT_EQ(again.recording.usable, table_.recording.usable);
  ASSERT_EQ(again.recording.samples.size(), table_.recording.samples.size());
  for (std::size_t i = 0; i < again.recording.samples.size(); ++i) {
    for (int j = 0; j < kJoints; ++j) {
      const double told = table_.recording.valve[i][j], read = again.recording.valve[i][j];
      ASSERT_TRUE(std::isnan(told) ? std::isnan(read) : read == told) << i;
    }
    if (again.recording.usable[i] == 0) continue;
    for (std::size_t c = 0; c < kSignalChannels; ++c)
      ASSERT_EQ(signal(again.recording.samples[i], c), signal(table_.recording.samples[i], c)) << i << " " << c;
  }
}

TEST_F(Import, MakesUpNoFramesAndIsNotReplayed) {
  recording::Recording recording({mcap_});
  EXPECT_TRUE(recording.head().imported);
  EXPECT_EQ(recording.head().mapping_file, "mapping");
  EXPECT_EQ(recording.head().machine_file, "machine");
  std::vector<std::string> events;
  while (const auto entry = recording.next()) {
    ASSERT_TRUE(entry->topic == recording::Topic::kMachineState || entry->topic == recording::Topic::kEvents);
    if (entry->topic != recording::Topic::kEvents) continue;
    events.push_back(recording::decode_log(entry->data, recording.head().started_unix_ns).value().text);
  }
  EXPECT_EQ(events, table_.notes);
  EXPECT_GE(events.size(), 2U);
  EXPECT_TRUE(test::begins(test::refusal([&] { (void)recording::replay(recording, {}); }),
                           mcap_ + ": was imported from a table"));
}

TEST_F(Import, OfARecordingNeedsNoMapping) {
  EXPECT_THROW((void)read_recording(mcap_, csv_, machine_), InputError);
  EXPECT_THROW((void)read_recording(folder_.file("none.mcap"), "", machine_), InputError);
}

/// A change of a table, and what its refusal says: where it begins, and the bound that is broken.
struct Impossible {
  std::function<void(RecordedFile&)> change;
  std::string column, bound;
};

/// All samples changed.
std::function<void(RecordedFile&)> each(const std::function<void(estimation::Measurement&)>& change) {
  return [change](RecordedFile& table) {
    for (estimation::Measurement& sample : table.recording.samples) change(sample);
  };
}

TEST_F(Import, IsRefusedWithColumnRowAndBoundWhereTheMachineCannotHaveMeasuredIt) {
  const std::string row = std::to_string(table_.rows[7]);
  const auto usable = static_cast<std::size_t>(
      std::count(table_.recording.usable.begin(), table_.recording.usable.end(), std::uint8_t{1}));
  const std::size_t more_than_a_fifth = usable / 5 + 1;  // the median stays possible
  ASSERT_LT(more_than_a_fifth, 300U) << "before the hole";
  const auto factor = [](double of) {
    return each([of](estimation::Measurement& sample) {
      for (double& pressure_Pa : sample.pressure_Pa) pressure_Pa *= of;
    });
  };
  const std::string to = folder_.file("refused.mcap");
  for (const Impossible& is :
       {Impossible{factor(10), "column 'boom_head_Pa': ", "; at most 20 % may be: "},
        {factor(1e-5), "no pressure of the table reaches 2 bar (the highest is 0.00", " bar, in row "},
        {[](RecordedFile& table) {
           each([](auto& sample) { sample.hull_pitch_rad = 3.5; })(table);
           table.recording.samples[7].hull_pitch_rad = 100;
         },
         "column 'hull_pitch_rad': 100 % of it is outside what is possible at machine ",
         ", -0.35 to 0.35 rad (most of all 100 in row " + row + ")"},
        {[&](RecordedFile& table) {
           for (std::size_t i = 0; i < more_than_a_fifth; ++i) table.recording.samples[i].cylinder_m[kArm] = 3;
           table.recording.samples[7].cylinder_m[kArm] = 4;
         },
         "column 'arm_cylinder_m': 20.",
         "0.843 to 1.373 m (most of all 4 in row " + row + "); at most 20 % may be: "}}) {
    RecordedFile table = table_;
    is.change(table);
    const std::string said = test::refusal([&] { (void)write_imported(table, {}, machine_, to); });
    EXPECT_TRUE(test::begins(said, csv_ + ": " + is.column));
    EXPECT_TRUE(test::says(said, is.bound));
    EXPECT_FALSE(test::says(said, "\n"));
    EXPECT_FALSE(std::filesystem::exists(to));
  }
}

TEST_F(Import, IsRefusedForAnotherMachine) {
  const std::string to = folder_.file("other.mcap");
  const std::string said = test::refusal([&] { (void)write_imported(table_, {}, test::shipped("compact080"), to); });
  EXPECT_TRUE(test::begins(said, csv_ + ": column 'boom_cylinder_m': 100 % of it is outside what is possible"));
  EXPECT_TRUE(test::says(said, "compact080, 1.45 to 2.32 m (most of all 0."));
  EXPECT_FALSE(std::filesystem::exists(to));
}

TEST_F(Import, SaysWhichFewValuesTheMachineCannotHaveMeasured) {
  for (std::size_t i = 10; i < 20; ++i) table_.recording.samples[i].cylinder_m[kArm] = 3;
  const std::vector<std::string> notes = write_imported(table_, {}, machine_, folder_.file("few.mcap"));
  ASSERT_EQ(notes.size(), table_.notes.size() + 1);
  EXPECT_TRUE(test::begins(notes.back(), "10 samples of arm_cylinder_m are outside what is possible"));
  EXPECT_TRUE(test::says(notes.back(), "(most of all 3 in row " + std::to_string(table_.rows[10]) + ")"));
}

TEST_F(Import, LeavesNothingBehindWhereItCannotBeWritten) {
  const std::string taken = folder_.file("taken.mcap");
  std::filesystem::create_directory(taken);
  EXPECT_THROW(write_imported(table_, {}, machine_, taken), InputError);
  EXPECT_EQ(folder_.count(), 3);  // table, folder of the recording, and what is in the way
}

}  // namespace
}  // namespace knuckle::recordings
