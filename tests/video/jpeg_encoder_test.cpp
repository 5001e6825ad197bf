// Pictures as JPEG: what comes out is the picture, of whatever size, one at a time.
#include "video/jpeg_encoder.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"
#include "tests/video/patience.h"
#include "video/camera.h"

namespace knuckle::video {
namespace {

/// Left half red, right half blue.
Frame halves(int width_px, int height_px) {
  const auto pixels = std::make_shared<std::vector<std::uint8_t>>(static_cast<std::size_t>(4 * width_px * height_px));
  for (std::size_t i = 0; i < pixels->size() / 4; ++i)
    (*pixels)[4 * i + (static_cast<int>(i) % width_px < width_px / 2 ? 0 : 2)] = 255;
  Frame frame;
  frame.width_px = width_px;
  frame.height_px = height_px;
  frame.row_bytes = 4 * width_px;
  frame.pixels = pixels->data();
  frame.memory = pixels;
  return frame;
}

std::vector<std::uint8_t> made(JpegEncoder& encoder) {
  std::vector<std::uint8_t> jpeg;
  EXPECT_TRUE(comes([&] { return !(jpeg = encoder.take()).empty(); })) << encoder.problem();
  return jpeg;
}

TEST(JpegEncoder, MakesThePictureThatWasGivenOfAnySize) {
  const test::TemporaryFolder folder;
  JpegEncoder encoder;
  for (const auto& [width_px, height_px] : {std::pair{320, 180}, std::pair{320, 180}, std::pair{639, 361}}) {
    encoder.give(halves(width_px, height_px));
    const std::vector<std::uint8_t> jpeg = made(encoder);
    ASSERT_GT(jpeg.size(), 4u);
    const std::string file = folder.file("picture.jpg");
    std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(jpeg.data()), std::ssize(jpeg));
    Camera camera({"file", "filesrc location=" + file + " ! jpegdec"});
    const auto frame = next_frame(camera);
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->width_px, width_px);
    EXPECT_EQ(frame->height_px, height_px);
    const auto at = [&](int x, int channel) {
      return int{frame->pixels[frame->row_bytes * (height_px / 2) + 4 * x + channel]};
    };
    EXPECT_NEAR(at(width_px / 4, 0), 255, 8);
    EXPECT_NEAR(at(width_px / 4, 2), 0, 8);
    EXPECT_NEAR(at(3 * width_px / 4, 0), 0, 8);
    EXPECT_NEAR(at(3 * width_px / 4, 2), 255, 8);
  }
}

TEST(JpegEncoder, MakesOneAtATime) {
  JpegEncoder encoder;
  EXPECT_TRUE(encoder.free());
  EXPECT_TRUE(encoder.take().empty());
  encoder.give(halves(1280, 720));
  EXPECT_FALSE(encoder.free());
  EXPECT_FALSE(made(encoder).empty());
  EXPECT_TRUE(encoder.free());
  EXPECT_TRUE(encoder.take().empty()) << "once";
}

TEST(JpegEncoder, EndsWhileAPictureIsBeingMade) {
  for (int i = 0; i < 20; ++i) {
    JpegEncoder encoder;
    encoder.give(halves(1280, 720));
  }
}

}  // namespace
}  // namespace knuckle::video
