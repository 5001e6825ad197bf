// A person by the figures that define one, then a light hand on a real device's friction.
#include "sim/person.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "machine/kinematics.h"
#include "sim/haptic_device.h"
#include "sim/operator.h"
#include "tests/master/desk.h"
#include "tests/sim/test_plant.h"
#include "tests/support/no_alloc.h"
#include "transport/hid_pair.h"

namespace knuckle::sim {
namespace {

using namespace std::chrono_literals;

constexpr double kTick_s = 1e-3;

Person trembling(double tremor_m, double tremor_Hz) {
  Person person;
  person.tremor_m = tremor_m;
  person.tremor_Hz = tremor_Hz;
  return person;
}

double rms(const std::vector<double>& values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

/// A limb that holds nothing, pushed by its own muscles: one direction.
std::vector<double> free_limb(const Person& person, const LimbImpedance& limb, double seconds, std::uint64_t seed) {
  Unsteadiness unsteady(person, limb, seed);
  std::vector<double> path;
  double x = 0, v = 0;
  Time now{};
  for (int k = 0; k < static_cast<int>(seconds / kTick_s); ++k) {
    now += 1ms;
    unsteady.step(now);
    v += kTick_s * (unsteady.push_N().x() - limb.stiffness_N_per_m * x - limb.damping_Ns_per_m * v) / limb.mass_kg;
    x += kTick_s * v;
    if (to_seconds(now) > 2) path.push_back(x);
  }
  return path;
}

TEST(Person, AnExactOneDoesNothingOfItsOwn) {
  const Person person = sample_person(PersonClass::kExact, 5);
  EXPECT_FALSE(person.corrects);
  Unsteadiness unsteady(person, test::steady_limb(), 5);
  Time now{};
  for (int k = 0; k < 60'000; ++k) {
    now += 1ms;
    unsteady.step(now);
    ASSERT_EQ(unsteady.push_N().norm(), 0);
    ASSERT_EQ(unsteady.drift_rad().norm(), 0);
    ASSERT_EQ(unsteady.grip(), 1);
  }
}

TEST(Person, CorrectsMoreSlowlyTheLaterTheSeeing) {
  constexpr double kTurn = 2 * std::numbers::pi;
  EXPECT_NEAR(correction_1ps(150ms) / kTurn, 0.80, 0.01);  // figures of the formula's source
  EXPECT_NEAR(correction_1ps(250ms) / kTurn, 0.52, 0.01);
  EXPECT_NEAR(correction_1ps(450ms) / kTurn, 0.32, 0.01);
  EXPECT_EQ(correction_1ps(0ms), correction_1ps(150ms)) << "nobody sees earlier than a person does";
  for (Duration late = 150ms; late <= 600ms; late += 10ms) {
    EXPECT_LT(correction_1ps(late) * to_seconds(late), std::numbers::pi / 3) << "an integrator behind a delay";
  }
}

TEST(Person, TremblesByAsMuchAndAsFastAsItIsSaidTo) {
  for (const LimbImpedance& limb : {LimbImpedance{1.0, 20, 400, 3e-3, 0.05, 4}, {0.1, 1, 20, 3e-3, 0.05, 4}}) {
    for (const double tremor_Hz : {7.0, 11.0}) {
      const std::vector<double> path = free_limb(trembling(2e-4, tremor_Hz), limb, 120, 3);
      EXPECT_NEAR(rms(path), 2e-4, 0.2 * 2e-4);
      int crossings = 0;
      for (std::size_t i = 1; i < path.size(); ++i) crossings += (path[i - 1] < 0) != (path[i] < 0);
      EXPECT_NEAR(crossings / 2.0 / (static_cast<double>(path.size()) * kTick_s), tremor_Hz, 0.15 * tremor_Hz);
    }
  }
}

TEST(Person, DriftsNoFasterThanItIsSaidToAndFromWhereItStands) {
  Person person;
  person.drift_radps = 3e-3;
  Unsteadiness unsteady(person, test::steady_limb(), 7);
  JointVector before = JointVector::Zero();
  double fastest = 0, furthest = 0;
  Time now{};
  for (int k = 0; k < 120'000; ++k) {
    now += 1ms;
    unsteady.step(now);
    fastest = std::max(fastest, (unsteady.drift_rad() - before).cwiseAbs().maxCoeff() / kTick_s);
    furthest = std::max(furthest, unsteady.drift_rad().cwiseAbs().maxCoeff());
    before = unsteady.drift_rad();
  }
  EXPECT_LE(fastest, 3e-3 * (1 + 1e-6));
  EXPECT_GT(fastest, 1.5e-3);
  EXPECT_GT(furthest, 2e-3) << "it does get somewhere";
}

TEST(Person, SlipsAsOftenAndForAsLongAsItIsSaidTo) {
  Person person;
  person.slips_per_s = 0.1;
  Unsteadiness unsteady(person, test::steady_limb(), 11);
  constexpr double kLength_s = 2000;
  int slips = 0, length = 0;
  bool before = false;
  Time now{};
  for (int k = 0; k < static_cast<int>(kLength_s / kTick_s); ++k) {
    now += 1ms;
    unsteady.step(now);
    const bool slipping = unsteady.grip() < 1;
    if (slipping) {
      ASSERT_EQ(unsteady.grip(), person.slipping_grip);
      ++length;
    } else if (before) {
      EXPECT_GE(length, 99);
      EXPECT_LE(length, 301);
      length = 0;
    }
    slips += slipping && !before;
    before = slipping;
  }
  EXPECT_NEAR(slips, 0.1 * kLength_s, 45);  // three standard deviations of a Poisson process
}

TEST(Person, IsTheSameForTheSameSeedAndRougherWhereItIsCalledSo) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const Person steady = sample_person(PersonClass::kSteady, seed), rough = sample_person(PersonClass::kRough, seed);
    EXPECT_EQ(steady.tremor_m, sample_person(PersonClass::kSteady, seed).tremor_m);
    EXPECT_TRUE(steady.corrects && rough.corrects);
    EXPECT_LT(steady.tremor_m, rough.tremor_m);
    EXPECT_LT(steady.drift_radps, rough.drift_radps);
    EXPECT_LE(steady.give_way, rough.give_way);
    EXPECT_EQ(steady.slips_per_s, 0);
    EXPECT_GT(rough.slips_per_s, 0);
  }
}

TEST(Person, StepsAllocateNothing) {
  Unsteadiness unsteady(sample_person(PersonClass::kRough, 1), test::steady_limb(), 1);
  const test::NoAllocScope scope;
  for (int k = 1; k < 5000; ++k) unsteady.step(Time(k * 1ms));
  EXPECT_EQ(scope.allocations(), 0U);
}

/// A hand on a device that nobody commands, its pose shown one to one and the machine where the hand asks it to be.
struct HandOnDevice {
  HandOnDevice(const LimbImpedance& limb, const Person& person, std::vector<Phase> phases)
      : device(test::desk_device(), limb, cable.device(), 3, test::kMidPosture),
        plan(test::solar(), std::move(phases), {}, 5ms, test::kMidPosture, 250ms,
             PushStiffness{kPress_N_per_m, kPress_N_per_m}, Unsteadiness(person, limb, 3)) {}
  void run(double seconds) {
    for (int k = 0; k < static_cast<int>(seconds / kTick_s); ++k) {
      now += 1ms;
      OperatorView view;
      view.hand_rad = view.ghost_rad = view.machine_rad = device.truth().joint_rad;
      view.felt_N = felt_N;
      view.mode = Mode::kEngaged;
      cable.advance();
      intent = plan.step(now, view);
      intent.presence = true;
      device.step(now, intent);
    }
  }
  static constexpr double kPress_N_per_m = 30;
  HidPair cable;
  HandAndDevice device;
  Operator plan;
  OperatorIntent intent;
  PlanarVector felt_N = PlanarVector::Zero();
  Time now{};
};

Phase go_on_to(const JointVector& joints_rad) {
  Phase phase;
  phase.kind = PhaseKind::kMove;
  phase.joint_space = true;
  phase.joints_rad = joints_rad;
  phase.speed_mps = 0.3;
  phase.tolerance_m = 1e-6;  // never near enough: it goes on trying
  phase.timeout_s = 60;
  return phase;
}

/// @return how far the hand has stopped short of where it was meant to be, in its worst joint.
double missing_rad(const LimbImpedance& limb, const Person& person) {
  const JointVector goal = test::kMidPosture + JointVector(0.2, 0.15, -0.3);
  HandOnDevice hand(limb, person, {go_on_to(goal)});
  hand.run(20);
  return (hand.device.truth().joint_rad - goal).cwiseAbs().maxCoeff();
}

TEST(Person, ALightHandReachesItsTargetInSpiteOfFrictionOnlyWhereItLooks) {
  const LimbImpedance light{0.2, 1.5, 15, 3e-3, 0.05, 0.3};
  Person looks;
  looks.corrects = true;
  const double blind = missing_rad(light, {}), seeing = missing_rad(light, looks);
  EXPECT_GT(blind, 0.02) << "or there is no friction to overcome";
  EXPECT_LT(seeing, 0.2 * blind);
}

TEST(Person, GivesWayInAHoldThatAnExactHandKeeps) {
  Phase press;
  press.kind = PhaseKind::kPress;
  press.direction = PlanarVector(1, 0);
  press.speed_mps = 0.05;
  press.force_N = 1;
  press.duration_s = 60;
  press.timeout_s = 100;
  Person tires;
  tires.give_way = 0.3;
  tires.give_way_s = 10;
  const auto given_m = [&](const Person& person) {
    HandOnDevice hand(test::steady_limb(), person, {press});
    hand.run(1);                        // towards it
    hand.felt_N = PlanarVector(-1, 0);  // at once as much as was meant
    while (!hand.plan.holding() && to_seconds(hand.now) < 10) hand.run(0.001);
    EXPECT_TRUE(hand.plan.holding());
    const PlanarVector held_N = hand.intent.push_N;
    hand.run(40);
    return (hand.intent.push_N - held_N).norm() / HandOnDevice::kPress_N_per_m;
  };
  EXPECT_EQ(given_m({}), 0);
  const double meant_m = press.force_N / HandOnDevice::kPress_N_per_m;
  EXPECT_NEAR(given_m(tires), 0.3 * (1 - std::exp(-4)) * meant_m, 0.05 * meant_m);
}

TEST(Person, LimbPullsNoHarderThanItIsStrong) {
  LimbImpedance limb = test::steady_limb();
  limb.strength_N = 2;
  for (const double grip : {1.0, 0.15}) {
    HidPair cable;
    DeviceDescription smooth = test::desk_device();
    smooth.friction_Nm = smooth.cogging_Nm = {};
    HandAndDevice hand(smooth, limb, cable.device(), 3, test::kMidPosture);
    OperatorIntent intent;
    intent.presence = true;
    intent.grip = grip;
    intent.joint_rad = test::kMidPosture + JointVector(0.5, -0.5, 0);  // some 0.08 m away, the finger's angle the same
    double strongest_N = 0;
    for (int k = 1; k < 20; ++k) {
      cable.advance();
      hand.step(Time(k * 1ms), intent);
      const PlanarVector inertia_N = limb.mass_kg * grip * hand.truth().tip_mps / (k * kTick_s);
      strongest_N = std::max(strongest_N, inertia_N.norm());
    }
    EXPECT_LT(strongest_N, 1.1 * 2 * grip);
    EXPECT_GT(strongest_N, 0.5 * 2 * grip);
  }
}

TEST(Person, WristTwistsNoHarderThanItIsStrong) {
  DeviceDescription smooth = test::desk_device();
  smooth.friction_Nm = smooth.cogging_Nm = {};
  const auto turned_rad = [&](double strength_N) {
    LimbImpedance limb = test::steady_limb();
    limb.strength_N = strength_N;
    limb.stiffness_N_per_m = limb.damping_Ns_per_m = 0;
    HidPair cable;
    HandAndDevice hand(smooth, limb, cable.device(), 3, test::kMidPosture);
    OperatorIntent intent;
    intent.presence = true;
    intent.joint_rad = test::kMidPosture + JointVector(0, 0, 0.5);  // 2 Nm
    for (int k = 1; k < 20; ++k) {
      cable.advance();
      hand.step(Time(k * 1ms), intent);
    }
    return (hand.truth().joint_rad - test::kMidPosture).sum();
  };
  EXPECT_LT(turned_rad(2), 0.25 * turned_rad(1000)) << "0.29 of 2 Nm";
  EXPECT_GT(turned_rad(2), 0.05 * turned_rad(1000));
}

}  // namespace
}  // namespace knuckle::sim
