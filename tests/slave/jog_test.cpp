// First motions of one valve at a time against the simulated nodes; what matters is read off the wire.
#include "slave/jog.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/slave/jog_bench.h"
#include "tests/support/no_alloc.h"

namespace knuckle::slave {
namespace {

using Phase = Jog::Phase;

struct JogRig : JogBench {
  /// The boom moves by this, with its valve open.
  void moving(const JogPlan& plan = {.joint = kBoom, .peak = 0.3, .rise_1ps = 0.1, .travel_m = 1}) {
    start();
    jog.move(plan);
    for (int i = 0; i < 1000 && (samples.empty() || std::abs(samples.back().command) < 0.2); ++i) step();
    ASSERT_EQ(jog.phase(), Phase::kMoving);
  }
  /// As the enable node says it: pilot pressure is off although its chain is closed.
  void report_no_pilot() {
    bench.run(4ms);  // behind what it says to this SYNC itself
    const std::uint32_t id = bench.description.bus.enable().tpdo_id();
    ASSERT_TRUE(bench.bus.port(1).send(canopen::enable_inputs_frame(id, canopen::kInputEStopClosed)));
  }
  /// Since then every valve was told to be neutral at once, the enable output went off, and nothing came after it.
  void expect_off_since(Time since, Duration limit = 10ms) const {
    for (int i = 0; i < kJoints; ++i) {
      const Time neutral = bench.command_neutral_since(since, i);
      ASSERT_NE(neutral, kNever) << i;
      EXPECT_LE(to_seconds(neutral - since), to_seconds(limit)) << i;
    }
    EXPECT_FALSE(bench.nodes.outputs().pilot);
    EXPECT_EQ(bench.nodes.outputs().spool_demand, JointVector(0, 0, 0));
  }
};

TEST(Jog, MovesOneCylinderSlowlyAndGivesBackPilotPressure) {
  for (int joint = 0; joint < kJoints; ++joint) {
    for (const double sign : {1.0, -1.0}) {
      JogRig rig;
      rig.start();
      const JointVector before = rig.bench.signals.cylinder_m;
      rig.jog.move({.joint = joint, .peak = sign * 0.35, .travel_m = 0.015});
      rig.finish();
      EXPECT_FALSE(rig.jog.trouble()) << text(rig.jog.trouble());
      EXPECT_EQ(rig.jog.end(), JogEnd::kTravelled);
      const JointVector way = rig.bench.signals.cylinder_m - before;
      for (int other = 0; other < kJoints; ++other) {
        EXPECT_NEAR(way[other], other == joint ? sign * 0.016 : 0, 0.003) << other;
      }
      double last = 0;
      for (const JogSample& s : rig.samples) {
        EXPECT_LE(std::abs(s.command), 0.35);
        EXPECT_NEAR(std::abs(s.command) - last, 0.05 * 0.005, 1e-9) << s.t_s;
        last = std::abs(s.command);
      }
      EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
    }
  }
}

TEST(Jog, EndsWhereItsTimeIsOverOrTheCylinderStandsAtItsStop) {
  JogRig rig;
  rig.start();
  rig.jog.move({.joint = kArm, .peak = 0.05, .longest_s = 2});  // within the dead band
  rig.finish();
  EXPECT_EQ(rig.jog.end(), JogEnd::kTime);
  EXPECT_NEAR(rig.samples.back().t_s, 2, 0.006);
  rig.samples.clear();
  rig.jog.move({.joint = kArm, .peak = 0.3, .rise_1ps = 0.1, .travel_m = 1, .longest_s = 80, .until_stall = true});
  rig.finish();
  EXPECT_EQ(rig.jog.end(), JogEnd::kStalled) << text(rig.jog.trouble());
  EXPECT_NEAR(rig.bench.signals.cylinder_m[kArm], rig.bench.description.cylinders[kArm].max_length_m, 1e-6);
}

TEST(Jog, EndsWhereTheCylinderMovesAgainstItsCommandWhereThatIsAsked) {
  JogRig rig;
  rig.moving({.joint = kBoom, .peak = 0.3, .rise_1ps = 0.1, .travel_m = 1, .back_m = 0.003});
  rig.bench.signals.cylinder_m[kBoom] -= 1;
  rig.finish();
  EXPECT_EQ(rig.jog.end(), JogEnd::kWrongWay);
  EXPECT_FALSE(rig.jog.trouble());
  EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
}

TEST(Jog, ValvesStayClosedWhilePilotPressureIsTried) {
  JogRig rig;
  rig.start();
  rig.jog.hold_pilot(500ms);
  rig.run(300ms);
  EXPECT_EQ(rig.jog.phase(), Phase::kHeld);
  EXPECT_TRUE(rig.bench.nodes.outputs().pilot);
  rig.finish();
  EXPECT_FALSE(rig.bench.nodes.outputs().pilot);
  for (int i = 0; i < kJoints; ++i) EXPECT_NE(rig.bench.command_neutral_since(Time{}, i), kNever);
  for (const auto& w : rig.bench.wire) {
    if (const auto command = canopen::parse_valve_command(w.frame);
        command && w.frame.id >= 0x210 && w.frame.id < 0x213) {
      EXPECT_EQ(command->set_point, 0);
    }
  }
}

/// What happens to a jog, what it says of that, and how soon it is neutral on the wire.
struct Mishap {
  enum class While { kMoving, kClosed, kBoth, kDrawnAlone };
  const char* name;
  ReasonCode code;
  void (*happen)(JogRig&);
  Duration limit;
  While when = While::kBoth;  ///< Tried with an open valve, with closed ones.
};
using While = Mishap::While;
const Mishap kMishaps[] = {
    {"nothing", ReasonCode::kNone, [](JogRig&) {}, 0ms, While::kDrawnAlone},
    {"stop", ReasonCode::kOperatorStop, [](JogRig& r) { r.jog.stop(); }, 10ms, While::kMoving},
    {"E-stop", ReasonCode::kEmergencyStop, [](JogRig& r) { r.bench.nodes.set_estop(true); }, 20ms},
    {"silent encoder", ReasonCode::kSensorStale, [](JogRig& r) { r.bench.nodes.inject(0x31, sim::NodeFault::kSilent); },
     50ms},
    {"silent tilt sensor", ReasonCode::kSensorStale,
     [](JogRig& r) { r.bench.nodes.inject(0x38, sim::NodeFault::kSilent); }, 50ms, While::kMoving},
    {"silent enable node", ReasonCode::kNone, [](JogRig& r) { r.bench.nodes.inject(0x40, sim::NodeFault::kSilent); },
     0ms, While::kDrawnAlone},
    {"invalid pressure", ReasonCode::kSensorInvalid,
     [](JogRig& r) { r.bench.nodes.inject(0x22, sim::NodeFault::kInvalid); }, 30ms},
    {"short frame", ReasonCode::kFrameShort,
     [](JogRig& r) {
       (void)r.bench.bus.port(1).send({0x1B1, 4, {}});
     },
     30ms, While::kMoving},
    {"high pressure", ReasonCode::kPressureLimit, [](JogRig& r) { r.bench.signals.pressure_Pa[1] = 241e5; }, 30ms},
    {"another cylinder", ReasonCode::kJogOtherMoves, [](JogRig& r) { r.bench.signals.cylinder_m[kArm] += 0.02; }, 30ms},
    {"a cylinder at rest", ReasonCode::kJogOtherMoves, [](JogRig& r) { r.bench.signals.cylinder_m[kBoom] -= 0.02; },
     30ms, While::kClosed},
    {"emergency", ReasonCode::kNodeEmergency, [](JogRig& r) { (void)r.bench.nodes.send_emcy(0x10, 0x3110); }, 30ms,
     While::kMoving},
    {"no pilot pressure", ReasonCode::kPilotOff, [](JogRig& r) { r.report_no_pilot(); }, 20ms},
    {"late loop", ReasonCode::kLoopOverrun, [](JogRig& r) { r.bench.run(60ms); }, 80ms, While::kMoving},
};

/// @param rig until it happens
void expect_ended_by(const Mishap& mishap, JogRig& rig, Duration limit) {
  SCOPED_TRACE(mishap.name);
  const Time at = rig.bench.now;
  mishap.happen(rig);
  rig.run(300ms);
  EXPECT_TRUE(test::is(rig.jog.trouble(), mishap.code));
  EXPECT_EQ(rig.jog.phase(), Phase::kRest);
  rig.expect_off_since(at, limit);
}

TEST(Jog, WhateverEndsAMotionLeavesItNeutralAndUnpoweredFromThatStepOn) {
  for (const Mishap& mishap : kMishaps) {
    if (mishap.when != While::kMoving && mishap.when != While::kBoth) continue;
    JogRig rig;
    rig.moving();
    expect_ended_by(mishap, rig, mishap.limit);
  }
}

TEST(Jog, NothingMovesWithoutPilotPressure) {
  JogRig rig;
  rig.start();
  rig.bench.can.lost = {rig.bench.description.bus.enable().rpdo_id()};
  rig.jog.move({.joint = kBoom, .peak = 0.3});
  rig.run(900ms);
  EXPECT_EQ(rig.jog.phase(), Phase::kPilotUp);
  rig.run(200ms);
  EXPECT_EQ(rig.jog.phase(), Phase::kRest);
  EXPECT_TRUE(test::is(rig.jog.trouble(), ReasonCode::kPilotOff));
  EXPECT_TRUE(rig.samples.empty());
}

TEST(Jog, WhateverHappensUnderPilotPressureWithClosedValvesTakesItAway) {
  for (const Mishap& mishap : kMishaps) {
    if (mishap.when != While::kClosed && mishap.when != While::kBoth) continue;
    for (const bool closing : {false, true}) {
      if (closing && mishap.code == ReasonCode::kJogOtherMoves) continue;  // the boom has moved there
      JogRig rig;
      rig.start();
      if (closing) {
        rig.jog.move({.joint = kBoom, .peak = 0.3, .rise_1ps = 0.1, .travel_m = 0.005});
        rig.until(Phase::kClosing);
      } else {
        rig.jog.hold_pilot(2s);
        rig.until(Phase::kHeld);
      }
      expect_ended_by(mishap, rig, 10ms);
    }
  }
}

TEST(Jog, PilotPressureThatStaysOnIsReported) {
  JogRig rig;
  rig.start();
  rig.jog.hold_pilot(100ms);
  rig.until(Phase::kHeld);
  rig.bench.can.lost = {rig.bench.description.bus.enable().rpdo_id()};
  rig.run(1200ms);
  EXPECT_EQ(rig.jog.phase(), Phase::kRest);
  EXPECT_TRUE(test::is(rig.jog.trouble(), ReasonCode::kPilotStaysOn));
}

TEST(Jog, TaskIsTakenAtRestOnly) {
  JogRig rig;
  rig.moving();
  rig.jog.move({.joint = kArm, .peak = 0.3});
  rig.jog.hold_pilot(1s);
  rig.step();
  EXPECT_EQ(rig.jog.phase(), Phase::kMoving);
  EXPECT_EQ(rig.bench.nodes.outputs().spool_demand[kArm], 0);
  rig.jog.stop();
  rig.finish();
  rig.jog.move({.joint = 3, .peak = 0.3});
  EXPECT_EQ(rig.jog.phase(), Phase::kRest) << "there is no such joint";
}

/// What the wire carried since recording began: one opening at a time, small, and opened slowly.
void expect_gentle(const test::BenchMachine& bench, const std::string& what) {
  constexpr double kStep = 1.0 / 16384;  // of a set-point on the wire
  PerJoint<double> open{};
  PerJoint<Time> at{};
  for (const auto& w : bench.wire) {
    for (std::size_t j = 0; j < kJoints; ++j) {
      if (w.frame.id != bench.description.bus.valve(j).rpdo_id()) continue;
      const auto command = canopen::parse_valve_command(w.frame);
      ASSERT_TRUE(command);
      const double before = open[j], now = command->set_point;
      ASSERT_LE(std::abs(now), 0.35 + kStep) << what;
      const double from = before * now > 0 ? std::abs(before) : 0;
      ASSERT_LE(std::abs(now), from + 0.2 * 0.011 + 2 * kStep)
          << what << ", after " << to_seconds(w.at - at[j]) << " s";
      open[j] = now;
      at[j] = w.at;
      ASSERT_LE(std::count_if(open.begin(), open.end(), [](double u) { return u != 0; }), 1) << what;
    }
  }
}

TEST(Jog, CarriesOneSmallOpeningAtATimeAndEndsNeutralWhateverThePlanAndWhateverFails) {
  std::mt19937 rng(29);
  const auto draw = [&rng](double low, double high) { return std::uniform_real_distribution<>(low, high)(rng); };
  for (int run = 0; run < 40; ++run) {
    JogRig rig;
    rig.start();
    const JogPlan plan{.joint = static_cast<int>(draw(0, 2.999)),
                       .peak = draw(-0.6, 0.6),
                       .rise_1ps = std::exp(draw(-4, 2)),
                       .travel_m = draw(0.002, 0.3),
                       .longest_s = draw(0.2, 4),
                       .until_stall = draw(0, 1) < 0.5};
    const Mishap& mishap = kMishaps[static_cast<std::size_t>(run) % std::size(kMishaps)];
    const std::string what = std::string(mishap.name) + ", run " + std::to_string(run);
    rig.jog.move(plan);
    rig.run(from_seconds(draw(0, 3)));
    mishap.happen(rig);
    rig.run(7s);
    EXPECT_EQ(rig.jog.phase(), Phase::kRest) << what;
    EXPECT_FALSE(rig.bench.nodes.outputs().pilot) << what;
    EXPECT_EQ(rig.bench.nodes.outputs().spool_demand, JointVector(0, 0, 0)) << what;
    expect_gentle(rig.bench, what);
  }
}

TEST(Jog, StepAllocatesNothing) {
  JogRig rig;
  rig.bench.recording = false;
  rig.start();
  const test::NoAllocScope scope;
  rig.jog.move({.joint = kBoom, .peak = 0.35, .travel_m = 0.015});
  for (int i = 0; i < 4000 && rig.jog.phase() != Phase::kRest; ++i) rig.step();
  rig.jog.hold_pilot(100ms);
  for (int i = 0; i < 400; ++i) rig.step();
  EXPECT_EQ(scope.allocations(), 0U);
}

}  // namespace
}  // namespace knuckle::slave
