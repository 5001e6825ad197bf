// The virtual lab on a computer that cannot have it.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/support/places.h"
#include "tests/support/run_program.h"

namespace knuckle::test {
namespace {
namespace fs = std::filesystem;

TEST(VirtualLab, WithoutQemuIsSkippedWithALoudLine) {
  std::string folder = (fs::temp_directory_path() / "knuckle_no_qemu_XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  for (const char* tool : {"bash", "dirname", "basename"})
    fs::create_symlink(fs::path("/usr/bin") / tool, fs::path(folder) / tool);
  const ProgramRun run = run_program("/bin/sh", {"-c", "PATH=" + folder + " exec " + test::source_dir() +
                                                           "/scripts/lab slave " + test::program("knuckle")});
  fs::remove_all(folder);
  EXPECT_EQ(run.exit_code, 77) << run.out << run.err;  // tests/CMakeLists.txt: skipped, not passed
  EXPECT_EQ(run.err,
            "lab: SKIPPED, no virtual hardware was tested: qemu-system-x86_64 is not installed (scripts/setup installs "
            "it)\n");
}

}  // namespace
}  // namespace knuckle::test
