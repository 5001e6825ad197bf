// Recordings of tests/recordings_replayed: what the loops did when these were made, they do today, bit for bit.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "recording/replay.h"
#include "tests/recording/divergence.h"
#include "tests/support/places.h"

namespace knuckle::recording {
namespace {

class RegressionReplay : public testing::TestWithParam<const char*> {};

std::string folder() {
  return test::source_dir() + "/tests/recordings_replayed/";
}

TEST_P(RegressionReplay, DoesWhatIsRecordedBitForBit) {
  // Sine and cosine of glibc differ in their last bit between processors with fused multiply-add and those without.
  if (!__builtin_cpu_supports("fma") || !__builtin_cpu_supports("avx2"))
    GTEST_SKIP() << "NOT TESTED: replay to the last bit: it was recorded on a processor with FMA and AVX2";
  Recording recording({folder() + GetParam() + ".mcap"});
  const ReplayResult result = replay(recording, setup_of(recording));
  EXPECT_TRUE(recording.complete());
  EXPECT_TRUE(recording.damages().empty());
  EXPECT_GT(result.sides[static_cast<std::size_t>(Side::kMachine)].steps, 500u);
  EXPECT_TRUE(result.identical()) << test::words(result)
                                  << "where this was meant to change: scripts/regression-recordings";
}

INSTANTIATE_TEST_SUITE_P(Files, RegressionReplay, testing::Values("press", "lost_link", "load"),
                         [](const auto& file) { return std::string(file.param); });

TEST(RegressionReplays, AreAllTheFilesThatAreThere) {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder())) {
    if (entry.path().extension() == ".mcap") files.insert(entry.path().stem());
  }
  EXPECT_EQ(files, (std::set<std::string>{"load", "lost_link", "press"}));
}

}  // namespace
}  // namespace knuckle::recording
