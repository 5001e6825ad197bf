// Identifiers, requests and claims of J1939 by literal bytes, and which raw values are none.
#include "transport/j1939.h"

#include <gtest/gtest.h>

namespace knuckle::j1939 {
namespace {

TEST(J1939, AGroupIsKnownWhateverItsPriorityAndSender) {
  EXPECT_EQ(identifier(0xF004, 0x00), 0x18F00400U | kExtendedId);
  EXPECT_TRUE(is_of(0xF004, 0x0CF00400U | kExtendedId)) << "an engine's, as it is sold";
  EXPECT_TRUE(is_of(0xF004, 0x18F00417U | kExtendedId));
  EXPECT_FALSE(is_of(0xF004, 0x18F00500U | kExtendedId));
  EXPECT_FALSE(is_of(0xF004, 0x19F00400U | kExtendedId)) << "the other data page";
  EXPECT_FALSE(is_of(0xF004, 0x1AF00400U | kExtendedId)) << "another protocol's, by the extended data page";
  EXPECT_FALSE(is_of(0xF004, 0x18F00400U)) << "11 bits";
  EXPECT_EQ(group_of(0x0CF00400U | kExtendedId), 0xF004U);
}

TEST(J1939, TheReceiverIsNoPartOfAGroupBelowF000) {
  EXPECT_EQ(identifier(kRequest, 0xF9, 0x21), 0x18EA21F9U | kExtendedId);
  EXPECT_EQ(group_of(0x18EA21F9U | kExtendedId), kRequest);
  EXPECT_TRUE(is_of(0x0000, 0x0C000305U | kExtendedId)) << "TSC1 to 3";
  EXPECT_TRUE(is_of(0xEF00, 0x18EF2105U | kExtendedId));
  EXPECT_EQ(identifier(0xFEEE, 0x00, 0x21), 0x18FEEE00U | kExtendedId) << "it has none";
  EXPECT_TRUE(is_for(0x21, 0x18EA21F9U | kExtendedId));
  EXPECT_TRUE(is_for(0x21, 0x18EAFFF9U | kExtendedId));
  EXPECT_FALSE(is_for(0x21, 0x18EA22F9U | kExtendedId));
}

TEST(J1939, RequestsAndClaimsHaveTheStandardsBytes) {
  const CanFrame asks = request_frame(0xFEE5, 0xF9, 0x00);
  EXPECT_EQ(asks, (CanFrame{0x18EA00F9U | kExtendedId, 3, {0xE5, 0xFE, 0x00}}));
  EXPECT_EQ(requested(asks), 0xFEE5U);
  EXPECT_FALSE(requested({0x18EA00F9U | kExtendedId, 2, {0xE5, 0xFE}}));
  EXPECT_FALSE(requested({0x18EB00F9U | kExtendedId, 3, {0xE5, 0xFE, 0x00}}));
  const CanFrame claims = claim_frame(0xC03C'8200'1A6F'423F, 0x21);
  EXPECT_EQ(claims, (CanFrame{0x18EEFF21U | kExtendedId, 8, {0x3F, 0x42, 0x6F, 0x1A, 0x00, 0x82, 0x3C, 0xC0}}))
      << "a keypad's, from its manual";
  EXPECT_EQ(claimed_name(claims), 0xC03C'8200'1A6F'423F);
  EXPECT_FALSE(claimed_name({0x18EEFF21U | kExtendedId, 7, {}}));
}

TEST(J1939, WhatIsNoneFollowsFromTheLength) {
  EXPECT_EQ(invalid_from(2), 2U);
  EXPECT_EQ(invalid_from(4), 0xEU);
  EXPECT_EQ(invalid_from(8), 0xFBU);
  EXPECT_EQ(invalid_from(12), 0xFB0U);
  EXPECT_EQ(invalid_from(16), 0xFB00U);
  EXPECT_EQ(invalid_from(32), 0xFB000000U);
  EXPECT_EQ(invalid_from(64), 0xFB00000000000000U);
  for (const unsigned bits : {1U, 3U, 5U, 7U}) EXPECT_FALSE(invalid_from(bits)) << bits;
}

}  // namespace
}  // namespace knuckle::j1939
