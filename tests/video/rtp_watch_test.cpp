// Streams of other codecs are named; pictures of which a part was lost are marked.
#include "video/rtp_watch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <vector>

#include "tests/video/lossy_wire.h"
#include "tests/video/patience.h"
#include "video/camera.h"
#include "video/sender.h"

namespace knuckle::video {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string codec(int payload_type, const Bytes& payload) {
  const char* name = other_codec(payload_type, payload);
  return name == nullptr ? "" : name;
}

TEST(OtherCodec, IsNoneForH264) {
  const Bytes single{0x61, 0x88}, key{0x65, 0x88}, parameters{0x67, 0x4D}, aggregate{0x78, 0x00}, fragment{0x7C, 0x85};
  for (const Bytes& payload : {single, key, parameters, aggregate, fragment}) EXPECT_EQ(codec(96, payload), "");
}

TEST(OtherCodec, IsKnownByItsPayloadType) {
  EXPECT_EQ(codec(26, {0x00, 0x00}), "JPEG");
  EXPECT_EQ(codec(33, {0x47, 0x40}), "MPEG-TS");
  EXPECT_EQ(codec(0, {0x67}), "another codec") << "sound";
}

TEST(OtherCodec, IsKnownByHowAPayloadBegins) {
  const Bytes parameters{0x40, 0x01}, picture{0x02, 0x01}, fragment{0x62, 0x01};
  for (const Bytes& payload : {parameters, picture, fragment}) EXPECT_EQ(codec(96, payload), "H.265");
  EXPECT_EQ(codec(96, {0x90, 0x80}), "another codec") << "VP8 with a picture's number";
  EXPECT_EQ(codec(96, {0x10, 0x02}), "another codec") << "VP8 without";
}

TEST(KeyPicture, BeginsWithItsParameters) {
  const auto begins = [](const Bytes& payload) { return begins_key_picture(payload); };
  EXPECT_TRUE(begins({0x67, 0x4D}));
  EXPECT_TRUE(begins({0x78, 0, 2, 0x09, 0xF0, 0, 2, 0x67, 0x4D})) << "behind a delimiter, in one packet";
  EXPECT_FALSE(begins({0x65, 0x88})) << "one slice of it, of which there may be some before";
  EXPECT_FALSE(begins({0x78, 0, 2, 0x09, 0xF0, 0, 2, 0x41, 0x9A}));
  EXPECT_FALSE(begins({0x78, 0xFF, 0xFF, 0x09})) << "cut off";
  EXPECT_FALSE(begins({}));
}

/// What a camera says of a sender of something else. @param encoder and what makes packets of it.
std::string said_of(const std::string& encoder) {
  const std::uint16_t port = LossyWire(1, 0).port();
  Camera camera({"front", receiver_of(port)});
  const Camera sender({"other",
                       "videotestsrc is-live=true ! video/x-raw,format=I420,width=320,height=180,framerate=30/1"
                       " ! tee name=all ! queue ! " +
                           encoder + " ! udpsink host=127.0.0.1 port=" + std::to_string(port) + " all. ! queue"});
  comes([&camera] { return camera.status().troubles > 0; });
  return camera.status().why.data();
}

TEST(SenderOfAnotherCodec, IsNamed) {
  EXPECT_EQ(
      said_of("jpegenc ! rtpjpegpay"),
      "camera front: what is sent here is JPEG, and must be H.264, as knuckle slave --camera sends it; connecting "
      "again");
  EXPECT_NE(said_of("x265enc tune=zerolatency speed-preset=ultrafast ! rtph265pay config-interval=-1")
                .find("what is sent here is H.265, and must be H.264"),
            std::string::npos);
}

TEST(PictureOverRtp, IsMarkedWhereAPartOfItWasLostUntilTheNextKeyPicture) {
  const std::uint16_t port = LossyWire(1, 0).port();
  Camera camera({"front", receiver_of(port)});
  LossyWire wire(port, 0);
  const Sender sender(
      {{"front", "videotestsrc is-live=true pattern=snow ! video/x-raw,width=320,height=180,framerate=30/1"},
       "127.0.0.1",
       wire.port(),
       2000});
  // A busy computer may itself lose some of a stream, which is marked rightly, but not of every second of it.
  int whole = 0;
  EXPECT_TRUE(comes([&] {
    if (const auto frame = camera.take()) whole = frame->damaged ? 0 : whole + 1;
    return whole >= 40;
  })) << "nothing lost, nothing marked";
  bool damaged = false;
  const auto next_is_damaged = [&] {
    const auto frame = next_frame(camera);
    damaged |= frame && frame->damaged;
    return frame && frame->damaged;
  };
  // What is lost right before a key picture is mended at once, which may happen, but not time after time.
  for (int tries = 0; tries < 10 && !damaged; ++tries) {
    const std::uint64_t lost = wire.lost();
    wire.set_cut(true);
    ASSERT_TRUE(comes([&] { return wire.lost() > lost; }));
    wire.set_cut(false);
    for (int i = 0; i < 10 && !damaged; ++i) (void)next_is_damaged();
  }
  ASSERT_TRUE(damaged);
  EXPECT_TRUE(comes([&] {
    const auto frame = camera.take();
    return frame && !frame->damaged;
  })) << "whole again";
}

}  // namespace
}  // namespace knuckle::video
