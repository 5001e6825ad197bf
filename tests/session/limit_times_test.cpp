// How long each limit held the machine back.
#include "app/session/limit_times.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace knuckle::session {
namespace {

double time_of(const std::vector<LimitTime>& times, const std::string& limit) {
  const auto found = std::find_if(times.begin(), times.end(), [&](const auto& one) { return one.limit == limit; });
  return found != times.end() ? found->time_s : -1;
}

TEST(LimitTimes, AddUpForEachLimitAndForTheWallThatIsNear) {
  SessionRecord record;
  for (int i = 0; i <= 100; ++i) {
    Sample sample;
    sample.t_s = 0.01 * i;
    sample.tip_m = i <= 60 ? PlanarVector(3.2, 0) : PlanarVector(1, -2.5);
    if (i > 40 && i <= 90) sample.machine.limits |= kLimitVirtualWall;  // 0.2 s at the reach, 0.3 s at the floor
    if (i > 50 && i <= 60) sample.machine.limits |= kLimitPressure;
    record.samples.push_back(sample);
  }
  const auto times = limit_times(record, {.floor_m = -2.6, .ceiling_m = 3.3, .reach_m = 3.3});
  EXPECT_NEAR(time_of(times, "reach"), 0.2, 1e-9);
  EXPECT_NEAR(time_of(times, "floor"), 0.3, 1e-9);
  EXPECT_EQ(time_of(times, "ceiling"), 0);
  EXPECT_NEAR(time_of(times, "pressure"), 0.1, 1e-9);
  EXPECT_EQ(time_of(times, "force ceiling"), 0);
  EXPECT_EQ(time_of(times, "virtual wall"), -1) << "told by their own names";
}

TEST(LimitTimes, ARecordWithoutRowsHasNone) {
  for (const LimitTime& one : limit_times({}, {})) EXPECT_EQ(one.time_s, 0) << one.limit;
}

}  // namespace
}  // namespace knuckle::session
