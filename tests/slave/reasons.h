// What a reason says; a failed assertion shows it in words.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "core/reason.h"

namespace knuckle::test {

/// @param subject where it matters
[[nodiscard]] inline testing::AssertionResult is(const Reason& reason, ReasonCode code,
                                                 std::optional<int> subject = std::nullopt) {
  const bool same = reason.code == code && reason.subject == subject.value_or(reason.subject);
  testing::AssertionResult result(same);
  if (!same) result << name(reason.code) << " of " << int{reason.subject} << ": " << text(reason);
  return result;
}

/// @param within of value and limit, relative to 1 and themselves
inline void expect_reason(const Reason& reason, ReasonCode code, int subject, double value, double limit,
                          double within = 1e-5) {
  EXPECT_TRUE(is(reason, code, subject));
  if (std::isfinite(value)) {
    EXPECT_NEAR(reason.value, value, within * (1 + std::abs(value))) << text(reason);
  } else {
    EXPECT_TRUE(std::isnan(value) ? std::isnan(reason.value) : reason.value == value) << text(reason);
  }
  EXPECT_NEAR(reason.limit, limit, within * (1 + std::abs(limit))) << text(reason);
}

}  // namespace knuckle::test
