// Which pictures of cameras are recorded: as many a second as were asked for, of each camera, with their own time.
#include <gtest/gtest.h>

#include "app/console/console_log.h"
#include "tests/video/patience.h"

namespace knuckle::console {
namespace {

video::Frame grey(Time received) {
  const auto pixels = std::make_shared<std::vector<std::uint8_t>>(4 * 64 * 48, std::uint8_t{128});
  video::Frame frame;
  frame.width_px = 64;
  frame.height_px = 48;
  frame.row_bytes = 4 * 64;
  frame.pixels = pixels->data();
  frame.memory = pixels;
  frame.received = received;
  return frame;
}

/// Shown one after the other, 30 a second, each long after the one before was made.
/// @param paused session time stands still. @param most so many are made: then none is waited for.
std::vector<PictureLog::Made> shown(PictureLog& log, const std::string& camera, int count, std::size_t most,
                                    bool paused = false) {
  std::vector<PictureLog::Made> all;
  Time due = Time(100s);
  for (int i = 0; i < count; ++i) {
    const Time at = Time(100s) + i * 33ms;
    recording::CameraStamp stamp;
    stamp.camera = camera;
    stamp.at = paused ? Time(10s) : at - 90s;
    log.show(3, stamp, grey(at));
    const auto take = [&] {
      auto made = log.made();
      all.insert(all.end(), made.begin(), made.end());
      return !made.empty();
    };
    const bool waits = at >= due && all.size() < most;
    for (int tries = waits ? 60'000 : 1; tries > 0 && !take(); --tries) std::this_thread::sleep_for(1ms);
    if (waits) due = at + 200ms;
  }
  return all;
}

TEST(PictureLog, RecordsSoManyASecondOfEachCameraWithTheTimeTheyWereShown) {
  PictureLog log(5);
  for (const char* camera : {"mast", "front"}) {
    const auto made = shown(log, camera, 31, 6);  // one second
    ASSERT_GE(made.size(), 4u);
    EXPECT_LE(made.size(), 6u);
    EXPECT_EQ(made[0].run, 3u);
    EXPECT_EQ(made[0].picture.camera, camera);
    EXPECT_EQ(made[0].picture.at, Time(10s));
    for (std::size_t i = 1; i < made.size(); ++i) EXPECT_GE(made[i].picture.at - made[i - 1].picture.at, 200ms - 33ms);
  }
  EXPECT_TRUE(log.problems().empty());
}

TEST(PictureLog, RecordsOneWhileASessionIsPaused) {
  PictureLog log(5);
  EXPECT_EQ(shown(log, "mast", 31, 1, true).size(), 1u);
}

TEST(PictureLog, RecordsNoneWhereNoneWereAskedFor) {
  PictureLog log(0);
  EXPECT_TRUE(shown(log, "mast", 31, 0).empty());
}

}  // namespace
}  // namespace knuckle::console
