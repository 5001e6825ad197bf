#include "core/trust.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

namespace knuckle {
namespace {

TEST(Trust, GrowsFromNothingAtATenthToAllAtFourTenthsAndIsNoneOfWhatIsNoNumber) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [confidence, share] :
       {std::pair{1.0, 1.0}, {0.4, 1.0}, {0.25, 0.5}, {0.1, 0.0}, {0.0, 0.0}, {-1.0, 0.0}, {kNan, 0.0}}) {
    EXPECT_NEAR(trust(confidence), share, 1e-12) << confidence;
  }
}

}  // namespace
}  // namespace knuckle
