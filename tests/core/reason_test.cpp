// What a person reads of a reason.
#include "core/reason.h"

#include <gtest/gtest.h>

#include "core/time.h"

namespace knuckle {
namespace {

TEST(Reason, SaysAgeAndLimit) {
  EXPECT_EQ(text({ReasonCode::kLinkLost, 0, 203, 200}),
            "no new packet over the link: check the network (203 ms; limit 200)");
}

TEST(Reason, CallsWhatNeverCameByNoAge) {
  const auto never_ms = static_cast<float>(1e3 * to_seconds(Time{} - kNever));
  EXPECT_EQ(text({ReasonCode::kLinkLost, 0, never_ms, 200}),
            "no new packet over the link: check the network (never yet)");
}

}  // namespace
}  // namespace knuckle
