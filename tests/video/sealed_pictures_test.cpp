// Pictures sealed on their way: who has no key, another one, or what was sent before, shows nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/says.h"
#include "tests/video/lossy_wire.h"
#include "tests/video/patience.h"
#include "tests/video/picture_key.h"
#include "video/camera.h"
#include "video/sender.h"

namespace knuckle::video {
namespace {

constexpr const char* kBall =
    "videotestsrc is-live=true pattern=ball ! video/x-raw,width=320,height=180,framerate=30/1";
constexpr const char* kSnow =
    "videotestsrc is-live=true pattern=snow ! video/x-raw,width=640,height=360,framerate=30/1";

/// A sender and a receiver, and between them whoever listens, keeps, changes and says again.
class SealedPictures : public testing::Test {
 protected:
  explicit SealedPictures(const Patience& patience = {})
      : camera_({"mast", receiver_of(port_, "127.0.0.1", true)}, {}, patience) {}
  [[nodiscard]] SenderSetup setup(const char* source = kBall) const {
    return {{"mast", source}, "127.0.0.1", wire_.port(), 4000, true};
  }
  [[nodiscard]] std::vector<LossyWire::Bytes> overheard() {
    const std::lock_guard lock(mutex_);
    return overheard_;
  }
  /// Every so many packets from now on are changed in one bit; 0: none.
  std::atomic<unsigned> changed_{0};

  const std::uint16_t port_ = LossyWire(1, 0).port();
  std::mutex mutex_;
  std::vector<LossyWire::Bytes> overheard_;
  unsigned count_ = 0;
  LossyWire wire_{port_, 0, {}, [this](LossyWire::Bytes& bytes) {
                    const std::lock_guard lock(mutex_);
                    overheard_.push_back(bytes);
                    if (changed_ > 0 && ++count_ % changed_ == 0) bytes[bytes.size() / 2] ^= 0x10;
                  }};
  Camera camera_;
};
/// They do not come, and the receiver does not wait for long.
struct SealedPicturesInVain : SealedPictures {
  SealedPicturesInVain() : SealedPictures({.first = 2s, .next = 1s}) {}
};
/// They come no more at some time, likewise.
struct SealedPicturesThatEnd : SealedPictures {
  SealedPicturesThatEnd() : SealedPictures({.next = 2s}) {}
};

/// Whether a packet's payload begins as one of H.264 over RTP does (RFC 6184).
bool looks_like_h264(const LossyWire::Bytes& packet) {
  std::size_t at = 12;
  if ((packet[0] & 0x10) != 0) at += 4 + std::size_t{4} * static_cast<std::size_t>(packet[14] << 8 | packet[15]);
  const unsigned header = packet.at(at), type = header & 0x1F;
  return header < 0x80 && (type == 1 || (type >= 5 && type <= 9) || type == 24 || type == 28);
}
double share_of_h264(const std::vector<LossyWire::Bytes>& packets) {
  const auto count = std::count_if(packets.begin(), packets.end(), looks_like_h264);
  return static_cast<double>(count) / static_cast<double>(packets.size());
}

TEST_F(SealedPictures, ShowNothingOfThePictureOnTheWay) {
  for (const bool sealed : {false, true}) {
    SenderSetup to = setup(kSnow);
    to.sealed = sealed;
    const std::size_t before = overheard().size();
    Sender sender(to);
    if (sealed) sender.set_key(key_of(1));
    ASSERT_TRUE(comes([&] { return overheard().size() > before + 500; }));
    auto packets = overheard();
    packets.erase(packets.begin(), packets.begin() + static_cast<std::ptrdiff_t>(before));
    if (sealed) {
      EXPECT_LT(share_of_h264(packets), 0.3);
    } else {
      EXPECT_EQ(share_of_h264(packets), 1) << "plain ones are known by their bytes";
    }
  }
}

TEST_F(SealedPictures, AreSentOnlyWhileThereIsAKey) {
  Sender sender(setup());
  ASSERT_TRUE(comes([&] { return sender.pictures() > 30; }));
  EXPECT_TRUE(overheard().empty());
  sender.set_key(key_of(1));
  ASSERT_TRUE(comes([&] { return !overheard().empty(); }));
  sender.set_key(std::nullopt);
  const auto pictures_go_by = [&] {
    const std::uint64_t before = sender.pictures();
    return comes([&] { return sender.pictures() > before + 20; });
  };
  ASSERT_TRUE(pictures_go_by());  // what was on its way has arrived
  const std::size_t before = overheard().size();
  ASSERT_TRUE(pictures_go_by());
  EXPECT_EQ(overheard().size(), before);
  sender.set_key(key_of(1));
  EXPECT_TRUE(comes([&] { return overheard().size() > before; }));
}

TEST_F(SealedPicturesInVain, WaitForASessionAndDoNotOpenWithAnotherKeyWhichIsCountedAndSaid) {
  Sender sender(setup());
  sender.set_key(key_of(1));
  ASSERT_TRUE(comes([&] { return camera_.status().troubles > 0; }));
  EXPECT_TRUE(test::says(camera_.status().why.data(), "there is no session yet"));
  EXPECT_EQ(camera_.take(), nullptr);
  camera_.set_key(key_of(2));
  EXPECT_TRUE(comes([&] {
    const std::string line = camera_.status().why.data();
    return line.find("packets came that this session's key does not open") != std::string::npos;
  })) << camera_.status().why.data();
  EXPECT_TRUE(comes([&] { return camera_.status().refused > 100; }));
  EXPECT_EQ(camera_.take(), nullptr);
}

TEST_F(SealedPicturesThatEnd, LoseWhatWasChangedOnTheWayAndNothingElse) {
  Sender sender(setup(kSnow));
  sender.set_key(key_of(1));
  camera_.set_key(key_of(1));
  ASSERT_NE(next_frame(camera_), nullptr);
  changed_ = 20;
  EXPECT_TRUE(comes([&] { return camera_.status().refused > 50; }));
  changed_ = 0;
  EXPECT_NE(next_frame(camera_), nullptr);
  const std::uint32_t troubles = camera_.status().troubles;
  changed_ = 1;  // each
  EXPECT_TRUE(comes([&] { return camera_.status().troubles > troubles; }));
  EXPECT_EQ(camera_.status().playing, false);
}

TEST_F(SealedPictures, AreNotShownAgainAlsoWhereTheReceiverHasBegunAnewButThoseOfTheNextSessionAre) {
  std::vector<LossyWire::Bytes> kept;
  {
    Sender sender(setup());
    sender.set_key(key_of(1));
    camera_.set_key(key_of(1));
    for (int i = 0; i < 40; ++i) ASSERT_NE(next_frame(camera_), nullptr);
    kept = overheard();
  }
  const auto say_again = [&] {
    for (const LossyWire::Bytes& packet : kept) {
      wire_.inject(packet);
      std::this_thread::sleep_for(1ms);  // all at once they would not fit into the socket
    }
  };
  const auto nothing_comes_of_it = [&] {
    std::this_thread::sleep_for(100ms);  // what was on its way
    (void)camera_.take();
    const std::uint64_t before = camera_.status().refused;
    say_again();
    EXPECT_TRUE(comes([&] { return camera_.status().refused >= before + kept.size() - 1; }));
    EXPECT_EQ(camera_.take(), nullptr);
  };
  std::this_thread::sleep_for(2500ms);  // the change of keys is over: what is refused counts
  say_again();                          // what was lost on the way has come now, too
  nothing_comes_of_it();
  const std::uint32_t troubles = camera_.status().troubles;
  ASSERT_TRUE(comes([&] { return camera_.status().troubles > troubles; }));  // no picture for 5 s
  std::this_thread::sleep_for(1s);                                           // connected again
  nothing_comes_of_it();
  Sender sender(setup());
  sender.set_key(key_of(2));
  camera_.set_key(key_of(2));
  EXPECT_NE(next_frame(camera_), nullptr);
}

TEST_F(SealedPictures, GoOnThroughAChangeOfKeysWhoeverHasTheNewOneFirst) {
  Sender sender(setup());
  sender.set_key(key_of(1));
  camera_.set_key(key_of(1));
  ASSERT_NE(next_frame(camera_), nullptr);
  for (std::uint8_t key = 2; key < 4; ++key) {
    std::this_thread::sleep_for(2500ms);  // the change before is over: what is refused counts
    if (key % 2 == 0) camera_.set_key(key_of(key));
    sender.set_key(key_of(key));
    std::this_thread::sleep_for(150ms);
    camera_.set_key(key_of(key));
    for (int i = 0; i < 40; ++i) {
      const auto frame = next_frame(camera_);
      ASSERT_NE(frame, nullptr) << camera_.status().why.data();
      EXPECT_EQ(frame->stamp_from, StampFrom::kSender);
    }
  }
  std::this_thread::sleep_for(4500ms);  // all that is to be counted is
  EXPECT_EQ(camera_.status().refused, 0u);
  EXPECT_EQ(camera_.status().troubles, 0u);
}

TEST_F(SealedPictures, AreSeenOnWhereTheSendersCameraBeginsAnew) {
  Sender sender(
      setup("videotestsrc is-live=true num-buffers=20 pattern=ball ! video/x-raw,width=320,height=180,framerate=30/1"));
  sender.set_key(key_of(1));
  camera_.set_key(key_of(1));
  ASSERT_TRUE(comes([&] {
    (void)camera_.take();
    return sender.status().troubles >= 2;  // the stream has ended, again and again
  }));
  ASSERT_NE(next_frame(camera_), nullptr);
  EXPECT_EQ(camera_.status().refused, 0u);
}

}  // namespace
}  // namespace knuckle::video
