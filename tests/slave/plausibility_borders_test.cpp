// The rules of plausibility stated again as numbers, on a machine whose directions, areas and chambers all differ: when
// each speaks, to the step, and what it says.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "slave/plausibility.h"
#include "tests/slave/reasons.h"
#include "tests/slave/test_machine.h"

namespace knuckle::slave {
namespace {

constexpr double kCheckStep_s = 0.005;
constexpr double kTank_Pa = 2e5, kBulk_Pa = 0.9e9, kHose_m3 = 0.15e-3;
constexpr double kExtendBand = 0.08, kRetractBand = 0.16;
constexpr double kForever = 3;  // seconds in which a rule that is to be quiet is given its chance

MachineDescription uneven_machine() {
  MachineDescription m = test::identified_machine();
  for (CylinderDescription& cylinder : m.cylinders) {
    cylinder.valve.dead_band_extend = kExtendBand;
    cylinder.valve.dead_band_retract = kRetractBand;
  }
  m.cylinders[kArm].rod_m = 0.030;
  m.cylinders[kBucket].valve.nominal_flow_m3ps = 0.4e-3;
  return m;
}

/// Measurements as the test says; only the last digit of the pressures lives, so that no transmitter seems stuck.
class PlausibilityBorders : public ::testing::Test {
 protected:
  PlausibilityBorders() { fresh(); }
  void fresh() {
    plausibility = Plausibility(machine, kCheckStep_s);
    for (int i = 0; i < kJoints; ++i) {
      const CylinderDescription& c = machine.cylinders[static_cast<std::size_t>(i)];
      m.cylinder_m[i] = 0.4 * c.min_length_m + 0.6 * c.max_length_m;
    }
    pressure_Pa = {60e5, 20e5, 50e5, 25e5, 40e5, 20e5};
    spool.setZero();
    steps = 0;
  }
  Reason step() {
    ++steps;
    for (std::size_t i = 0; i < 6; ++i) m.pressure_Pa[i] = pressure_Pa[i] + (live ? 10 * (steps % 2) : 0);
    return plausibility.step(m, spool, {});
  }
  /// Steps until something is found; 0: nothing within so long.
  int found_after(double patience_s = kForever, const std::function<void()>& before_each = {}) {
    for (int n = 1; n * kCheckStep_s <= patience_s; ++n) {
      if (before_each) before_each();
      found = step();
      if (found) return n;
    }
    return 0;
  }
  const CylinderDescription& cylinder(int joint) const { return machine.cylinders[static_cast<std::size_t>(joint)]; }
  static double band(bool extends) { return extends ? kExtendBand : kRetractBand; }
  double& returning_Pa(int joint, bool extends) { return pressure_Pa[static_cast<std::size_t>(2 * joint + extends)]; }
  double& driven_Pa(int joint, bool extends) { return pressure_Pa[static_cast<std::size_t>(2 * joint + !extends)]; }
  double returning_area_m2(int joint, bool extends) const {
    const CylinderDescription& c = cylinder(joint);
    const double rod_m = extends ? c.rod_m : 0;
    return std::numbers::pi / 4 * (c.bore_m * c.bore_m - rod_m * rod_m);
  }
  double returning_volume_m3(int joint, bool extends) const {
    const CylinderDescription& c = cylinder(joint);
    const double filled_m = extends ? c.max_length_m - m.cylinder_m[joint] : m.cylinder_m[joint] - c.min_length_m;
    return kHose_m3 + returning_area_m2(joint, extends) * filled_m;
  }
  /// Travel that the valve surely lets out in a step.
  double delivered_m(int joint, bool extends, double stroke) {
    const double opening = (stroke - band(extends)) / (1 - band(extends));
    const double drop_Pa = std::max(0.0, returning_Pa(joint, extends) - kTank_Pa - 2e5);
    const double flow = 0.7 * opening * cylinder(joint).valve.nominal_flow_m3ps * std::sqrt(drop_Pa / 15e5);
    return flow / returning_area_m2(joint, extends) * kCheckStep_s;
  }
  void open(int joint, bool extends, double stroke) { spool[joint] = extends ? stroke : -stroke; }
  void expect_encoder(int joint, double value, double limit) const {
    EXPECT_TRUE(test::is(found, ReasonCode::kSensorImplausible, 0x30 + joint));
    EXPECT_NEAR(found.value, value, 1e-6 * (1 + value)) << text(found);
    EXPECT_NEAR(found.limit, limit, 1e-7) << text(found);
  }
  void each_way(const std::function<void(int, bool)>& check) {
    for (int joint = 0; joint < kJoints; ++joint) {
      for (const bool extends : {true, false}) {
        SCOPED_TRACE(std::string(kJointNames[static_cast<std::size_t>(joint)]) + (extends ? " extends" : " retracts"));
        fresh();
        check(joint, extends);
      }
    }
  }

  MachineDescription machine = uneven_machine();
  Plausibility plausibility{machine, kCheckStep_s};
  estimation::Measurement m;
  std::array<double, 6> pressure_Pa{};
  JointVector spool = JointVector::Zero();
  bool live = true;
  int steps = 0;
  Reason found;
};

// ---- an encoder that does not see what the valve lets through

TEST_F(PlausibilityBorders, UnseenTravelIsWhatTheReturnEdgeSurelyLetsOut) {
  each_way([this](int joint, bool extends) {
    open(joint, extends, 0.5);
    const double each_m = delivered_m(joint, extends, 0.5);
    const int expected = 2 + static_cast<int>(std::floor(0.004 / each_m));  // the first step only looks
    EXPECT_EQ(found_after(), expected);
    expect_encoder(joint, (expected - 1) * each_m, 0.004);
  });
}

TEST_F(PlausibilityBorders, ACylinderThatIsDrivenToTheReliefMayStandButDeliversNothing) {
  each_way([this](int joint, bool extends) {
    open(joint, extends, 0.5);
    driven_Pa(joint, extends) = 200e5;
    returning_Pa(joint, extends) = kTank_Pa + 2e5 - 100;  // no drop that is sure
    EXPECT_EQ(found_after(), 0);
    returning_Pa(joint, extends) = kTank_Pa + 4e5;  // oil comes: it moves
    EXPECT_NE(found_after(), 0);
    EXPECT_NEAR(found.limit, 0.004, 1e-7);
  });
}

TEST_F(PlausibilityBorders, OilThatExpandsIsTakenOffButNoneIsAddedWherePressureRises) {
  each_way([this](int joint, bool extends) {
    for (const double change_Pa : {-60e5, 60e5}) {
      fresh();
      returning_Pa(joint, extends) = 100e5;
      open(joint, extends, 0.3);
      (void)step();
      returning_Pa(joint, extends) += change_Pa;
      const double each_m = delivered_m(joint, extends, 0.3);
      const double expanded_m = std::max(0.0, -change_Pa) * returning_volume_m3(joint, extends) /
                                (kBulk_Pa * returning_area_m2(joint, extends));
      const int expected = 1 + static_cast<int>(std::floor((0.004 + expanded_m) / each_m));
      EXPECT_EQ(found_after(), expected) << change_Pa;
      expect_encoder(joint, expected * each_m - expanded_m, 0.004);
    }
  });
}

TEST_F(PlausibilityBorders, OpenBeginsFourPercentBeyondTheDirectionsOwnDeadBand) {
  each_way([this](int joint, bool extends) {
    open(joint, extends, band(extends) + 0.04);
    EXPECT_EQ(found_after(), 0) << "is not open yet";
    open(joint, extends, band(extends) + 0.0401);
    EXPECT_NE(found_after(), 0);
  });
}

TEST_F(PlausibilityBorders, NothingIsExpectedTenMillimetresBeforeTheEndItGoesTo) {
  each_way([this](int joint, bool extends) {
    const CylinderDescription& c = cylinder(joint);
    const auto from_end = [&](double left_m) { return extends ? c.max_length_m - left_m : c.min_length_m + left_m; };
    open(joint, extends, 0.5);
    m.cylinder_m[joint] = from_end(0.0099);
    EXPECT_EQ(found_after(), 0);
    m.cylinder_m[joint] = from_end(0.010);
    EXPECT_NE(found_after(), 0) << "is not at its end yet";
    fresh();  // away from the end it stands at
    open(joint, extends, 0.5);
    m.cylinder_m[joint] = extends ? c.min_length_m : c.max_length_m;
    EXPECT_NE(found_after(), 0);
  });
}

TEST_F(PlausibilityBorders, AnEncoderHasMovedByThreeAndAHalfSteps) {
  for (const double step_m : {1e-5, 1e-4, 3e-4}) {
    machine.sensors.encoder_step_m = step_m;
    const double moved_m = std::max(0.00035, 3.5 * step_m);
    each_way([&](int joint, bool extends) {
      const double at_m = m.cylinder_m[joint];
      open(joint, extends, 0.5);
      const auto there_and_back = [&](double by_m) {
        return [&, by_m] { m.cylinder_m[joint] = at_m + (steps % 2 == 0 ? 0 : by_m); };
      };
      EXPECT_EQ(found_after(kForever, there_and_back(1.01 * moved_m)), 0) << step_m;
      EXPECT_EQ(found_after(kForever, there_and_back(-1.01 * moved_m)), 0) << step_m;
      EXPECT_NE(found_after(kForever, there_and_back(0.99 * moved_m)), 0) << step_m;
    });
  }
}

TEST_F(PlausibilityBorders, WhatWasDeliveredIsForgottenWithEveryTurnAndPauseOfATenthOfASecond) {
  each_way([this](int joint, bool extends) {
    const double each_m = delivered_m(joint, extends, 0.5);
    const int enough = static_cast<int>(0.004 / each_m);
    for (const auto& [between, steps_between] : {std::pair{0.0, 20}, std::pair{extends ? -0.5 : 0.5, 1}}) {
      open(joint, extends, 0.5);
      for (int i = 0; i < enough; ++i) ASSERT_FALSE(step());
      spool[joint] = between;
      for (int i = 0; i < steps_between; ++i) ASSERT_FALSE(step());
    }
    open(joint, extends, 0.5);
    EXPECT_EQ(found_after(), 2 + enough);
  });
}

TEST_F(PlausibilityBorders, ASpoolThatPassesThroughItsDeadBandForgetsNothing) {
  each_way([this](int joint, bool extends) {
    open(joint, extends, 0.5);
    const int enough = static_cast<int>(0.004 / delivered_m(joint, extends, 0.5));
    for (int i = 0; i < enough; ++i) ASSERT_FALSE(step());
    spool[joint] = 0;
    for (int i = 0; i < 19; ++i) ASSERT_FALSE(step()) << "nothing flows meanwhile";
    open(joint, extends, 0.5);
    EXPECT_EQ(found_after(), 2);
  });
}

TEST_F(PlausibilityBorders, AnAxisThatIsNotDrivenAsAStalledOneMustMoveWithinEightTenthsOfASecond) {
  each_way([this](int joint, bool extends) {
    returning_Pa(joint, extends) = kTank_Pa;
    open(joint, extends, 0.5);
    driven_Pa(joint, extends) = 0.6 * 205e5 - 20;
    const int after = found_after();
    EXPECT_NEAR(after, 1 + 161, 1);  // sums of 5 ms round
    expect_encoder(joint, (after - 1) * kCheckStep_s, 0.8);
    fresh();
    returning_Pa(joint, extends) = kTank_Pa;
    open(joint, extends, 0.5);
    driven_Pa(joint, extends) = 0.6 * 205e5 + 20;
    EXPECT_EQ(found_after(), 0);
    fresh();  // at the border itself
    returning_Pa(joint, extends) = kTank_Pa;
    open(joint, extends, 0.5);
    driven_Pa(joint, extends) = 0.6 * 205e5;
    live = false;
    EXPECT_NE(found_after(), 0) << "is not driven as a stalled one yet";
    live = true;
    fresh();  // the time counts without a break only
    returning_Pa(joint, extends) = kTank_Pa;
    open(joint, extends, 0.5);
    driven_Pa(joint, extends) = 50e5;
    for (int i = 0; i < 150; ++i) ASSERT_FALSE(step());
    driven_Pa(joint, extends) = 150e5;
    ASSERT_FALSE(step());
    driven_Pa(joint, extends) = 50e5;
    for (int i = 0; i < 150; ++i) ASSERT_FALSE(step());
  });
}

TEST_F(PlausibilityBorders, TimeAtTheBorderItselfIsNotOver) {
  each_way([this](int joint, bool extends) {
    const auto others_at_zero = [&] {  // where the first step has nothing to compare with
      for (int i = 0; i < kJoints; ++i) m.cylinder_m[i] *= i == joint;
    };
    others_at_zero();
    plausibility = Plausibility(machine, 0.8);  // a step as long as an axis may stand behind an open valve
    returning_Pa(joint, extends) = kTank_Pa;
    open(joint, extends, 0.5);
    ASSERT_FALSE(step());
    EXPECT_FALSE(step());
    EXPECT_TRUE(step());
    fresh();
    others_at_zero();
    plausibility = Plausibility(machine, 0.15);  // a step as long as cylinders need to stop
    open(joint, extends, 0.5);
    ASSERT_FALSE(step());
    spool[joint] = 0;
    m.cylinder_m[joint] += 0.02;
    EXPECT_TRUE(step()) << "stands still from now on";
  });
}

// ---- a cylinder that moves behind a closed valve

TEST_F(PlausibilityBorders, TravelBehindAClosedValveIsSummedAfterItHasSettledAndForgottenInASecond) {
  each_way([this](int joint, bool extends) {
    const double each_m = (extends ? 1 : -1) * 0.1 * kCheckStep_s;
    open(joint, extends, band(extends) - 0.0301);
    const auto moves = [&] { m.cylinder_m[joint] += each_m; };
    // Closed for 0.15 s first; the very first step has nothing to compare with.
    int expected = 0;
    double travel_m = 0, closed_s = 0;
    for (int n = 1; expected == 0; ++n) {
      closed_s += kCheckStep_s;
      if (closed_s < 0.15) continue;
      travel_m += std::abs(each_m) - travel_m * kCheckStep_s / 1.0;
      if (travel_m > 0.015) expected = n;
    }
    EXPECT_EQ(found_after(kForever, moves), expected);
    expect_encoder(joint, travel_m, 0.015);
  });
}

TEST_F(PlausibilityBorders, TravelIsOfThatCylinderAndSumsFromItsFirstLength) {
  each_way([this](int joint, bool) {
    plausibility.reset();
    m.cylinder_m[joint] += 0.05;  // another length than before the reset
    EXPECT_EQ(found_after(), 0);
    m.cylinder_m[joint] += 0.0151;  // at once: half a second is too short to forget it
    EXPECT_EQ(found_after(), 1);
    expect_encoder(joint, 0.0151, 0.015);
    fresh();
    EXPECT_EQ(found_after(), 0);
    m.cylinder_m[joint] -= 0.0149;
    EXPECT_EQ(found_after(), 0);
  });
}

TEST_F(PlausibilityBorders, TravelIsForgottenWhenTheValveOpens) {
  each_way([this](int joint, bool) {
    EXPECT_EQ(found_after(0.3), 0);
    for (int i = 0; i < 2; ++i) {
      m.cylinder_m[joint] += 0.012;
      EXPECT_EQ(found_after(0.02), 0) << i;
      spool[joint] = 0.1;
      EXPECT_EQ(found_after(0.02), 0);
      spool[joint] = 0;
      EXPECT_EQ(found_after(0.2), 0);
    }
  });
}

// Lengths near 0 are no machine's, but their differences are exact.
TEST_F(PlausibilityBorders, ALengthAtTheBorderItselfIsWell) {
  for (int joint = 0; joint < kJoints; ++joint) {
    fresh();
    m.cylinder_m[joint] = 0;
    EXPECT_EQ(found_after(0.3), 0);
    m.cylinder_m[joint] = 0.015;
    EXPECT_EQ(found_after(0.3), 0) << "no travel behind a closed valve yet";
    fresh();
    open(joint, true, 0.5);
    EXPECT_EQ(found_after(kForever, [&] { m.cylinder_m[joint] = steps % 2 == 0 ? 0 : 0.00035; }), 0) << "has moved";
    fresh();
    spool[joint] = 0.1;
    live = false;
    m.cylinder_m[joint] = 0;
    ASSERT_FALSE(step());
    m.cylinder_m[joint] = 0.005;
    EXPECT_EQ(found_after(), 0) << "too little to say that a pressure is stuck";
    live = true;
  }
}

TEST_F(PlausibilityBorders, AValveIsClosedThreePercentInsideTheDirectionsOwnDeadBand) {
  each_way([this](int joint, bool extends) {
    const auto moves = [&] { m.cylinder_m[joint] += (extends ? 1 : -1) * 0.05 * kCheckStep_s; };
    open(joint, extends, band(extends) - 0.03);
    EXPECT_EQ(found_after(kForever, [&] { m.cylinder_m[joint] += 0.05 * kCheckStep_s; }), 0) << "is not closed yet";
    fresh();
    open(joint, extends, band(extends) - 0.0301);
    EXPECT_NE(found_after(kForever, moves), 0);
  });
}

TEST_F(PlausibilityBorders, AClosedCylinderMayBePushedThroughEitherRelief) {
  each_way([this](int joint, bool head) {
    const auto moves = [&] { m.cylinder_m[joint] += 0.05 * kCheckStep_s; };
    double& pushed_Pa = pressure_Pa[static_cast<std::size_t>(2 * joint + (head ? 0 : 1))];
    pushed_Pa = 0.9 * 230e5 + 20;
    EXPECT_EQ(found_after(1, moves), 0);
    pushed_Pa = 0.9 * 230e5 - 10;  // and at times at the border itself
    EXPECT_NE(found_after(1, moves), 0);
  });
}

// ---- a transmitter that repeats itself

TEST_F(PlausibilityBorders, ATransmitterThatRepeatsItselfIsFoundOnceItsNeighbourHasChanged) {
  for (const bool noisy : {true, false}) {
    machine.sensors.pressure_noise_Pa = (noisy ? 0.5 : 0.499) * machine.sensors.pressure_step_Pa;
    const int repeats = noisy ? 20 : 100;
    for (std::size_t chamber = 0; chamber < 6; ++chamber) {
      for (const double change_Pa : {5e5, 5e5 + 100, -5e5, -5e5 - 100}) {
        fresh();
        live = false;
        const std::size_t other = chamber ^ 1U;
        const double still_Pa = pressure_Pa[other];
        const int after = found_after(kForever, [&] {
          pressure_Pa[other] = still_Pa + (steps % 2 == 0 ? 0 : change_Pa);
          for (std::size_t i = 0; i < 6; ++i) {
            if (i / 2 != chamber / 2) pressure_Pa[i] += steps % 2 == 0 ? 10 : -10;
          }
        });
        live = true;
        ASSERT_EQ(after, std::abs(change_Pa) > 5e5 ? repeats + 1 : 0) << chamber << " " << change_Pa;
        if (after == 0) continue;
        const int node = 0x20 + static_cast<int>(chamber);
        test::expect_reason(found, ReasonCode::kSensorImplausible, node, repeats, repeats, 0);
      }
    }
  }
}

TEST_F(PlausibilityBorders, ATransmitterThatRepeatsItselfIsFoundOnceTheCylinderHasMoved) {
  for (const double way_m : {0.0049, 0.0051, -0.0049, -0.0051}) {
    for (int joint = 0; joint < kJoints; ++joint) {
      fresh();
      spool[joint] = 0.1;  // neither open nor closed
      live = false;
      for (int i = 0; i < 5; ++i) ASSERT_FALSE(step());
      m.cylinder_m[joint] += way_m;
      const auto others = [&] {
        for (std::size_t i = 0; i < 6; ++i) {
          if (i != static_cast<std::size_t>(2 * joint)) pressure_Pa[i] += steps % 2 == 0 ? 10 : -10;
        }
      };
      EXPECT_EQ(found_after(0.5, others) != 0, std::abs(way_m) > 0.005) << way_m << " " << joint << text(found);
      live = true;
    }
  }
}

TEST_F(PlausibilityBorders, AnEmptyChamberMayStandAtOneValue) {
  live = false;
  for (const double value_Pa : {3e5 - 100, 3e5}) {
    fresh();
    pressure_Pa[0] = value_Pa;
    const double still_Pa = pressure_Pa[1];
    EXPECT_EQ(found_after(1, [&] { pressure_Pa[1] = still_Pa + (steps % 2 == 0 ? 0 : 10e5); }) != 0, value_Pa >= 3e5);
  }
  live = true;
}

TEST_F(PlausibilityBorders, ResetForgetsEverything) {
  open(kBoom, true, 0.5);
  const int after = found_after();
  ASSERT_NE(after, 0);
  plausibility.reset();
  EXPECT_EQ(found_after(), after);
  // A cylinder that was somewhere else before the reset has not moved since, and no pressure has repeated itself.
  fresh();
  live = false;
  const auto neighbours = [this] {
    for (std::size_t i = 1; i < 6; ++i) pressure_Pa[i] += steps % 2 == 0 ? 10e5 : -10e5;
  };
  ASSERT_EQ(found_after(18 * kCheckStep_s, neighbours), 0);
  plausibility.reset();
  m.cylinder_m += JointVector::Constant(0.03);
  EXPECT_EQ(found_after(20 * kCheckStep_s, neighbours), 0);
  live = true;
}

}  // namespace
}  // namespace knuckle::slave
