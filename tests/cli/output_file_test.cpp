// An output is complete or not there.
#include "app/cli/output_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>

#include "app/cli/interrupt.h"
#include "core/error.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/forget_interrupts.h"
#include "tests/support/stalled_pipe.h"
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

TEST(OutputFile, KeepsTheModeOfTheFileItReplaces) {
  const Folder folder;
  const std::string target = folder.file("mine.toml");
  std::ofstream(target) << "old";
  for (const mode_t mode : {0640U, 0600U, 0664U}) {
    ASSERT_EQ(chmod(target.c_str(), mode), 0);
    OutputFile out("--out", target);
    out.stream() << mode;
    out.commit();
    struct stat now {};
    ASSERT_EQ(stat(target.c_str(), &now), 0);
    EXPECT_EQ(now.st_mode & 07777U, mode);
  }
}

TEST(OutputFile, KeepsTheOlderFileOnlyWhereANewOneTakesItsPlace) {
  const Folder folder;
  const std::string target = folder.file("mine.toml"), kept = folder.file("mine.1.toml");
  const auto write = [&target](const std::string& text) {
    OutputFile out("--out", target);
    out.stream() << text;
    return out.commit_keeping_older();
  };
  EXPECT_EQ(write("old"), "") << "there was none";
  EXPECT_EQ(write("old"), "") << "nothing changed";
  EXPECT_EQ(folder.count(), 1);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  {
    const test::FileSizeLimit little(3);
    EXPECT_THROW(write("newer"), InputError);
  }
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(content(target), "old");
  EXPECT_EQ(folder.count(), 1) << "a write that failed leaves no copy";
  EXPECT_EQ(write("new"), std::filesystem::canonical(folder.path()) / "mine.1.toml");
  EXPECT_EQ(content(target), "new");
  EXPECT_EQ(content(kept), "old");
}

TEST(OutputFile, StopsWaitingForAPipesReaderWhenTold) {
  const Folder folder;
  const std::string pipe = folder.file("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const test::ForgetInterrupts afterwards;
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

TEST(OutputFile, HasLostNothingWhereTheReaderOfAPipeReadsNoMore) {
  const InterruptGuard pipes_only_fail;
  test::StalledPipe pipe;
  pipe.leave();
  const int before = dup(STDOUT_FILENO);
  dup2(pipe.writing_end(), STDOUT_FILENO);
  OutputFile out("--csv", "-");
  out.stream() << std::string(100'000, 'x');
  EXPECT_NO_THROW(out.commit());
  dup2(before, STDOUT_FILENO);
  close(before);
}

TEST(OutputFile, WritesToDevicesInPlace) {
  OutputFile out("--csv", "/dev/null");
  out.stream() << "x";
  out.commit();
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace knuckle::cli
