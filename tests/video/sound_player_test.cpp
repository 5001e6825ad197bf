// A sound reaches its sink as it was given, and a sink that cannot play is told in one line.
#include "video/sound_player.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "core/time.h"
#include "tests/support/temporary_folder.h"
#include "tests/video/patience.h"

namespace knuckle::video {
namespace {

std::vector<std::int16_t> ramp(int count) {
  std::vector<std::int16_t> samples;
  for (int i = 0; i < count; ++i) samples.push_back(static_cast<std::int16_t>(i % 1000));
  return samples;
}

TEST(SoundPlayer, PlaysWhatItIsGiven) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("sound.raw");
  const std::vector<std::int16_t> given = ramp(4800);
  SoundPlayer player("audio/x-raw,format=S16LE,rate=48000,channels=1 ! filesink location=" + file);
  player.play(given);
  const auto size = [&file] {
    std::error_code none;
    const auto bytes = std::filesystem::file_size(file, none);
    return none ? 0 : bytes;
  };
  ASSERT_TRUE(comes([&] { return size() == 2 * given.size(); })) << player.problem();
  std::ifstream in(file, std::ios::binary);
  std::vector<std::int16_t> played(given.size());
  in.read(reinterpret_cast<char*>(played.data()), static_cast<std::streamsize>(2 * played.size()));
  EXPECT_EQ(played, given);
  EXPECT_EQ(player.problem(), "");
}

TEST(SoundPlayer, SaysInOneLineBeforeTheFirstAlarmWhyNothingCanBeHeard) {
  for (const auto& [sink, played] : {std::pair{"nosuchsink", 0}, {"filesink location=/no/such/folder/x", 100}}) {
    SoundPlayer player(sink);
    if (played > 0) player.play(ramp(played));
    EXPECT_TRUE(comes([&player] { return !player.problem().empty(); })) << sink;
    EXPECT_EQ(player.problem().find('\n'), std::string::npos) << player.problem();
  }
}

TEST(SoundPlayer, EndsWhileASoundIsBeingPlayed) {
  constexpr int kSound_s = 60;
  const auto begin = std::chrono::steady_clock::now();
  {
    SoundPlayer player("fakesink sync=true");
    player.play(ramp(kSound_s * SoundPlayer::kRate_Hz));
    std::this_thread::sleep_for(50ms);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(kSound_s / 2)) << "it waited for the sound";
}

}  // namespace
}  // namespace knuckle::video
