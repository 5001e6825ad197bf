// What `knuckle export` writes: whole files or none, and nothing over what is there.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "recording/recorder.h"
#include "tests/export/machines.h"
#include "tests/export/recorded_session.h"
#include "tests/export/run_export.h"
#include "tests/support/says.h"

namespace knuckle::exporting {
namespace {

using test::content;
using test::expect_refused;
using test::ProgramRun;
using test::run_export;
using test::TemporaryFolder;

TEST(ExportCommand, WritesWhatIsAskedForAndSaysSo) {
  const TemporaryFolder folder;
  const std::string urdf = folder.file("arm.urdf"), dbc = folder.file("new/bus.dbc");
  const ProgramRun run = run_export({"--machine", "solar015", "--urdf", urdf, "--dbc", dbc});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  for (const std::string& file : {urdf, dbc}) {
    EXPECT_TRUE(test::says(run.out, "written: " + file + ": "));
    EXPECT_TRUE(test::says(run.out, std::to_string(content(file).size()) + " bytes\n"));
  }
  EXPECT_TRUE(content(urdf).ends_with("</robot>\n"));
  EXPECT_TRUE(test::says(content(dbc), "BO_ 128 SYNC: 0 controller"));
  EXPECT_EQ(run_export({"--machine", "solar015", "--urdf", "-"}).out, content(urdf));
}

TEST(ExportCommand, WritesEachRecordedPictureIntoItsFolderAndNowhereElse) {
  const TemporaryFolder folder;
  const std::string file = folder.file("session.mcap"), into = folder.file("new/pictures");
  {
    recording::RecorderOptions how;
    how.file = file;
    recording::Recorder recorder(how, {}, test::shipped("solar015"));
    recorder.camera(recording::CameraPicture{Time(12'345ms), "mast", {1, 2, 3}});
    recorder.camera(recording::CameraPicture{Time(13s), "../../x", {4}});
  }
  const ProgramRun run = run_export({file, "--pictures", into});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(content(into + "/mast_000012.345.jpg"), "\1\2\3");
  EXPECT_EQ(content(into + "/______x_000013.000.jpg"), "\4");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(into), {}), 2);
  EXPECT_TRUE(test::says(run_export({file, "--pictures", into, "--from", "14"}).err,
                         file + " has no picture of a camera between 14 s and its end\n"));
}

TEST(ExportCommand, FailsAsExplainDoesOfADamagedRecordingAndShowsWhatCouldBeRead) {
  const TemporaryFolder folder;
  const std::string file = folder.file("session.mcap"), csv = folder.file("machine.csv"),
                    whole = test::recorded_session().recording;
  std::string damaged = content(whole);
  damaged[damaged.size() / 2] ^= 1;
  std::ofstream(file, std::ios::binary) << damaged;
  const ProgramRun exported = run_export({file, "--csv", csv, "--side", "machine"}),
                   explained = test::run_program(test::program("knuckle"), {"explain", file});
  EXPECT_EQ(exported.exit_code, 1) << exported.err;
  EXPECT_GT(content(csv).size(), 1000U);
  EXPECT_EQ(explained.exit_code, 1) << explained.err;
  EXPECT_NE(explained.out, "");
  EXPECT_EQ(test::run_program(test::program("knuckle"), {"explain", whole}).exit_code, 0) << "nothing is damaged";
}

TEST(ExportCommand, OverwritesNoInputAndNoOtherOutput) {
  const TemporaryFolder folder;
  const std::string machine = folder.file("machine.txt"), file = folder.file("out");
  std::filesystem::copy_file(test::shipped_file("solar015"), machine);
  const std::string before = content(machine);
  expect_refused({"--machine", machine, "--dbc", machine}, "--dbc " + machine + ": already taken by --machine");
  EXPECT_EQ(content(machine), before);
  expect_refused({"--machine", machine, "--urdf", file, "--dbc", file}, "--dbc " + file + ": already taken by --urdf");
  expect_refused({"--machine", machine, "--urdf", folder.file("other.toml")},
                 "--urdf " + folder.file("other.toml") +
                     ": is named like a machine or other configuration file: choose another name");
  EXPECT_EQ(folder.count(), 1);
}

TEST(ExportCommand, LeavesNothingBehindWhereAnOutputOrAMachineFileIsRefused) {
  const TemporaryFolder folder;
  const std::string plain = folder.file("plain"), machine = folder.file("machine.toml"), urdf = folder.file("arm.urdf");
  std::ofstream(plain) << "no folder";
  std::ofstream(machine) << content(test::shipped_file("solar015")) << "\n[colour]\n";
  for (const ProgramRun& run : {run_export({"--machine", "solar015", "--urdf", urdf, "--dbc", plain + "/bus.dbc"}),
                                run_export({"--machine", machine, "--urdf", urdf})}) {
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  }
  EXPECT_EQ(folder.count(), 2);
}

}  // namespace
}  // namespace knuckle::exporting
