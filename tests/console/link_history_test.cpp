// Minutes of the link in fixed room.
#include <gtest/gtest.h>

#include <cmath>

#include "app/console/link_watch.h"

namespace knuckle::console {
namespace {

class MinutesOfTheLink : public testing::Test {
 protected:
  MinutesOfTheLink() {
    view_.link.heard = true;
    view_.link.neutral_after_s = 0.2;
    view_.link.round_trip_s = 0.02;
    view_.link.round_trip.add(20ms);
  }
  void pass(double seconds) {
    for (const Time end = view_.now + from_seconds(seconds); view_.now < end; view_.now += 20ms) history_.watch(view_);
  }
  ConsoleView view_;
  LinkHistory history_;
};

TEST_F(MinutesOfTheLink, KeepASpikeOfFiftyMillisecondsForTenMinutesAndNoLonger) {
  pass(60);
  view_.link.round_trip_s = 0.31;
  pass(0.06);
  view_.link.round_trip_s = 0.02;
  const auto highest = [this] {
    float most = 0;
    for (std::size_t i = 0; i < history_.size(); ++i)
      most = std::fmax(most, history_.ago(i, LinkMeasure::kNewestRoundTrip).most);
    return most;
  };
  pass(590);
  EXPECT_FLOAT_EQ(highest(), 0.31F);
  EXPECT_EQ(history_.size(), LinkHistory::kSeconds);
  pass(15);
  EXPECT_FLOAT_EQ(highest(), 0.02F);
}

/// Of two packets in three 150 ms, of the third one 900 ms: fair by its median, though the newest is bad.
TEST_F(MinutesOfTheLink, HaveOfTheRoundTripTheMedianByWhichTheWordGoes) {
  view_.link.round_trip = {};
  for (int i = 0; i < 300; ++i) view_.link.round_trip.add(i % 3 == 0 ? 900ms : 150ms);
  view_.link.round_trip_s = 0.9;
  pass(5);
  const float plotted = history_.ago(0, LinkMeasure::kRoundTrip).most;
  const QualityBounds& bounds = bounds_of(LinkMeasure::kRoundTrip);
  EXPECT_NEAR(static_cast<double>(plotted), to_seconds(view_.link.round_trip.quantile(0.5)), 1e-6);
  EXPECT_GT(static_cast<double>(plotted), bounds.fair);
  EXPECT_LE(static_cast<double>(plotted), bounds.poor);
  EXPECT_EQ(link_verdict(view_.link, 0).value().quality, LinkQuality::kFair) << "the word is that of the plot's band";
  EXPECT_FLOAT_EQ(history_.ago(0, LinkMeasure::kNewestRoundTrip).most, 0.9F);
}

TEST_F(MinutesOfTheLink, AreUnknownWhereNobodyLookedOrNothingWasHeardAndBeginAnewWithTheSession) {
  pass(5);
  view_.now += 3s;
  pass(2);
  EXPECT_TRUE(std::isfinite(history_.ago(0, LinkMeasure::kRoundTrip).most));
  EXPECT_TRUE(std::isnan(history_.ago(3, LinkMeasure::kRoundTrip).most));
  EXPECT_TRUE(std::isfinite(history_.ago(6, LinkMeasure::kRoundTrip).most));
  view_.link.silence_s = 2;
  pass(2);
  EXPECT_TRUE(std::isnan(history_.ago(0, LinkMeasure::kRoundTrip).most)) << "an old round trip is none";
  EXPECT_TRUE(std::isnan(history_.ago(0, LinkMeasure::kNewestRoundTrip).most));
  EXPECT_TRUE(std::isnan(history_.ago(0, LinkMeasure::kJitter).most)) << "nor is an old jitter";
  EXPECT_FLOAT_EQ(history_.ago(0, LinkMeasure::kSilence).most, 10);
  view_.now = Time{};
  pass(3);
  EXPECT_LE(history_.size(), 4u);
}

}  // namespace
}  // namespace knuckle::console
