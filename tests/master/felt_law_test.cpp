#include "master/felt_law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "machine/load.h"
#include "tests/master/master_rig.h"
#include "tests/support/no_alloc.h"

namespace knuckle::master {
namespace {

constexpr double kStep_s = 1e-3;
constexpr double kMostSlew_N_per_ms = 0.5;

const DeviceDescription::Feel& feel() {
  static const DeviceDescription shipped = load_device(find_config("device", "knuckle1"));
  return shipped.feel;
}

/// A machine that presses on the ground with 2 N at the hand, heard well.
FeltInputs pressing() {
  FeltInputs in;
  in.machine_m = PlanarVector(0, 0.002);
  in.reflected_N = PlanarVector(0, 2);
  in.ahead_m = PlanarVector(0, -0.002);
  in.confidence = 1;
  in.round_trip_s = 0.02;
  in.engaged = true;
  return in;
}

struct Rig {
  explicit Rig(ControlLaw law) : felt(law, feel()) {}
  void run(double seconds) {
    for (int i = 0; i < int(seconds * 1e3 + 0.5); ++i) {
      if (silent) in.silence_s += kStep_s;
      const PlanarVector before_N = force_N;
      force_N = felt.step(in, kStep_s);
      slew_N_per_ms = std::max(slew_N_per_ms, (force_N - before_N).norm());
      const bool now_on = static_cast<bool>(felt.downgraded());
      changes += now_on != on;
      on = now_on;
    }
  }
  FeltLaw felt;
  FeltInputs in = pressing();
  PlanarVector force_N = PlanarVector::Zero();
  double slew_N_per_ms = 0;
  int changes = 0;
  bool on = false, silent = false;
};

TEST(ControlLawNames, AreFoundAgainAndNothingElseIs) {
  for (const char* law : kControlLawNames) {
    ASSERT_TRUE(control_law_named(law));
    EXPECT_STREQ(name(*control_law_named(law)), law);
    EXPECT_EQ(FeltLaw(*control_law_named(law), feel()).law(), *control_law_named(law));
  }
  EXPECT_FALSE(control_law_named("telepathy"));
  EXPECT_FALSE(control_law_named(""));
}

TEST(ControlLawNames, OfThemAllButDirectLeadAMachine) {
  for (const char* law : kControlLawNames)
    EXPECT_EQ(leading_law_named(law).has_value(), control_law_named(law) != ControlLaw::kDirect) << law;
  EXPECT_FALSE(leading_law_named("tdpa"));
}

TEST(FeltLaw, IsTheEchoSpringWhereAllIsWell) {
  Rig rig(ControlLaw::kEchoSpring);
  EchoSpring alone(feel());
  for (int i = 0; i < 3000; ++i) {
    rig.in.hand_m = PlanarVector(0, -1e-6 * i);
    rig.run(kStep_s);
    ASSERT_EQ(rig.force_N, alone.step(rig.in, kStep_s)) << i;
  }
  EXPECT_GT(rig.force_N.norm(), 1);
}

TEST(FeltLaw, NoLawAllocatesOrRendersAForceWhileNotEngaged) {
  for (const char* name : kControlLawNames) {
    Rig rig(*control_law_named(name));
    rig.in.engaged = false;
    rig.in.hand_mps = PlanarVector(0.1, 0);
    test::NoAllocScope scope;
    rig.run(1);
    const double idle_N = rig.force_N.norm();
    rig.in.engaged = true;
    rig.run(0.5);
    const std::uint64_t allocations = scope.allocations();
    EXPECT_EQ(idle_N, 0) << name;
    EXPECT_LE(rig.force_N.norm(), feel().force_limit_N) << name;
    EXPECT_EQ(allocations, 0u) << name;
  }
}

TEST(FeltLaw, ShowsTheMachineAllOfItsForceButNoCue) {
  for (const char* name : kControlLawNames) {
    Rig rig(*control_law_named(name));
    rig.in.reflected_N = PlanarVector(0, 6);  // an overload, which cues repeat
    double most_N = 0;
    for (int i = 0; i < 500; ++i) {
      rig.run(kStep_s);
      most_N = std::max(most_N, rig.force_N.norm());
      ASSERT_EQ(rig.felt.rendered_N(), rig.felt.law() == ControlLaw::kCues ? PlanarVector::Zero() : rig.force_N)
          << name;
    }
    EXPECT_GT(most_N, 0.5) << name;
  }
}

TEST(Downgrade, FadesToCuesAndBackWithoutAStepInForce) {
  struct Sickness {
    ReasonCode code;
    void (*begin)(Rig&);
    void (*end)(Rig&);
  };
  const Sickness sicknesses[] = {
      {ReasonCode::kCuesDelay, [](Rig& r) { r.in.round_trip_s = 0.47; }, [](Rig& r) { r.in.round_trip_s = 0.1; }},
      {ReasonCode::kCuesSilence, [](Rig& r) { r.silent = true; },
       [](Rig& r) {
         r.silent = false;
         r.in.silence_s = 0;
       }},
      {ReasonCode::kCuesLoss, [](Rig& r) { r.in.lost_share = 0.8; }, [](Rig& r) { r.in.lost_share = 0; }},
      {ReasonCode::kCuesEstimate, [](Rig& r) { r.in.confidence = 0.05; }, [](Rig& r) { r.in.confidence = 1; }}};
  for (const Sickness& sick : sicknesses) {
    SCOPED_TRACE(name(sick.code));
    Rig rig(ControlLaw::kEchoSpring);
    rig.in.hand_m = PlanarVector(0, 0.0005);
    rig.run(3);
    ASSERT_GT(rig.force_N.norm(), 1);
    rig.slew_N_per_ms = 0;
    sick.begin(rig);
    rig.run(6);
    EXPECT_EQ(rig.felt.downgraded().code, sick.code);
    EXPECT_LT(rig.force_N.norm(), 1e-9);  // the press began long ago: no cue
    sick.end(rig);
    rig.run(6);
    EXPECT_FALSE(rig.felt.downgraded());
    EXPECT_GT(rig.force_N.norm(), 1);
    EXPECT_EQ(rig.changes, 2);
    EXPECT_LT(rig.slew_N_per_ms, kMostSlew_N_per_ms);
  }
}

TEST(Downgrade, DoesNotFlapWhereAValueWandersAboutABound) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> wander;
  Rig rig(ControlLaw::kEchoSpring);
  double round_trip_s = Downgrade::kRoundTrip_s.on;
  for (int i = 0; i < 120'000; ++i) {
    round_trip_s += 0.02 * (Downgrade::kRoundTrip_s.on - round_trip_s) + 0.005 * wander(random);
    rig.in.round_trip_s = round_trip_s;
    rig.run(kStep_s);
  }
  EXPECT_LE(rig.changes, 1);
  EXPECT_LT(rig.slew_N_per_ms, kMostSlew_N_per_ms);
}

TEST(Downgrade, NeedsItsTimeAndForgetsOnceNothingIsLed) {
  Rig rig(ControlLaw::kEchoSpring);
  rig.in.round_trip_s = 1;
  rig.run(Downgrade::kRoundTrip_s.on_s - 0.01);
  EXPECT_FALSE(rig.felt.downgraded());
  rig.run(0.02);
  EXPECT_TRUE(rig.felt.downgraded());
  rig.in.engaged = false;
  rig.run(kStep_s);
  EXPECT_FALSE(rig.felt.downgraded());
}

TEST(Downgrade, IsAWarningOfTheLoopOverALinkAsLongAsThis) {
  for (const Duration one_way : {200ms, 235ms}) {
    test::MasterRig rig(ControlLaw::kEchoSpring, one_way);
    rig.engage();
    rig.run(4);
    const ReasonCode expected = one_way > 225ms ? ReasonCode::kCuesDelay : ReasonCode::kNone;
    EXPECT_EQ(rig.loop.warning().code, expected);
  }
}

TEST(Downgrade, ShowsTheMachineNothingOnceOnlyCuesAreLeft) {
  Rig rig(ControlLaw::kEchoSpring);
  rig.in.reflected_N = PlanarVector(0, 6);
  rig.run(3);
  EXPECT_GT(rig.felt.rendered_N().norm(), 1);
  rig.in.lost_share = 0.8;
  rig.run(3);
  double most_N = 0;
  for (int i = 0; i < 500; ++i) {
    rig.run(kStep_s);
    most_N = std::max(most_N, rig.force_N.norm());
    ASSERT_EQ(rig.felt.rendered_N().norm(), 0);
  }
  EXPECT_GT(most_N, 0.5) << "the cue of an overload";
}

TEST(Downgrade, LeavesTheCautionaryBaselineAsItIs) {
  Rig rig(ControlLaw::kDirect);
  rig.in.round_trip_s = 1;
  rig.run(5);
  EXPECT_FALSE(rig.felt.downgraded());
  EXPECT_EQ(rig.force_N, rig.in.reflected_N);
}

TEST(Cues, AreSmallSmoothAndWithoutMeanWhateverTheForceDoes) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  Rig rig(ControlLaw::kCues);
  PlanarVector sum = PlanarVector::Zero();
  double most_N = 0;
  for (int i = 0; i < 60'000; ++i) {
    if (i % 400 == 0) rig.in.reflected_N = PlanarVector(6 * normal(random), 6 * normal(random));
    if (i % 900 == 0) rig.in.load_N = PlanarVector(0, normal(random));
    rig.run(kStep_s);
    sum += rig.force_N;
    most_N = std::max(most_N, rig.force_N.norm());
  }
  EXPECT_GT(most_N, 0.3);
  EXPECT_LE(most_N, 0.8);
  EXPECT_LT(rig.slew_N_per_ms, 0.3);
  EXPECT_LT(sum.norm() / 60'000, 0.01);
}

TEST(Cues, TellContactOnceUntilItWasOver) {
  Rig rig(ControlLaw::kCues);
  rig.in.reflected_N.setZero();
  int begins = 0;
  Cue last = Cue::kNone;
  const auto run = [&](double seconds, double force_N) {
    rig.in.reflected_N = PlanarVector(0, force_N);
    for (int i = 0; i < int(seconds * 1e3); ++i) {
      rig.run(kStep_s);
      const Cue cue = rig.felt.cue();
      begins += cue == Cue::kContact && last != Cue::kContact;
      last = cue;
    }
  };
  run(0.5, 0);
  EXPECT_EQ(begins, 0);
  run(1, 1);
  run(0.1, 0);  // a bounce is the same contact
  run(1, 1);
  EXPECT_EQ(begins, 1);
  run(1, 0);
  run(1, 1);
  EXPECT_EQ(begins, 2);
}

TEST(Cues, RepeatAnOverloadForAsLongAsItLasts) {
  Rig rig(ControlLaw::kCues);
  rig.in.reflected_N = PlanarVector(0, 0.6 * feel().force_limit_N);
  rig.run(2);
  EXPECT_EQ(rig.felt.cue(), Cue::kOverload);
  rig.in.reflected_N = PlanarVector(0, 0.2 * feel().force_limit_N);
  rig.run(1);
  EXPECT_EQ(rig.felt.cue(), Cue::kNone);
}

}  // namespace
}  // namespace knuckle::master
