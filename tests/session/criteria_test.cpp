// Criteria at their edges, and the digest of a session.
#include "app/session/criteria.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "app/session/session_digest.h"

namespace knuckle::session {
namespace {

TEST(Criteria, EachBoundIsJudgedAtItsEdge) {
  Metrics metrics;
  metrics.tip_rms_m = 0.05;
  EXPECT_TRUE(all_passed(evaluate({{"tip_rms_m", 0.05, 0.05}}, metrics)));
  EXPECT_FALSE(all_passed(evaluate({{"tip_rms_m", {}, 0.0499}}, metrics)));
  EXPECT_FALSE(all_passed(evaluate({{"tip_rms_m", 0.0501, {}}}, metrics)));
}

TEST(Criteria, WhatWasNotMeasuredOrIsNotANumberFails) {
  Metrics metrics;
  EXPECT_FALSE(all_passed(evaluate({{"hold_error_N", {}, 1}}, metrics)));
  metrics.hold_error_N = std::nan("");
  EXPECT_FALSE(all_passed(evaluate({{"hold_error_N", {}, 1}}, metrics)));
}

TEST(SessionDigest, IsSha256OfValuesAndSeesEveryOne) {
  EXPECT_EQ(cli::Digest().finish(), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const auto digest_of = [](const Sample& s) {
    cli::Digest digest;
    add(digest, s);
    return digest.finish();
  };
  Sample a;
  const std::string base = digest_of(a);
  EXPECT_EQ(base, digest_of(Sample{}));
  a.felt_slew_N_per_ms = 1e-300;
  EXPECT_NE(base, digest_of(a));
  cli::Digest digest;
  add(digest, Time{1ns}, CanFrame{0x181, 2, {1, 2}});
  cli::Digest other;
  add(other, Time{1ns}, CanFrame{0x181, 2, {1, 3}});
  EXPECT_NE(digest.finish(), other.finish());
}

}  // namespace
}  // namespace knuckle::session
