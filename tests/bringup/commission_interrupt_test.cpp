// Ctrl+C of `knuckle commission`: as the program that is shipped, on the simulated machine.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/bringup/commission_script.h"
#include "tests/support/places.h"
#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
namespace fs = std::filesystem;
using namespace std::chrono_literals;

TEST(InterruptedCommission, LeavesNothingHalfWrittenAndProgressToGoOnFrom) {
  const knuckle::test::TemporaryFolder folder;
  const std::string fifo = folder.file("typed"), said = folder.file("said"), out = folder.file("found.toml"),
                    log = folder.file("log");
  fs::create_directory(log);
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const std::string command = "exec " + knuckle::test::program("knuckle") +
                              " commission --simulate --machine solar015 --seed 7 --out " + out + " --record " +
                              folder.path().string();
  knuckle::test::RunningProgram commission("/bin/sh", {"-c", command + " --log " + log + " < " + fifo + " > " + said});
  std::ofstream typed(fifo);  // stays open: it waits for the next word
  for (const std::string& word : test::first_words(test::kStroked)) typed << word << std::endl;
  const auto has_said = [&] { return knuckle::test::content(said).find("\n6. ") != std::string::npos; };
  for (int i = 0; i < 6000 && !has_said(); ++i) std::this_thread::sleep_for(10ms);
  ASSERT_TRUE(has_said()) << knuckle::test::content(said);
  commission.signal(SIGINT);
  ASSERT_TRUE(commission.ends_within(60s));
  const knuckle::test::ProgramRun ended = commission.wait();
  EXPECT_EQ(ended.exit_code, 130);
  EXPECT_TRUE(says(ended.err, "interrupted; nothing was written to " + out));
  EXPECT_TRUE(says(ended.err, "steps up to 5 are kept in " + out + ".progress"));
  EXPECT_TRUE(fs::exists(out + ".progress"));
  EXPECT_FALSE(fs::exists(out));
  for (const auto& file : fs::recursive_directory_iterator(folder.path()))
    EXPECT_FALSE(says(file.path().string(), ".partial"));
  const auto resumed = knuckle::test::run_program("/bin/sh", {"-c", command + " --resume < /dev/null"});
  EXPECT_TRUE(says(resumed.out, "Goes on after step 5 of the run before")) << resumed.err;
}

}  // namespace
}  // namespace knuckle::bringup
