// What recorded motions say of an axis, and what a person is told of what ended one.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "app/bringup/commission_guards.h"
#include "app/bringup/commission_jog.h"
#include "tests/bringup/hardware_bench.h"
#include "tests/support/says.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using Level = Finding::Level;
using slave::JogEnd;
using slave::JogSample;
using test::solar;

/// A motion of the boom by so much, to an end of its own.
JogRun motion(double peak, double way_m, JogEnd end = JogEnd::kTravelled) {
  JogRun run{end, {.joint = kBoom, .peak = peak}, {}};
  for (int i = 0; i <= 200; ++i) {
    JogSample s{0.005 * i, peak, peak, JointVector(0.9 + way_m * i / 200, 1.1, 0.9), {}};
    s.pressure_Pa.fill(20e5);
    run.samples.push_back(s);
  }
  return run;
}

TEST(CommissionChecks, DirectionIsRightOnlyWhereEyeValveAndEncoderAgree) {
  EXPECT_EQ(judge_direction(motion(0.2, 0.015), Seen::kLonger, solar().bus).level, Level::kOk);
  EXPECT_EQ(judge_direction(motion(-0.2, -0.015), Seen::kShorter, solar().bus).level, Level::kOk);
  const auto fault = [](const JogRun& run, Seen seen) {
    const Finding finding = judge_direction(run, seen, solar().bus);
    return finding.level == Level::kFault ? finding.text : "";
  };
  EXPECT_TRUE(says(fault(motion(0.2, -0.015), Seen::kLonger), "counts in the wrong direction"));
  EXPECT_TRUE(says(fault(motion(0.2, -0.015), Seen::kShorter), "moves in the wrong direction"));
  EXPECT_TRUE(says(fault(motion(0.2, 0.015), Seen::kShorter), "encoder measured +15.0 mm, and you saw the opposite"));
  EXPECT_TRUE(says(fault(motion(0.2, 0), Seen::kLonger), "its encoder measured no motion"));
  EXPECT_TRUE(says(fault(motion(0.2, 0.015), Seen::kStill), "encoders are exchanged"));
  EXPECT_TRUE(says(fault(motion(0.2, 0), Seen::kStill), "did not move"));
  EXPECT_TRUE(says(fault(motion(0.2, 0.015), Seen::kAnother), "moves another cylinder"));
}

TEST(CommissionChecks, AGuardIsProvedOnlyByWhatTheNodeDidByItself) {
  using Seen = slave::GuardSeen;
  NodeDescription valve, enable;
  valve.name = "boom_valve";
  enable.name = "enable";
  enable.role = NodeRole::kEnable;
  const auto seen = [](std::optional<double> told_s, std::optional<double> stopped_s,
                       const std::function<void(Seen&)>& change = {}) {
    Seen made;
    made.guard_s = 0.05;
    made.told_s = told_s;
    made.stopped_s = stopped_s;
    if (change) change(made);
    return made;
  };
  struct Case {
    const NodeDescription& node;
    Seen seen;
    bool proved;
    Level level;
    const char* text;
  };
  const Case cases[] = {
      {valve, seen(0.055, 0.12), true, Level::kOk, "no longer works, after 55 ms"},
      {valve, seen(0.055, {}), false, Level::kFault, "and its spool stayed open"},
      {valve, seen({}, {}), false, Level::kFault, "told nothing, and its spool stayed open"},
      {valve, seen(0.055, 0.12, [](Seen& s) { s.other_guard = true; }), true, Level::kOk,
       "spool back after 120 ms; that it also stops without a heartbeat was not tried"},
      {valve, seen({}, 0.12), false, Level::kNote, "but it told nothing"},
      {valve, seen(0.055, {}, [](Seen& s) { s.pilot_off_s = 0.06; }), false, Level::kNote, "pilot pressure went off"},
      {valve, seen(0.055, {}, [](Seen& s) { s.silent = true; }), false, Level::kNote,
       "says no more where its spool is"},
      {valve, seen(0.055, 0.1, [](Seen& s) { s.crept_m = 3e-3; }), false, Level::kFault, "moved by 3.0 mm"},
      {valve, seen({}, {}, [](Seen& s) { s.silent = true; }), false, Level::kNote,
       "told nothing, and says no more where its spool is"},
      {valve, seen({}, {}, [](Seen& s) { s.tried = Seen::Tried::kOthersFirst; }), false, Level::kNote,
       "would act first"},
      {valve, seen({}, {}, [](Seen& s) { s.tried = Seen::Tried::kNoDeadBand; }), false, Level::kNote, "too small"},
      {valve, seen({}, {}, [](Seen& s) { s.tried = Seen::Tried::kDidNotFollow; }), false, Level::kNote,
       "does not follow"},
      {valve, seen(0.035, 0.12, [](Seen& s) { s.early = true, s.emergency = 0xFF00; }), false, Level::kNote,
       "told error 0xFF00 after 35 ms, before its guard could act (50 ms)"},
      {valve, seen({}, 0.02, [](Seen& s) { s.early = true; }), false, Level::kNote, "it stopped after 20 ms, before"},
      {valve, seen(0.055, 0.36), false, Level::kNote, "stopped only after 360 ms"},
      {enable, seen(0.15, 0.15), true, Level::kOk, "pilot pressure was off after 150 ms"},
      {enable, seen({}, {}), false, Level::kFault, "stayed on without"},
      {enable, seen({}, 0.15, [](Seen& s) { s.others_stopped = true; }), false, Level::kNote,
       "after a valve had stopped"},
      {enable, seen(0.15, {}, [](Seen& s) { s.silent = true; }), false, Level::kNote, "whether pilot pressure is on"},
  };
  for (const Case& c : cases) {
    const GuardJudged judged = judge_guard(c.node, c.seen);
    EXPECT_EQ(judged.proved, c.proved) << c.text;
    EXPECT_EQ(judged.finding.level, c.level) << c.text;
    EXPECT_TRUE(says(judged.finding.text, c.text));
  }
  valve.unguarded = "a relay";
  EXPECT_EQ(judge_guard(valve, seen({}, {})).finding.level, Level::kNote);
}

TEST(CommissionChecks, AtAStopTheDrivenChamberRisesMost) {
  JogRun run = motion(0.2, 0.1, JogEnd::kStalled);
  for (JogSample& s : run.samples) {
    if (s.t_s > 0.5) s.pressure_Pa[0] = 180e5;
  }
  const auto end = stroke_end(run);
  ASSERT_TRUE(end);
  EXPECT_NEAR(end->rise_Pa[0], 160e5, 1);
  EXPECT_EQ(judge_sides(*end, kBoom, true).level, Level::kOk);
  EXPECT_EQ(judge_sides(*end, kBoom, false).level, Level::kFault);
  const Finding other = judge_sides(*end, kArm, true);
  EXPECT_EQ(other.level, Level::kFault);
  EXPECT_TRUE(says(other.text, "the pressure of boom head rises by 160 bar instead of that of arm head"));
  EXPECT_EQ(judge_sides(*stroke_end(motion(0.2, 0.1, JogEnd::kStalled)), kBoom, true).level, Level::kNote);
  EXPECT_FALSE(stroke_end(motion(0.2, 0.1, JogEnd::kTime)));
}

TEST(CommissionChecks, StrokeLiesBetweenWorkingRangeAndCylinder) {
  const CylinderDescription& boom = solar().cylinders[kBoom];
  const double most_m = boom.max_length_m - boom.min_length_m;  // 380 mm; the working range needs 341
  const auto level = [](double stroke_m) { return judge_stroke(stroke_m, kBoom, solar()).level; };
  EXPECT_EQ(level(most_m), Level::kOk);
  EXPECT_EQ(level(most_m + 0.0079), Level::kOk);
  EXPECT_EQ(level(most_m + 0.0081), Level::kFault);
  EXPECT_EQ(level(0.350), Level::kOk);
  EXPECT_EQ(level(0.330), Level::kFault);
  EXPECT_EQ(level(-0.360), Level::kFault);
}

TEST(CommissionChecks, DeadBandIsTheRootOfTheWayThroughQuantisedReadings) {
  const ValveDescription& valve = solar().cylinders[kBoom].valve;
  const double lag_s = valve.delay_s + 2 * valve.damping_ratio / (2 * std::numbers::pi * valve.natural_frequency_Hz);
  for (const double band : {0.06, 0.11, 0.17}) {
    for (const double sign : {1.0, -1.0}) {
      JogRun ramp{JogEnd::kTravelled, {.joint = kArm, .peak = sign * 0.35, .rise_1ps = 0.03}, {}};
      for (int i = 0; i < 2400; ++i) {
        const double t = 0.005 * i, since = std::max(0.0, t - band / 0.03 - lag_s);
        const double way = std::round(0.5 * 0.005 * since * since / 1e-4) * 1e-4;
        ramp.samples.push_back({t, 0, 0, JointVector(0, 1.1 + sign * way, 0), {}});
      }
      const auto found = dead_band(ramp, valve);
      ASSERT_TRUE(found);
      EXPECT_NEAR(*found, band, 0.003) << sign;
    }
  }
  EXPECT_FALSE(dead_band(motion(0.2, 1e-4), valve));
}

TEST(JogText, NamesAxisMeasuredValueAndLimitOfWhatEndedAMotion) {
  const BusDescription bus = solar().bus;
  EXPECT_EQ(
      jog_text({ReasonCode::kPressureLimit, 3, 241.3F, 240}, bus),
      "arm rod side pressure 241 bar, limit 240 bar (chamber_pressure_bar): check the load and the relief valves");
  EXPECT_EQ(jog_text({ReasonCode::kJogOtherMoves, kBucket, 11.2F, 10}, bus),
            "the bucket cylinder moved by 11 mm without a command, limit 10 mm: valves, hoses or encoders are "
            "exchanged, or a load holding valve leaks");
  EXPECT_EQ(jog_text({ReasonCode::kSensorStale, 0x22, 26, 25}, bus),
            "arm_head_pressure (node 0x22): sensor has stopped sending: check node and cable (26 ms; limit 25 ms)");
  EXPECT_EQ(jog_text({ReasonCode::kSensorInvalid, 0x22, 1, 0}, bus),
            "arm_head_pressure (node 0x22) reports an impossible value: check its sensor and wiring");
  EXPECT_EQ(jog_text({ReasonCode::kJogTooLong, 0, 90.5F, 90}, bus),
            "motion takes too long: check pump, engine speed and pilot pressure (90.5 s; limit 90 s)");
  EXPECT_EQ(jog_text({ReasonCode::kEmergencyStop, 0, 0, 0}, bus),
            "the E-stop chain is open: release the E-stop on the machine");
  EXPECT_EQ(jog_text({ReasonCode::kPilotStaysOn, 0, 0, 0}, bus),
            "pilot pressure is still on after it was switched off: check the enable valve before anything else");
  EXPECT_EQ(jog_text({ReasonCode::kOperatorStop, 0, 0, 0}, bus), "stopped from the keyboard");
}

}  // namespace
}  // namespace knuckle::bringup
