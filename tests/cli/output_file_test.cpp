// An output is complete or not there.
#include "app/cli/output_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>

#include "app/cli/interrupt.h"
#include "core/error.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::cli {
namespace {

using test::content;
using Folder = test::TemporaryFolder;

TEST(OutputFile, LeavesTheOldFileUntilCommitted) {
  const Folder folder;
  const std::string target = folder.file("result.json");
  std::ofstream(target) << "old";
  {
    OutputFile out("--json", target);
    out.stream() << "half";
  }
  EXPECT_EQ(content(target), "old");
  EXPECT_EQ(folder.count(), 1);
  OutputFile out("--json", target);
  out.stream() << "new";
  EXPECT_EQ(content(target), "old");
  out.commit();
  EXPECT_EQ(content(target), "new");
  EXPECT_EQ(folder.count(), 1);
}

TEST(OutputFile, RefusesWhatCannotBeWrittenBeforeAnythingIs) {
  const Folder folder;
  std::ofstream(folder.file("file")) << "no folder";
  EXPECT_THROW(OutputFile("--csv", folder.file("file/x.csv")), InputError);
  EXPECT_THROW(OutputFile("--csv", folder.file("file/deeper/x.csv")), InputError);
  EXPECT_THROW(OutputFile("--csv", folder.file("missing/")), InputError);
  EXPECT_THROW(OutputFile("--csv", folder.file("")), InputError);
  EXPECT_EQ(folder.count(), 1);
}

TEST(OutputFile, MakesTheFolderItIsToBeIn) {
  const Folder folder;
  const std::string target = folder.file("out/today/wall.html");
  {
    OutputFile out("--report", target);
    out.stream() << "half";
  }
  EXPECT_EQ(folder.count(), 0) << "nothing is left of what was not finished";
  OutputFile out("--report", target);
  out.stream() << "whole";
  out.commit();
  EXPECT_EQ(content(target), "whole");
}

TEST(OutputFile, KeepsTheWholeLinesOfWhatTheDiskTook) {
  const Folder folder;
  const std::string target = folder.file("bus.log");
  for (const std::string& half : {std::string("half"), std::string(10'000, 'x')}) {
    OutputFile out("--candump", target);
    out.stream() << "one\ntwo\n" << half << std::flush;
    out.commit_whole_lines();
    EXPECT_EQ(content(target), "one\ntwo\n");
  }
  OutputFile out("--candump", target);
  out.stream() << "no line" << std::flush;
  out.commit_whole_lines();
  EXPECT_EQ(content(target), "");
}

TEST(OutputFile, StopsWaitingForAPipesReaderWhenTold) {
  const Folder folder;
  const std::string pipe = folder.file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const InterruptGuard guard;
  std::raise(SIGTERM);
  EXPECT_THROW(OutputFile("--csv", pipe), Interrupted);
}

TEST(OutputFile, SaysWhyTheDiskRefusesHoweverMuchIsWritten) {
  for (const std::size_t size : {1UL, 100'000UL}) {
    OutputFile out("--candump", "/dev/full");
    out.stream() << std::string(size, 'x');
    try {
      out.commit();
      ADD_FAILURE() << size;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()), "--candump /dev/full: cannot be written: No space left on device");
    }
  }
}

TEST(OutputFile, WritesToDevicesInPlace) {
  OutputFile out("--csv", "/dev/null");
  out.stream() << "x";
  out.commit();
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace knuckle::cli
