// Streams of other codecs are named; pictures of which a part was lost are marked.
#include "video/rtp_watch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <vector>

#include "tests/support/says.h"
#include "tests/video/lossy_wire.h"
#include "tests/video/patience.h"
#include "video/camera.h"
#include "video/sender.h"

namespace knuckle::video {
namespace {

using Bytes = std::vector<std::uint8_t>;

TEST(OtherCodec, IsKnownByItsPayloadTypeOrByHowAPayloadBegins) {
  constexpr int kOurs = 96, kJpeg = 26, kMpegTs = 33, kSound = 0;
  const struct {
    int type;
    Bytes payload;
    const char *what, *codec;
  } kPackets[]{{kOurs, {0x61, 0x88}, "slice", ""},
               {kOurs, {0x65, 0x88}, "key slice", ""},
               {kOurs, {0x67, 0x4D}, "parameters", ""},
               {kOurs, {0x78, 0x00}, "aggregate", ""},
               {kOurs, {0x7C, 0x85}, "fragment", ""},
               {kJpeg, {0x00, 0x00}, "", "JPEG"},
               {kMpegTs, {0x47, 0x40}, "", "MPEG-TS"},
               {kSound, {0x67}, "", "another codec"},
               {kOurs, {0x40, 0x01}, "parameters", "H.265"},
               {kOurs, {0x02, 0x01}, "slice", "H.265"},
               {kOurs, {0x62, 0x01}, "fragment", "H.265"},
               {kOurs, {0x90, 0x80}, "VP8 with a picture's number", "another codec"},
               {kOurs, {0x10, 0x02}, "VP8 without", "another codec"}};
  for (const auto& packet : kPackets) {
    const char* name = other_codec(packet.type, packet.payload);
    EXPECT_STREQ(name == nullptr ? "" : name, packet.codec) << packet.type << ' ' << packet.what;
  }
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

TEST(SenderOfAnotherCodec, IsNamed) {
  const std::uint16_t port = LossyWire(1, 0).port();
  Camera camera({"front", receiver_of(port)});
  const Camera sender({"other",
                       "videotestsrc is-live=true ! video/x-raw,format=I420,width=320,height=180,framerate=30/1"
                       " ! tee name=all ! queue ! jpegenc ! rtpjpegpay ! udpsink host=127.0.0.1 port=" +
                           std::to_string(port) + " all. ! queue"});
  EXPECT_TRUE(comes([&camera] { return camera.status().troubles > 0; }));
  EXPECT_TRUE(test::says(camera.status().why.data(), "what is sent here is JPEG, and must be H.264"));
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
  const std::uint32_t troubles = camera.status().troubles;
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
  EXPECT_EQ(camera.status().troubles, troubles) << "loss is no reason to connect again";
}

}  // namespace
}  // namespace knuckle::video
