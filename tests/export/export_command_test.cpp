// `knuckle export` as a user runs it: whole files or none, and one line for what it refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "recording/recorder.h"
#include "tests/export/machines.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::exporting {
namespace {

using test::content;
using test::ProgramRun;
using test::TemporaryFolder;

ProgramRun run_export(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "export");
  return test::run_program(test::program("knuckle"), std::move(arguments));
}

void expect_refused(const ProgramRun& run, const std::string& line) {
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(run.err, "knuckle: " + line + "\n");
}

TEST(ExportCommand, WritesWhatIsAskedForAndSaysSo) {
  const TemporaryFolder folder;
  const std::string urdf = folder.file("arm.urdf"), dbc = folder.file("new/bus.dbc");
  const ProgramRun run = run_export({"--machine", "solar015", "--urdf", urdf, "--dbc", dbc});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const auto bytes = [](const std::string& file) { return std::to_string(content(file).size()) + " bytes\n"; };
  EXPECT_EQ(run.out, "written: " + urdf + ": the arm as URDF, " + bytes(urdf) + "written: " + dbc +
                         ": the CAN bus as DBC, " + bytes(dbc));
  EXPECT_TRUE(content(urdf).ends_with("</robot>\n"));
  EXPECT_NE(content(dbc).find("BO_ 128 SYNC: 0 controller"), std::string::npos);
  EXPECT_EQ(run_export({"--machine", "solar015", "--urdf", "-"}).out, content(urdf));
}

TEST(ExportCommand, NeedsAMachineAndAnOutput) {
  expect_refused(
      run_export({"--machine", "solar015"}),
      "nothing to write: give --csv, --hdf5, --candump, --urdf or --dbc, each with FILE, or --pictures FOLDER "
      "(see knuckle export --help)");
  expect_refused(run_export({"--urdf", "-"}), "--urdf and --dbc need --machine NAME or a recording (.mcap)");
}

TEST(ExportCommand, WritesEachRecordedPictureIntoItsFolderAndNowhereElse) {
  const TemporaryFolder folder;
  const std::string file = folder.file("session.mcap"), into = folder.file("new/pictures");
  {
    recording::RecorderOptions how;
    how.file = file;
    recording::Recorder recorder(how, {}, load_machine(test::machine_file("solar015")));
    recorder.camera(recording::CameraPicture{Time(12'345ms), "mast", {1, 2, 3}});
    recorder.camera(recording::CameraPicture{Time(13s), "../../x", {4}});
  }
  const ProgramRun run = run_export({file, "--pictures", into});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(content(into + "/mast_000012.345.jpg"), "\1\2\3");
  EXPECT_EQ(content(into + "/______x_000013.000.jpg"), "\4");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(into), {}), 2);
  EXPECT_EQ(run_export({file, "--pictures", into, "--from", "14"}).err,
            "knuckle: --pictures: " + file + " has no picture of a camera between 14 s and its end\n");
}

TEST(ExportCommand, FailsAsExplainDoesOfADamagedRecordingAndShowsWhatCouldBeRead) {
  const TemporaryFolder folder;
  const std::string file = folder.file("session.mcap"), csv = folder.file("machine.csv");
  const auto run = [](const std::vector<std::string>& all) { return test::run_program(test::program("knuckle"), all); };
  ASSERT_EQ(run({"simulate", "--scenario", "free_motion", "--duration", "3", "--log", file}).exit_code, 0);
  const auto expect = [&](int code) {
    const ProgramRun exported = run_export({file, "--csv", csv, "--side", "machine"}),
                     explained = run({"explain", file});
    EXPECT_EQ(exported.exit_code, code) << exported.err;
    EXPECT_GT(content(csv).size(), 1000U);
    EXPECT_EQ(explained.exit_code, code) << explained.err;
    EXPECT_NE(explained.out, "");
  };
  expect(0);
  std::string damaged = content(file);
  damaged[damaged.size() / 2] ^= 1;
  std::ofstream(file, std::ios::binary) << damaged;
  expect(1);
}

TEST(ExportCommand, OverwritesNoInputAndNoOtherOutput) {
  const TemporaryFolder folder;
  const std::string machine = folder.file("machine.txt"), file = folder.file("out");
  std::filesystem::copy_file(test::machine_file("solar015"), machine);
  const std::string before = content(machine);
  expect_refused(run_export({"--machine", machine, "--dbc", machine}),
                 "--dbc " + machine + ": already taken by --machine");
  EXPECT_EQ(content(machine), before);
  expect_refused(run_export({"--machine", machine, "--urdf", file, "--dbc", file}),
                 "--dbc " + file + ": already taken by --urdf");
  expect_refused(run_export({"--machine", machine, "--urdf", folder.file("other.toml")}),
                 "--urdf " + folder.file("other.toml") +
                     ": is named like a machine or other configuration file: choose another name");
  EXPECT_EQ(folder.count(), 1);
}

TEST(ExportCommand, LeavesNothingBehindWhereAnOutputCannotBeWritten) {
  const TemporaryFolder folder;
  const std::string plain = folder.file("plain");
  std::ofstream(plain) << "no folder";
  const ProgramRun run =
      run_export({"--machine", "solar015", "--urdf", folder.file("arm.urdf"), "--dbc", plain + "/bus.dbc"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_EQ(folder.count(), 1);
}

TEST(ExportCommand, LeavesNothingBehindOfAMachineFileThatIsRefused) {
  const TemporaryFolder folder;
  const std::string machine = folder.file("machine.toml");
  std::ofstream(machine) << content(test::machine_file("solar015")) << "\n[colour]\n";
  const ProgramRun run = run_export({"--machine", machine, "--urdf", folder.file("arm.urdf")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_NE(run.err.find("colour"), std::string::npos) << run.err;
  EXPECT_EQ(folder.count(), 1);
}

}  // namespace
}  // namespace knuckle::exporting
