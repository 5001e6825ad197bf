// Whatever an option names for writing, its folder is made where it is missing; where that cannot be, one line says so.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::test {
namespace {

struct Writer {
  std::vector<std::string> command;
  std::vector<std::pair<std::string, std::string>> outputs;  ///< Options, and the names of what they write.
};

class OutputFolders : public testing::Test {
 protected:
  OutputFolders() {
    const std::string recording = folder_.file("there.mcap");
    const std::vector<std::string> session{"simulate", "--scenario", "free_motion", "--duration", "0.5"};
    (void)run({session, {}}, {"--log", recording});
    writers_ = {
        {session,
         {{"--csv", "a.csv"},
          {"--json", "a.json"},
          {"--report", "a.html"},
          {"--candump", "a.log"},
          {"--log", "a.mcap"},
          {"--flights", "flights"}}},
        {{"export", "--machine", "solar015"}, {{"--urdf", "a.urdf"}, {"--dbc", "a.dbc"}}},
        {{"export", recording, "--side", "machine"}, {{"--csv", "a.csv"}}},
        {{"export", recording}, {{"--hdf5", "a.h5"}, {"--candump", "a.log"}}},
        {{"explain", recording}, {{"--json", "a.json"}}},
        {{"doctor"}, {{"--json", "a.json"}}},
        {{"pair"}, {{"--keys", "keys"}}},
        {{"device"}, {{"--descriptor", "a.bin"}}},
        {{"slave", "--simulate", "--listen", "127.0.0.1:0", "--insecure", "--duration", "0.1"},
         {{"--csv", "a.csv"}, {"--json", "a.json"}, {"--candump", "a.log"}, {"--log", "log"}, {"--audit", "audit"}}},
        {{"master", "--machine", "solar015", "--device", "none", "--connect", "127.0.0.1:9", "--insecure", "--duration",
          "0.1"},
         {{"--csv", "a.csv"}, {"--json", "a.json"}, {"--log", "log"}}},
    };
  }
  static ProgramRun run(const Writer& writer, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = writer.command;
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(program("knuckle"), arguments);
  }

  TemporaryFolder folder_;
  std::vector<Writer> writers_;
};

TEST_F(OutputFolders, ThatAreMissingAreMade) {
  for (const Writer& writer : writers_) {
    std::vector<std::string> options;
    for (const auto& [option, name] : writer.outputs) {
      const std::string place = folder_.file(writer.command.front() + option + "/missing/" + name);
      std::filesystem::remove_all(folder_.file(writer.command.front() + option));
      options.insert(options.end(), {option, place});
    }
    const ProgramRun ran = run(writer, options);
    EXPECT_NE(ran.exit_code, 2) << ran.err;
    for (std::size_t i = 1; i < options.size(); i += 2)
      EXPECT_TRUE(std::filesystem::exists(options[i])) << writer.command.front() << ' ' << options[i - 1] << ran.err;
  }
}

/// What writes other than by OutputFile, and one that does.
TEST_F(OutputFolders, ThatCannotBeMadeAreRefusedInOneLine) {
  const std::string file = folder_.file("file");
  std::ofstream(file) << "mine";
  int refused = 0;
  for (const Writer& writer : writers_) {
    for (const auto& [option, name] : writer.outputs) {
      const bool own_way = option == "--log" || option == "--flights" || option == "--audit" || option == "--keys" ||
                           option == "--hdf5" || option == "--descriptor";
      if (!own_way) continue;
      ++refused;
      const std::string place = file + "/below/" + name;
      const ProgramRun ran = run(writer, {option, place});
      EXPECT_EQ(ran.exit_code, 2) << writer.command.front() << ' ' << option;
      const std::string named = option == "--keys" ? "" : option + " ";  // the folder may also be the usual one
      EXPECT_EQ(ran.err, "knuckle: " + named + place + ": cannot be written: Not a directory\n");
    }
  }
  EXPECT_EQ(refused, 8);
  EXPECT_EQ(content(file), "mine");
}

}  // namespace
}  // namespace knuckle::test
