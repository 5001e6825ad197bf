// What `knuckle export` makes of a recording, held against what is in the recording.
#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "app/cli/interrupt.h"
#include "app/export/export_command.h"
#include "app/recordings/recording_reader.h"
#include "machine/load.h"
#include "recording/mcap/file_writer.h"
#include "recording/topics.h"
#include "tests/export/machines.h"
#include "tests/export/recorded_session.h"
#include "tests/export/run_export.h"
#include "tests/support/candump.h"

namespace knuckle::exporting {
namespace {

using test::content;
using test::expect_refused;
using test::ProgramRun;
using test::recorded_session;
using test::run_export;
using test::TemporaryFolder;

std::vector<std::vector<std::string>> table(const std::string& text, char between = ',') {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    auto& row = rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, between);) row.push_back(cell);
  }
  return rows;
}

std::vector<std::vector<std::string>> exported_table(const std::string& side, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {recorded_session().recording, "--csv", "-", "--side", side});
  const ProgramRun run = run_export(more);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return table(run.out);
}

bool is_float(const std::string& field) {
  return field.ends_with(".value") || field.ends_with(".limit");
}

/// The number that a cell says, as the field's own type reads it; of words their codes.
double number_of_cell(const std::string& cell, const std::string& field) {
  double number = 0;
  float narrow = 0;
  const char* const end = cell.data() + cell.size();
  const bool whole = is_float(field) ? std::from_chars(cell.data(), end, narrow).ptr == end
                                     : std::from_chars(cell.data(), end, number).ptr == end;
  if (whole) return is_float(field) ? static_cast<double>(narrow) : number;
  for (unsigned code = 0; code < static_cast<unsigned>(ReasonCode::kCount); ++code) {
    if (field == "mode" && code <= static_cast<unsigned>(Mode::kEStop) && cell == name(static_cast<Mode>(code)))
      return code;
    if (field == "contact_model" && code < kContactModelNames.size() && cell == kContactModelNames[code]) return code;
    if (field.ends_with(".code") && cell == name(static_cast<ReasonCode>(code))) return code;
  }
  ADD_FAILURE() << field << ": " << cell;
  return -1;
}

bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

template <typename State>
void expect_every_number(const std::string& side) {
  const auto rows = exported_table(side);
  const std::vector<test::Numbers> steps = test::recorded_steps<State>(recorded_session().recording);
  ASSERT_GT(steps.size(), 200U);
  ASSERT_EQ(rows.size(), steps.size() + 1);
  for (std::size_t n = 0; n < steps.size(); ++n) {
    ASSERT_EQ(rows[n + 1].size(), steps[n].size());
    EXPECT_EQ(std::stod(rows[n + 1][0]), steps[n][0].second / 1e9);
    for (std::size_t i = 1; i < steps[n].size(); ++i)
      ASSERT_TRUE(same(number_of_cell(rows[n + 1][i], steps[n][i].first), steps[n][i].second))
          << "row " << n + 1 << " " << steps[n][i].first << " " << rows[n + 1][i];
  }
}

TEST(RecordingExport, TableHasARowAStepWithEveryNumberOfEitherSideAsRecorded) {
  expect_every_number<slave::SlaveState>("machine");
  expect_every_number<master::MasterState>("operator");
}

/// Of a table's columns, in the order of a step's numbers, some and what they are in the state.
template <typename State>
void expect_names(const std::string& side, const std::map<std::string, std::string>& names) {
  const auto header = exported_table(side)[0];
  const auto step = test::recorded_steps<State>(recorded_session().recording).at(0);
  ASSERT_EQ(header.size(), step.size());
  std::map<std::string, std::string> found;
  for (std::size_t i = 0; i < header.size(); ++i) found[header[i]] = step[i].first;
  EXPECT_EQ(found.size(), header.size());
  for (const auto& [column, number] : names) EXPECT_EQ(found[column], number) << column;
}

TEST(RecordingExport, ColumnsAreCalledAsInTheOtherTables) {
  std::map<std::string, std::string> names{{"time_s", "time_ns"},
                                           {"mode", "mode"},
                                           {"fault", "fault.code"},
                                           {"fault_value", "fault.value"},
                                           {"boom_rad", "joint_rad[0]"},
                                           {"arm_radps", "joint_radps[1]"},
                                           {"setpoint_bucket_rad", "setpoint_rad[2]"},
                                           {"tip_force_x_N", "tip_force_N[0]"},
                                           {"tip_force_z_N", "tip_force_N[1]"},
                                           {"covariance_xx_N2", "covariance_N2[0]"},
                                           {"covariance_xz_N2", "covariance_N2[1]"},
                                           {"boom_valve", "valve[0]"},
                                           {"wanted_arm_valve", "wanted_valve[1]"},
                                           {"bucket_spool", "spool[2]"},
                                           {"torque_boom_Nm", "torque_Nm[0]"},
                                           {"hull_pitch_rad", "hull_pitch_rad"}};
  for (std::size_t c = 0; c + 1 < recordings::kSignalChannels; ++c)
    names[recordings::kSignalNames[c]] =
        c < 6 ? "pressure_Pa[" + std::to_string(c) + "]" : "cylinder_m[" + std::to_string(c - 6) + "]";
  expect_names<slave::SlaveState>("machine", names);
  expect_names<master::MasterState>("operator", {{"time_s", "time_ns"},
                                                 {"forearm_rad", "device_rad[0]"},
                                                 {"wrist_radps", "device_radps[1]"},
                                                 {"setpoint_bucket_rad", "setpoint_rad[2]"},
                                                 {"torque_finger_Nm", "torque_Nm[2]"},
                                                 {"boom_rad", "machine_rad[0]"},
                                                 {"device", "device.code"},
                                                 {"sent_force_z_N", "sent_force_N[1]"}});
}

TEST(RecordingExport, TableOfASessionIsARecordingOfItsSensorsToo) {
  const MachineDescription machine = calibrated(test::shipped("solar015"));
  EXPECT_EQ(recordings::read_recording(recorded_session().csv, "", machine).recording.step_s, 0.005);
}

TEST(RecordingExport, EveryDoubleHasAUnitOrIsKnownToHaveNone) {
  const std::set<std::string> none{
      "authority",      "confidence",  "residual_sigma",         "contact_compliance",  "wanted_valve",  "valve",
      "spool",          "energy_gain", "setting_position_scale", "setting_force_scale", "touched_share", "home_asked",
      "engine_running", "fuel_level"};
  for (const auto* fields : {&fields_of<slave::SlaveState>(), &fields_of<master::MasterState>()})
    for (const Field& field : *fields)
      EXPECT_TRUE(field.type != NumberType::kDouble || unit_of(field.name).empty() == none.contains(field.name))
          << field.name;
}

TEST(RecordingExport, TakesOnlyStepsBetweenTheTimes) {
  const auto rows = exported_table("machine", {"--from", "0.5", "--to", "0.75"});
  ASSERT_EQ(rows.size(), 1 + 51U);
  EXPECT_EQ(rows[1][0], "0.5");
  EXPECT_EQ(rows.back()[0], "0.75");
  const auto all = exported_table("machine");
  EXPECT_EQ(rows[1], all[100]);
  const ProgramRun log = run_export({recorded_session().recording, "--candump", "-", "--from", "0.5", "--to", "0.75"});
  std::istringstream lines(log.out);
  const auto frames = test::read_candump(lines);
  ASSERT_FALSE(frames.empty());
  EXPECT_EQ(frames.front().at_s, 0.5);
  EXPECT_EQ(frames.back().at_s, 0.75);
}

// The session's own log is written where the frames pass on the bus; the recording has what the controller's end read
// and gave away, step by step. So what nodes sent is there in the order of the bus, up to the last step; what the
// controller sent is in the order in which it gave it away, while the bus lets the most urgent one pass first.
TEST(RecordingExport, CandumpHasTheFramesThatWereOnTheBus) {
  const ProgramRun run = run_export({recorded_session().recording, "--candump", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::istringstream exported_lines(run.out);
  std::ifstream bus_lines(recorded_session().candump);
  const auto exported = test::read_candump(exported_lines), bus = test::read_candump(bus_lines);
  ASSERT_GT(bus.size(), 3000U);
  constexpr double kStep_s = 0.005;
  const auto from_controller = [](unsigned id) {
    return id == 0 || id == 0x80 || id == 0x701 || (id >> 8 == 2) || (id >> 8 == 6);
  };
  std::vector<test::WireFrame> told, passed;  // of nodes
  std::map<unsigned, std::vector<test::WireFrame>> given, sent;
  for (const auto& frame : exported) (from_controller(frame.id) ? given[frame.id] : told).push_back(frame);
  for (const auto& frame : bus) (from_controller(frame.id) ? sent[frame.id] : passed).push_back(frame);
  ASSERT_LE(told.size(), passed.size());
  EXPECT_GE(told.size() + 20, passed.size());  // since the last step
  for (std::size_t i = 0; i < told.size(); ++i) {
    ASSERT_EQ(told[i].id, passed[i].id) << i;
    ASSERT_EQ(told[i].data, passed[i].data) << i;
    ASSERT_GE(told[i].at_s, passed[i].at_s) << i;
    ASSERT_LE(told[i].at_s, passed[i].at_s + kStep_s + 1e-9) << i;
  }
  ASSERT_EQ(given.size(), sent.size());
  for (const auto& [id, frames] : given) {
    ASSERT_GE(frames.size(), sent[id].size()) << id;
    ASSERT_LE(frames.size(), sent[id].size() + 1) << id;  // of the last step, not yet on the bus
    for (std::size_t i = 0; i < sent[id].size(); ++i) {
      ASSERT_EQ(frames[i].data, sent[id][i].data) << id;
      ASSERT_LE(frames[i].at_s, sent[id][i].at_s) << id;
    }
  }
}

TEST(RecordingExport, ModelAndBusAreThoseOfTheRecordedMachine) {
  const auto without_source = [](std::string text, const std::string& source) {
    for (std::size_t at = text.find(source); at != std::string::npos; at = text.find(source))
      text.erase(at, source.size());
    return text;
  };
  for (const char* option : {"--urdf", "--dbc"}) {
    const ProgramRun run = run_export({recorded_session().recording, option, "-"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_NE(run.out.find("session.mcap: machine.toml"), std::string::npos);
    EXPECT_EQ(without_source(run.out, "session.mcap: machine.toml"),
              without_source(run_export({"--machine", "solar015", option, "-"}).out, "solar015.toml"));
  }
}

/// Every dataset of both groups as a witness reads it, against the recording.
void expect_datasets(const std::vector<std::vector<std::string>>& lines, const std::string& group,
                     const std::vector<test::Numbers>& steps) {
  std::map<std::string, std::vector<double>> expected;
  for (const test::Numbers& step : steps) {
    for (auto [name, value] : step) {
      name = name.substr(0, name.find('['));
      if (const auto inner = name.find('.'); inner != std::string::npos)
        name = name.ends_with(".code") ? name.substr(0, inner) : name.replace(inner, 1, "_");
      expected[group + "/" + name].push_back(value);
      if (name == "time_ns") expected[group + "/time_s"].push_back(value / 1e9);
    }
  }
  std::size_t compared = 0;
  for (const auto& line : lines) {
    if (!line[0].starts_with(group + "/")) continue;
    ASSERT_TRUE(expected.contains(line[0])) << line[0];
    const std::vector<double>& values = expected[line[0]];
    ASSERT_EQ(line.size(), values.size() + 2) << line[0];
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_TRUE(same(std::stod(line[i + 2]), values[i])) << line[0] << " " << i;
    ++compared;
  }
  EXPECT_EQ(compared, expected.size());
  ::testing::Test::RecordProperty("numbers_of_" + group, std::to_string(steps.size() * steps.at(0).size()));
}

class Hdf5Export : public ::testing::Test {
 protected:
  void SetUp() override {
    const ProgramRun run =
        run_export({recorded_session().recording, "--hdf5", hdf5_, "--csv", csv_, "--side", "machine"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  void compare(const std::vector<std::vector<std::string>>& lines) {
    machine_ = test::recorded_steps<slave::SlaveState>(recorded_session().recording);
    expect_datasets(lines, "machine", machine_);
    expect_datasets(lines, "operator", test::recorded_steps<master::MasterState>(recorded_session().recording));
  }

  TemporaryFolder folder_;
  std::string hdf5_ = folder_.file("session.h5"), csv_ = folder_.file("machine.csv"), out_ = folder_.file("answer");
  std::vector<test::Numbers> machine_;
};

TEST_F(Hdf5Export, H5pyReadsEveryNumberAsRecorded) {
  const ProgramRun run = test::run_program("/usr/bin/python3", {test::source_dir() + "/tests/export/hdf5_witness.py",
                                                                hdf5_, out_});  // Debian's: its modules
  if (run.exit_code == 77 || run.exit_code == 127) GTEST_SKIP() << "NOT TESTED: python3-h5py is not installed";
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto lines = table(content(out_), '\t');
  compare(lines);
  std::map<std::string, std::string> second;
  for (const auto& line : lines) second[line.at(0)] = line.at(1);
  EXPECT_EQ(second["machine/pressure_Pa"], "Pa");
  EXPECT_EQ(second["machine/joint_radps"], "rad/s");
  EXPECT_EQ(second["machine/confidence"], "1");
  EXPECT_EQ(second["machine/mode"], "");
  EXPECT_EQ(second["files/machine_toml"], std::to_string(content(test::shipped_file("solar015")).size()));
}

TEST_F(Hdf5Export, OctaveReadsEveryNumberAsRecorded) {
  const ProgramRun run =
      test::run_program("octave", {"--no-gui", "--norc", "--quiet", "--path", test::source_dir() + "/tests/export",
                                   "--eval", "octave_witness('" + hdf5_ + "', '" + csv_ + "', '" + out_ + "')"});
  if (run.exit_code == 127) GTEST_SKIP() << "NOT TESTED: octave is not installed";
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto lines = table(content(out_), '\t');
  compare(lines);
  std::size_t column = 0;  // of the table, whose columns are in the order of the state's numbers
  for (const auto& line : lines) {
    if (!line[0].starts_with("csv/")) continue;
    const std::string field = machine_[0].at(column).first;
    ASSERT_EQ(line.size(), machine_.size() + 2) << line[0];
    for (std::size_t n = 0; n < machine_.size(); ++n) {
      const double number = std::stod(line[n + 2]), recorded = machine_[n][column].second;
      if (column == 0) {
        ASSERT_EQ(number, recorded / 1e9);
      } else if (is_float(field)) {
        ASSERT_EQ(static_cast<float>(number), static_cast<float>(recorded)) << line[0];
      } else if (field == "mode" || field == "contact_model" || field.ends_with(".code")) {
        ASSERT_TRUE(std::isnan(number)) << line[0];
      } else {
        ASSERT_TRUE(same(number, recorded)) << line[0] << " row " << n + 2;
      }
    }
    ++column;
  }
  EXPECT_EQ(column, machine_[0].size());
}

TEST(RecordingExport, AnInterruptLeavesNothing) {
  recording::Recording recording({recorded_session().recording});
  const TemporaryFolder folder;
  {
    cli::OutputFile hdf5("--hdf5", folder.file("a.h5")), csv("--csv", folder.file("a.csv"));
    int entries = 0;
    RecordingOutputs outputs;
    outputs.csv = &csv.stream();
    outputs.hdf5 = &hdf5;
    outputs.side = recording::Side::kMachine;
    outputs.check = [&entries] {
      if (++entries > 500) throw cli::Interrupted();
    };
    EXPECT_THROW(export_recording(recording, outputs), cli::Interrupted);
  }
  EXPECT_EQ(folder.count(), 0);
}

TEST(RecordingExport, RefusesWhatCannotBeMeant) {
  const std::string& file = recorded_session().recording;
  const TemporaryFolder folder;
  const std::string out = folder.file("out");
  expect_refused(
      {"--machine", "solar015"},
      "nothing to write: give --csv, --hdf5, --candump, --urdf or --dbc, each with FILE, or --pictures FOLDER "
      "(see knuckle export --help)");
  expect_refused({"--urdf", "-"}, "--urdf and --dbc need --machine NAME or a recording (.mcap)");
  expect_refused({file, "--csv", out}, "--csv: both sides are in " + file + ": give --side machine or --side operator");
  expect_refused({file, "--csv", out, "--side", "left"}, "--side left: must be machine or operator");
  expect_refused({file, "--hdf5", out, "--side", "machine"}, "--side machine: only goes with --csv");
  expect_refused({"--machine", "solar015", "--hdf5", out}, "--hdf5 " + out + ": needs a recording (.mcap)");
  expect_refused({file, "--machine", "solar015", "--urdf", out},
                 "--machine solar015: does not go with a recording, which has its own");
  expect_refused(
      {file, "--hdf5", "/dev/full"},
      "--hdf5 /dev/full: cannot be written: Operation not supported: HDF5 is not written in one stream, name a file");
  expect_refused({file, "--hdf5", "-"}, "--hdf5 -: must be a file: HDF5 is not written in one stream");
  expect_refused({file, "--urdf", out, "--from", "1"}, "--from: only goes with --csv, --hdf5, --candump or --pictures");
  expect_refused({file, "--candump", out, "--from", "2", "--to", "1"}, "--to: must not be before --from");
  expect_refused({file, "--candump", file}, "--candump " + file + ": already taken by the recording");
  expect_refused({file, "--candump", out, "--from", "50"},
                 "--candump: " + file + " has no CAN frame between 50 s and its end");
  expect_refused({file, "--csv", out, "--side", "machine", "--from", "50", "--to", "51.5"},
                 "--csv: " + file + " has no step of the machine's side between 50 s and 51.5 s");
  expect_refused({file, "--hdf5", out, "--from", "50"}, "--hdf5: " + file + " has no step between 50 s and its end");
  EXPECT_EQ(folder.count(), 0);
}

TEST(RecordingExport, LeavesNothingBehindWhereTheDiskRefuses) {
  const TemporaryFolder folder;
  const std::string out = folder.file("out");
  for (const std::string option : {"--hdf5", "--candump"}) {
    const ProgramRun run =
        test::run_program("/bin/sh", {"-c", "trap '' XFSZ; ulimit -f 8; exec \"$@\"", "sh", test::program("knuckle"),
                                      "export", recorded_session().recording, option, out});
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_EQ(run.err, "knuckle: " + option + " " + out + ": cannot be written: File too large\n");
    EXPECT_EQ(folder.count(), 0);
  }
}

TEST(RecordingExport, RefusesStatesOfAnotherVersion) {
  const TemporaryFolder folder;
  const std::string file = folder.file("other.mcap");
  {
    recording::Head head;
    head.has_machine = true;
    mcap::FileWriter writer;
    ASSERT_TRUE(writer.open(file, recording::topics()) && writer.note(recording::metadata_of(head)));
    mcap::ChunkBuilder chunk;
    const std::vector<std::uint8_t> longer(4000);
    chunk.add(recording::channel_of(recording::Topic::kMachineState), 0, 5'000'000, 5'000'000, longer);
    ASSERT_TRUE(writer.append(chunk.finish({})) && writer.close());
  }
  expect_refused({file, "--csv", "-"},
                 file + ": /machine/state at 0.005 s: is no state: damaged, or of another version (recorded by )");
}

}  // namespace
}  // namespace knuckle::exporting
