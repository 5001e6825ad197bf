// Cameras made of GStreamer's own test pictures, and ones that fail. Not for ThreadSanitizer, which does not see GLib's
// locks.
#include "video/camera.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"
#include "tests/video/patience.h"

namespace knuckle::video {
namespace {

TEST(CameraOfGStreamer, GivesThePictureAsRedGreenBlue) {
  Camera camera({"front", "videotestsrc is-live=true pattern=red ! video/x-raw,width=64,height=32,framerate=30/1"});
  const auto frame = next_frame(camera);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->width_px, 64);
  EXPECT_EQ(frame->height_px, 32);
  EXPECT_GE(frame->row_bytes, 4 * 64);
  const std::uint8_t* last = frame->pixels + 31 * frame->row_bytes + 4 * 63;
  EXPECT_GT(last[0], 230);
  EXPECT_LT(last[1], 20);
  EXPECT_LT(last[2], 20);
}

TEST(CameraOfGStreamer, KeepsTheNewestPictureAloneAndNeverAQueue) {
  Camera camera({"front", "videotestsrc is-live=true ! video/x-raw,width=64,height=32,framerate=100/1"});
  const auto first = next_frame(camera);
  ASSERT_NE(first, nullptr);
  std::unique_ptr<Frame> later;
  ASSERT_TRUE(comes([&camera] { return camera.status().playing; }));
  std::this_thread::sleep_for(300ms);
  later = next_frame(camera);
  ASSERT_NE(later, nullptr);
  EXPECT_GT(later->number, first->number + 2) << "pictures that nobody took are gone";
  const auto after = next_frame(camera);
  ASSERT_NE(after, nullptr);
  EXPECT_GT(after->received, later->received);
}

TEST(CameraOfGStreamer, StampsAPictureByItsCaptureNotByItsArrival) {
  Camera camera({"front",
                 "videotestsrc is-live=true ! video/x-raw,width=64,height=32,framerate=5/1 ! identity "
                 "sleep-time=120000"});
  for (int i = 0; i < 3; ++i) {
    const auto frame = next_frame(camera);
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->stamp_from, StampFrom::kHere);
    EXPECT_GE(to_seconds(frame->received - frame->captured), 0.12);
  }
}

TEST(CameraOfGStreamer, GivesALivePictureAtOnceAndNeverWaitsForWhenItWouldBeDue) {
  Camera camera({"front",
                 "videotestsrc is-live=true ! video/x-raw,format=I420,width=64,height=32,framerate=30/1 ! rtpvrawpay ! "
                 "rtpjitterbuffer latency=0 ts-offset=2000000000 ! rtpvrawdepay"});
  for (int i = 0; i < 6; ++i) {
    const auto frame = next_frame(camera);
    ASSERT_NE(frame, nullptr);
    EXPECT_LT(frame->received, frame->captured) << "due in two seconds";
  }
}

TEST(CameraOfGStreamer, PlaysAFileAtItsOwnPaceAndConnectsAgainByItself) {
  Camera camera({"front", "videotestsrc num-buffers=4 ! video/x-raw,width=64,height=32,framerate=10/1"});
  Time last = now(), first = kNever;
  std::uint64_t number = 0;
  ASSERT_TRUE(comes([&] {
    if (const auto frame = camera.take(); frame && frame->connection == 1) {
      if (first == kNever) first = frame->received;
      last = frame->received;
      number = frame->number;
    }
    return camera.status().troubles > 0;
  }));
  EXPECT_EQ(number, 4u);
  EXPECT_GT(to_seconds(last - first), 0.15);
  EXPECT_STREQ(camera.status().why.data(), "camera front: the stream has ended; connecting again");
  EXPECT_TRUE(comes([&] {
    const auto frame = camera.take();
    return frame && frame->connection >= 2;
  }));
}

TEST(CameraOfGStreamer, SaysWhatIsWrongWithItsSource) {
  const test::TemporaryFolder folder;
  const std::string words = folder.file("words");
  std::ofstream(words) << std::string(20'000, 'x');
  for (const auto& [source, said] : std::vector<std::pair<std::string, std::string>>{
           {"v4l2src device=/dev/video97", "/dev/video97"},
           {"v4l2src device=/dev/video97", "Check that the camera is there"},
           {"rtsp://127.0.0.1:9/nothing", "and the network; connecting again"},
           {"filesrc location=" + words + " ! h264parse ! avdec_h264", "codec"}}) {
    Camera camera({"front", source});
    EXPECT_TRUE(comes([&camera] { return camera.status().troubles > 0; })) << source;
    EXPECT_TRUE(test::begins(camera.status().why.data(), "camera front: "));
    EXPECT_TRUE(test::says(camera.status().why.data(), said));
  }
}

TEST(CameraOfGStreamer, EndsWhileItConnects) {
  const Camera camera({"front", "udpsrc port=0 ! application/x-rtp,encoding-name=H264 ! rtph264depay ! avdec_h264"});
}

}  // namespace
}  // namespace knuckle::video
