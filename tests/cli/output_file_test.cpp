// An output is complete or not there.
#include "app/cli/output_file.h"

#include <gtest/gtest.h>

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
  EXPECT_THROW(OutputFile("--csv", folder.file("missing/x.csv")), InputError);
  EXPECT_THROW(OutputFile("--csv", folder.file("")), InputError);
  EXPECT_EQ(folder.count(), 0);
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
