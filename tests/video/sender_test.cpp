// Pictures over RTP on this computer: sent, received, with the stamp of their capture; with losses, and cut.
#include "video/sender.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <span>
#include <thread>
#include <utility>

#include "tests/video/lossy_wire.h"
#include "tests/video/patience.h"
#include "video/camera.h"
#include "video/frame.h"
#include "video/rtp_watch.h"

namespace knuckle::video {
namespace {

constexpr const char* kTest =
    "videotestsrc is-live=true pattern=ball ! video/x-raw,width=320,height=180,framerate=30/1";

SenderSetup to(std::uint16_t port, const std::string& source = kTest) {
  return {{"front", source}, "127.0.0.1", port, 2000};
}
/// Unix time of a sender's stamp, which counts from 1900.
Duration unix_of(Time stamp) {
  return stamp.time_since_epoch() - 2'208'988'800s;
}

/// A port that is free, as this computer says.
std::uint16_t free_port() {
  return LossyWire(1, 0).port();
}

TEST(SenderOverRtp, StampsEveryPictureWithTheTimeItWasCaptured) {
  const std::uint16_t port = free_port();
  Camera camera({"front", receiver_of(port)});
  // Pictures of many packets each, encoded long after they were captured.
  const Sender sender(to(port,
                         "videotestsrc is-live=true pattern=snow ! video/x-raw,width=640,height=360,"
                         "framerate=5/1 ! identity sleep-time=120000"));
  Time last = kNever;
  (void)next_frame(camera);  // the decoder gives the very first picture together with the second
  for (int i = 0; i < 4; ++i) {
    const auto frame = next_frame(camera);
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->width_px, 640);
    ASSERT_EQ(frame->stamp_from, StampFrom::kSender);
    const Duration unix_now = std::chrono::system_clock::now().time_since_epoch();
    EXPECT_GE(to_seconds(unix_now - unix_of(frame->captured)), 0.12);
    if (last != kNever) {
      const double steps = to_seconds(frame->captured - last) / 0.2;
      EXPECT_NEAR(steps, std::round(steps), 0.1) << "five pictures a second were captured";
      EXPECT_GT(steps, 0.9);
    }
    last = frame->captured;
  }
}

TEST(SenderOverRtp, IsFrozenWhenTheNetworkIsCutAndLiveAgainAfter) {
  const std::uint16_t port = free_port();
  Camera camera({"front", receiver_of(port)});
  LossyWire wire(port, 0);
  const Sender sender(to(wire.port()));
  FrameAge age;
  const auto becomes = [&](VideoState state) {
    return comes([&] {
      if (const auto frame = camera.take()) age.take(*frame);
      return age.state(now()) == state;
    });
  };
  ASSERT_TRUE(becomes(VideoState::kLive));
  wire.set_cut(true);
  EXPECT_TRUE(becomes(VideoState::kFrozen));
  wire.set_cut(false);
  EXPECT_TRUE(becomes(VideoState::kLive));
}

TEST(SenderOverRtp, SendsLessWhenItIsToldAndAlwaysMarkedBelowWhatLeadsTheMachine) {
  const LossyWire wire(free_port(), 1);  // counts all, and passes nothing on
  Sender sender({{"front", "videotestsrc is-live=true pattern=snow ! video/x-raw,width=640,height=360,framerate=30/1"},
                 "127.0.0.1",
                 wire.port(),
                 8000});
  const auto packets_of_30 = [&] {
    const std::uint64_t pictures = sender.pictures(), packets = wire.lost();
    EXPECT_TRUE(comes([&] { return sender.pictures() >= pictures + 30; }));
    return wire.lost() - packets;
  };
  (void)packets_of_30();
  const std::uint64_t before = packets_of_30();
  sender.set_rate(kLeastRate_kbps);
  (void)packets_of_30();
  EXPECT_LT(packets_of_30(), before / 2);
  constexpr int kAf41 = 34;
  EXPECT_EQ(wire.dscp(), kAf41);
}

/// Given pictures, and the stamps of what becomes of them on the wire.
class GivenOverRtp : public testing::Test {
 protected:
  static constexpr int kWidth = 320, kHeight = 180;
  [[nodiscard]] SenderSetup setup() const {
    SenderSetup setup = to(wire_.port());
    setup.camera = given_pictures("front", kWidth, kHeight);
    return setup;
  }
  void give(Sender& sender, Time captured) const {
    auto frame = std::make_unique<Frame>();
    *frame = {.width_px = kWidth,
              .height_px = kHeight,
              .row_bytes = 4 * kWidth,
              .pixels = pixels_->data(),
              .memory = pixels_};
    frame->captured = captured;
    sender.give(std::move(frame));
  }
  /// RFC 8285: the one extension is the stamp (RFC 6051); its upper half are seconds since 1900.
  void read_stamp(const LossyWire::Bytes& packet) {
    ASSERT_GE(packet.size(), 25U);
    ASSERT_EQ(packet[12] << 8 | packet[13], 0xBEDE);
    ASSERT_EQ(packet[16], 0x17);
    double stamp_s = 0;
    for (std::size_t i = 17; i < 21; ++i) stamp_s = 256 * stamp_s + packet[i];
    const Duration unix_now = std::chrono::system_clock::now().time_since_epoch();
    const double wrong_s = std::abs(to_seconds(unix_now) + 2'208'988'800.0 - stamp_s);
    most_wrong_s_ = std::max(most_wrong_s_.load(), wrong_s);
    if (begins_key_picture(std::span(packet).subspan(28))) ++key_pictures_;
    ++packets_;
  }

  std::atomic<double> most_wrong_s_{0};
  std::atomic<int> packets_{0}, key_pictures_{0};
  const std::shared_ptr<std::vector<std::uint8_t>> pixels_ =
      std::make_shared<std::vector<std::uint8_t>>(std::size_t{4} * kWidth * kHeight);
  LossyWire wire_{LossyWire(1, 0).port(), 0, {}, [this](const LossyWire::Bytes& packet) { read_stamp(packet); }};
};

TEST_F(GivenOverRtp, StampsAreRightFromTheFirstPictureOnHoweverEarlyItIsGiven) {
  for (int i = 0; i < 10; ++i) {
    Sender sender(setup());
    const int before = packets_;
    ASSERT_TRUE(comes([&] {
      for (int k = 0; k < 10; ++k, std::this_thread::sleep_for(1ms)) give(sender, now());
      return packets_ > before;
    }));
  }
  EXPECT_LT(most_wrong_s_, 10);
}

TEST_F(GivenOverRtp, WhatWasCapturedBeforeItRanIsNotSent) {
  const Time before_it_ran = now() - 1s;
  Sender sender(setup());
  ASSERT_TRUE(comes([&] {
    give(sender, now());
    return sender.pictures() > 0;
  }));
  const auto settled = [&] {  // nothing is on its way any more
    std::uint64_t last = 0;
    int same = 0;
    EXPECT_TRUE(comes([&] { return (same = std::exchange(last, sender.pictures()) == last ? same + 1 : 0) == 50; }));
    return last;
  };
  const std::uint64_t before = settled();
  for (int i = 0; i < 20; ++i, std::this_thread::sleep_for(10ms)) give(sender, before_it_ran);
  give(sender, now());
  ASSERT_TRUE(comes([&] { return sender.pictures() > before; }));
  EXPECT_EQ(settled(), before + 1);
  EXPECT_LT(most_wrong_s_, 10);
}

TEST_F(GivenOverRtp, AKeyPictureComesSoonHoweverSlowlyPicturesDo) {
  Sender sender(setup());
  ASSERT_TRUE(comes([&] {
    give(sender, now());
    return key_pictures_ > 0;
  }));
  const int keys = key_pictures_;
  const std::uint64_t before = sender.pictures();
  for (; key_pictures_ == keys && sender.pictures() < before + 10; std::this_thread::sleep_for(700ms))
    give(sender, now());
  EXPECT_GT(key_pictures_, keys) << "none of " << sender.pictures() - before << " pictures";
}

}  // namespace
}  // namespace knuckle::video
