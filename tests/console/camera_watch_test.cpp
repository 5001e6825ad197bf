// What the console says of a camera.
#include "app/console/camera_watch.h"

#include <gtest/gtest.h>

namespace knuckle::console {
namespace {

using video::VideoState;

class CameraWatching : public testing::Test {
 protected:
  /// A frame that was captured now.
  void capture() {
    next_ = std::make_unique<video::Frame>();
    next_->connection = 1;
    next_->captured = next_->received = now_;
  }
  void fail(const std::string& why) {
    ++status_.troubles;
    status_.playing = false;
    status_.why.fill(0);
    why.copy(status_.why.data(), status_.why.size() - 1);
  }
  /// What is said so much later.
  std::vector<std::string> said_after(Duration time) {
    now_ += time;
    news_.clear();
    (void)watch_.watch(now_, news_);
    std::vector<std::string> lines;
    for (const auto& news : news_) lines.push_back(news.what);
    return lines;
  }

  Time now_{100s};
  std::unique_ptr<video::Frame> next_;
  video::CameraStatus status_;
  std::vector<CameraWatch::News> news_;
  CameraWatch watch_{{"mast", [this] { return std::move(next_); }, [this] { return status_; }}};
};
using Lines = std::vector<std::string>;

TEST_F(CameraWatching, StampsAPictureInTheTimeOfTheSession) {
  capture();
  next_->number = 7;
  now_ += 30ms;
  news_.clear();
  const auto frame = watch_.watch(now_, news_);
  ASSERT_TRUE(frame);
  const recording::CameraStamp here = stamp_of(watch_, *frame, now_, Time(5s));
  EXPECT_EQ(here.camera, "mast");
  EXPECT_EQ(here.number, 7u);
  EXPECT_EQ(here.at, Time(5s));
  EXPECT_EQ(here.captured, Time(5s) - 30ms);
  EXPECT_EQ(here.received, Time(5s) - 30ms);
  EXPECT_FALSE(here.senders_clock);
  EXPECT_DOUBLE_EQ(here.age_s, 0.03);
  video::Frame from_elsewhere = *frame;
  from_elsewhere.stamp_from = video::StampFrom::kSender;
  from_elsewhere.captured = Time(1234s);
  const recording::CameraStamp senders = stamp_of(watch_, from_elsewhere, now_, Time(5s));
  EXPECT_TRUE(senders.senders_clock);
  EXPECT_EQ(senders.captured, Time(1234s)) << "as it came: its clock is not ours";
}

TEST_F(CameraWatching, SaysThatThereIsAPictureWarnsOnceThatItIsFrozenAndSaysForHowLongItWas) {
  EXPECT_EQ(said_after(1s), Lines{});
  EXPECT_EQ(watch_.state(), VideoState::kNone);
  capture();
  EXPECT_EQ(said_after(0s), Lines{"camera mast: live picture"});
  EXPECT_EQ(news_[0].severity, Severity::kInfo);
  EXPECT_EQ(said_after(290ms), Lines{"camera mast: video frozen: the last picture is 0.3 s old"});
  EXPECT_EQ(news_[0].severity, Severity::kWarning);
  EXPECT_EQ(said_after(1s), Lines{});
  capture();
  EXPECT_EQ(said_after(0s), Lines{"camera mast: live picture again, after 1.0 s"});
}

TEST_F(CameraWatching, SaysOfAPictureThatComesAndGoesAFewTimesOnlyAndInTheEndWhatIs) {
  std::size_t lines = 0;
  for (int i = 0; i < 30; ++i) {  // for 20 s, live and frozen in turns
    capture();
    lines += said_after(0s).size();
    lines += said_after(660ms).size();
  }
  EXPECT_EQ(lines, 6u);
  EXPECT_EQ(said_after(1s), Lines{}) << "frozen was told last, and is what is";
  capture();
  EXPECT_EQ(said_after(0s), Lines{}) << "not yet";
  for (int i = 0; i < 50; ++i) {
    capture();
    for (const std::string& line : said_after(200ms))
      EXPECT_TRUE(line.starts_with("camera mast: live picture again")) << line;
  }
  EXPECT_EQ(said_after(1s).size(), 1u) << "it may be told again";
}

TEST_F(CameraWatching, WarnsOfPicturesThatComeLate) {
  capture();
  now_ += 600ms;
  next_->received = now_;
  EXPECT_EQ(said_after(0s), Lines{"camera mast: video late: the picture shown is 0.6 s old"});
  EXPECT_EQ(watch_.state(), VideoState::kLate);
}

TEST_F(CameraWatching, SaysOfADamagedPictureThatPartsOfItAreOldForAsLongAsThatCanBeRead) {
  capture();
  EXPECT_EQ(said_after(0s), Lines{"camera mast: live picture"});
  EXPECT_FALSE(watch_.damaged());
  capture();
  next_->damaged = true;
  EXPECT_EQ(
      said_after(30ms),
      Lines{"camera mast: packets are lost on the way: parts of the picture are old, until the next key picture"});
  EXPECT_EQ(news_[0].severity, Severity::kWarning);
  EXPECT_TRUE(watch_.damaged());
  for (int i = 0; i < 9; ++i) {
    capture();
    EXPECT_EQ(said_after(100ms), Lines{});
    EXPECT_TRUE(watch_.damaged()) << i;
  }
  capture();
  next_->damaged = true;
  EXPECT_EQ(said_after(50ms), Lines{}) << "again: no news";
  capture();
  EXPECT_EQ(said_after(0s), Lines{});
  EXPECT_TRUE(watch_.damaged());
  now_ += 1s;
  capture();
  EXPECT_EQ(said_after(0s), Lines{});
  EXPECT_FALSE(watch_.damaged());
}

TEST_F(CameraWatching, SaysTheSameProblemOnceUntilItIsOver) {
  fail("camera mast: no such device; connecting again");
  EXPECT_EQ(said_after(1s), Lines{"camera mast: no such device; connecting again"});
  EXPECT_EQ(watch_.problem(), "camera mast: no such device; connecting again");
  fail("camera mast: no such device; connecting again");
  EXPECT_EQ(said_after(1s), Lines{});
  status_.playing = true;
  for (int i = 0; i < 2; ++i) {
    capture();
    (void)said_after(30ms);
  }
  EXPECT_TRUE(watch_.problem().empty());
  fail("camera mast: no such device; connecting again");
  EXPECT_EQ(said_after(0s), Lines{"camera mast: no such device; connecting again"});
}

}  // namespace
}  // namespace knuckle::console
