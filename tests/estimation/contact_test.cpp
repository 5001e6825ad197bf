// The contact event by itself, against what free motion and forces look like in standard deviations.
#include "estimation/contact.h"

#include <gtest/gtest.h>

#include <random>

namespace knuckle::estimation {
namespace {

constexpr double kStep_s = 5e-3;
const JointVector kSigma_Nm(800, 200, 60);

/// @return time until the event, of torques that are `deviations` of their own from 0 s on; negative if none in 0.3 s.
double seen_after_s(const JointVector& deviations, double step_s = kStep_s) {
  ContactCusum cusum(step_s);
  cusum.reset(JointVector::Zero());
  for (double t = 0; t < 0.3; t += step_s)
    if (cusum.step(deviations.cwiseProduct(kSigma_Nm), kSigma_Nm)) return t + step_s;
  return -1;
}

TEST(ContactEvent, AddsUpWhatAllJointsSee) {
  const double one = seen_after_s({8, 0, 0}), all = seen_after_s({8, 6, 6});
  EXPECT_GT(one, 0);
  EXPECT_GT(all, 0);
  EXPECT_LT(all, one);
}

TEST(ContactEvent, SeesEitherDirectionAlike) {
  const double up = seen_after_s({5, -3, 2}), down = seen_after_s({-5, 3, -2});
  EXPECT_GT(up, 0);
  EXPECT_EQ(up, down);
}

TEST(ContactEvent, DoesNotDependOnTheStep) {
  const JointVector deviations(5, 3, 2);
  EXPECT_NEAR(seen_after_s(deviations, 1e-3), seen_after_s(deviations, kStep_s), kStep_s);
}

TEST(ContactEvent, IsSilentInTenMinutesOfNoise) {
  // As the contact channel has it: no sample differs much from the one before.
  constexpr double kSame = 0.9;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  ContactCusum cusum(kStep_s);
  cusum.reset(JointVector::Zero());
  JointVector noise = JointVector::Zero();
  int events = 0;
  for (int k = 0; k < 120'000; ++k) {
    for (double& n : noise) n = kSame * n + std::sqrt(1 - kSame * kSame) * normal(random);
    if (cusum.step(noise.cwiseProduct(kSigma_Nm), kSigma_Nm)) ++events;
  }
  EXPECT_EQ(events, 0);
}

TEST(ContactEvent, ASingleOutlierIsNone) {
  ContactCusum cusum(kStep_s);
  cusum.reset(JointVector::Zero());
  EXPECT_FALSE(cusum.step(15 * kSigma_Nm, kSigma_Nm));
  for (int k = 0; k < 5; ++k) EXPECT_FALSE(cusum.step(JointVector::Zero(), kSigma_Nm));
}

TEST(ContactEvent, WhatGrowsSlowlyIsNone) {
  ContactCusum cusum(kStep_s);
  cusum.reset(JointVector::Zero());
  for (int k = 0; k < 2000; ++k) EXPECT_FALSE(cusum.step(k * 0.05 * kSigma_Nm, kSigma_Nm)) << k;  // 10 a second
}

TEST(ContactEvent, BeginsAnewAfterAnAlarm) {
  ContactCusum cusum(kStep_s);
  const JointVector hit_Nm = 6 * kSigma_Nm;
  cusum.reset(JointVector::Zero());
  int first = 0;
  while (!cusum.step(hit_Nm, kSigma_Nm)) ++first;
  EXPECT_GT(first, 0);
  EXPECT_FALSE(cusum.step(hit_Nm, kSigma_Nm));
}

}  // namespace
}  // namespace knuckle::estimation
