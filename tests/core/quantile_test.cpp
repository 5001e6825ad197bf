#include "core/quantile.h"

#include <gtest/gtest.h>

namespace knuckle {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(Quantile, IsTheSmallestSampleThatTheShareDoesNotExceed) {
  std::vector<double> samples;
  for (int i = 20; i > 0; --i) samples.push_back(i);
  EXPECT_EQ(quantile(samples, 0.95), 19);
  EXPECT_EQ(quantile(samples, 0.96), 20);
  EXPECT_EQ(quantile(samples, 1), 20);
  EXPECT_EQ(quantile(samples, 0), 1);
  EXPECT_EQ(median({9, 1, 5}), 5);
}

TEST(Quantile, CountsNoNaN) {
  EXPECT_EQ(median({kNaN, 3, kNaN, 1, 2}), 2);
  EXPECT_TRUE(std::isnan(median({kNaN})));
  EXPECT_TRUE(std::isnan(median({})));
}

}  // namespace
}  // namespace knuckle
