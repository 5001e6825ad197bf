// When was the machine neutral? Hand-written frames with one answer each.
#include "app/session/frame_log.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "machine/load.h"
#include "tests/support/solar.h"
#include "transport/canopen.h"

namespace knuckle::session {
namespace {

Time at_ms(int ms) {
  return Time(std::chrono::milliseconds(ms));
}

/// Frames in any order, sorted in the end.
class Recording {
 public:
  void command(int joint, int ms, double set_point, std::uint16_t word = canopen::kControlActive) {
    add(ms, canopen::valve_command_frame(canopen::rpdo1_id(valve(joint)), {word, set_point}));
  }
  void commands(int ms, double set_point) {
    for (int joint = 0; joint < kJoints; ++joint) command(joint, ms, set_point);
  }
  void spool(int joint, int ms, double position) {
    add(ms, canopen::valve_status_frame(canopen::tpdo1_id(valve(joint)), {0, position}));
  }
  void spools(int ms, double position) {
    for (int joint = 0; joint < kJoints; ++joint) spool(joint, ms, position);
  }
  void pilot(int ms, bool on) {
    const int inputs = canopen::kInputEStopClosed | (on ? canopen::kInputPilotOn : 0);
    add(ms, canopen::enable_inputs_frame(canopen::tpdo1_id(test::solar().bus.enable().id),
                                         static_cast<std::uint8_t>(inputs)));
  }
  void sync(int ms) { add(ms, canopen::sync_frame()); }
  void add(int ms, const CanFrame& frame) {
    log_.push_back({at_ms(ms), frame});
    std::stable_sort(log_.begin(), log_.end(), [](const TimedFrame& a, const TimedFrame& b) { return a.at < b.at; });
  }
  [[nodiscard]] NeutralTimes neutral(int from_ms, int until_ms) const {
    return neutral_times(log_, test::solar(), at_ms(from_ms), at_ms(until_ms));
  }
  [[nodiscard]] const FrameLog& log() const { return log_; }
  static std::uint8_t valve(int joint) { return test::solar().bus.valve(joint).id; }

 private:
  FrameLog log_;
};

TEST(NeutralTimes, CountFromTheLastValveThatWasToldAndTheLastSpoolThatCameHome) {
  Recording r;
  r.commands(100, 0.4);
  r.spools(100, 0.4);
  r.command(kBoom, 150, 0);
  r.command(kBucket, 152, 0);
  r.command(kArm, 160, 0);
  r.spool(kArm, 200, 0.05);
  r.spool(kBucket, 210, -0.10);
  r.spool(kBoom, 230, 0.10);
  const NeutralTimes times = r.neutral(110, 1000);
  EXPECT_EQ(times.command, at_ms(160));
  EXPECT_EQ(times.spool, at_ms(230));
  EXPECT_FALSE(times.controller_silent);
}

TEST(NeutralTimes, AMomentaryZeroCrossingIsNotNeutral) {
  Recording r;
  r.commands(100, 0.4);
  r.spools(100, 0.4);
  r.commands(120, 0);  // from one side to the other
  r.spools(130, 0);
  r.commands(130, -0.4);
  r.spools(140, -0.4);
  r.commands(200, 0);
  r.spools(260, -0.05);
  EXPECT_EQ(r.neutral(110, 1000).command, at_ms(200));
  EXPECT_EQ(r.neutral(110, 1000).spool, at_ms(260));
  EXPECT_EQ(r.neutral(110, 190).command, std::nullopt) << "the window ends before it was";
}

TEST(NeutralTimes, ASpoolOnEitherEdgeOfItsOwnDeadBandIsNeutral) {
  const double extend = test::solar().cylinders[kArm].valve.dead_band_extend;
  for (const auto& [position, neutral] : {std::pair{extend - 0.001, true}, {extend + 0.001, false}}) {
    Recording r;
    r.spools(100, 0);
    r.spool(kArm, 110, position);
    EXPECT_EQ(r.neutral(105, 1000).spool.has_value(), neutral) << position;
  }
}

TEST(NeutralTimes, WhatWasNeutralBeforeTheWindowIsSoFromItsStart) {
  Recording r;
  r.commands(50, 0);
  r.spools(90, 0);
  r.sync(100);
  r.spools(101, 0);
  const NeutralTimes times = r.neutral(100, 200);
  EXPECT_EQ(times.command, at_ms(100));
  EXPECT_EQ(times.spool, at_ms(100));
}

TEST(NeutralTimes, NeverNeutralIsNoTime) {
  Recording r;
  r.commands(100, 0.4);
  r.spools(100, 0.4);
  r.command(kBoom, 120, 0);
  r.command(kArm, 120, 0);  // the bucket is not told
  r.commands(500, 0);       // too late
  const NeutralTimes times = r.neutral(110, 400);
  EXPECT_EQ(times.command, std::nullopt);
  EXPECT_EQ(times.spool, std::nullopt);
}

TEST(NeutralTimes, AControlWordThatIsNotActiveIsNeutralWhateverTheSetPoint) {
  for (const auto& [word, neutral] :
       {std::pair{canopen::kControlHold, true}, {canopen::kControlDisabled, true}, {canopen::kControlActive, false}}) {
    Recording r;
    r.commands(100, 0);
    r.command(kArm, 110, 0.4, word);
    EXPECT_EQ(r.neutral(105, 1000).command.has_value(), neutral) << word;
  }
}

TEST(NeutralTimes, AGarbledCommandChangesNothing) {
  Recording r;
  r.commands(100, 0.4);
  for (int joint = 0; joint < kJoints; ++joint) r.add(120, {canopen::rpdo1_id(Recording::valve(joint)), 3, {}});
  EXPECT_EQ(r.neutral(110, 1000).command, std::nullopt);
  EXPECT_EQ(commands_not_neutral(r.log(), test::solar(), at_ms(110), at_ms(1000)), 0) << "but it is no command to move";
}

TEST(NeutralTimes, ASilentValveIsNeutralWhenItsPilotPressureHasBeenOffForATenthOfASecond) {
  Recording r;
  r.pilot(90, true);
  r.spools(100, 0.4);
  for (int ms = 110; ms < 600; ms += 10) {
    r.command(kBoom, ms, 0);
    r.spool(kBoom, ms, 0);
    r.spool(kArm, ms, 0);  // the bucket's valve has gone silent
  }
  EXPECT_EQ(r.neutral(105, 1000).spool, std::nullopt) << "with pilot pressure it may be open";
  r.pilot(250, false);
  EXPECT_EQ(r.neutral(105, 1000).spool, at_ms(360)) << "first frame more than 100 ms after 250";
}

TEST(NeutralTimes, ASilentValveThatWasLastSeenClosedIsNotNeutralUnderPilotPressure) {
  Recording r;
  r.pilot(90, true);
  r.spools(100, 0);
  for (int ms = 110; ms < 400; ms += 10) {
    r.spool(kBoom, ms, 0);
    r.spool(kArm, ms, 0);
  }
  EXPECT_EQ(r.neutral(200, 1000).spool, std::nullopt);
}

TEST(NeutralTimes, AHungControllerGivesNoCommandToJudge) {
  Recording r;
  r.commands(100, 0.4);
  r.spools(100, 0.4);
  for (int ms = 180; ms <= 700; ms += 40) r.spools(ms, 0);  // the valves' own watchdogs
  r.sync(700);                                              // it comes back
  r.commands(705, 0);
  const NeutralTimes times = r.neutral(105, 720);
  EXPECT_TRUE(times.controller_silent);
  EXPECT_EQ(times.command, std::nullopt);
  EXPECT_EQ(times.spool, at_ms(180));
}

TEST(NeutralTimes, AControllerThatOnlyKeepsSendingHeartbeatsIsNotSilent) {
  Recording r;
  r.commands(100, 0.4);
  r.spools(100, 0.4);
  r.add(150, canopen::heartbeat_frame(test::solar().bus.controller_id, canopen::NmtState::kOperational));
  r.spools(180, 0);
  EXPECT_FALSE(r.neutral(105, 1000).controller_silent);
  EXPECT_EQ(r.neutral(105, 1000).command, std::nullopt) << "and never told the valves";
}

/// A controller that talks every 10 ms in [from, until) while the spools report `position`.
void talk(Recording& r, int from_ms, int until_ms, double set_point, double position) {
  for (int ms = from_ms; ms < until_ms; ms += 10) {
    r.sync(ms);
    r.commands(ms + 1, set_point);
    r.spools(ms + 2, position);
  }
}

TEST(NeutralTimes, AMachineThatStandsIsNoExcuseForACommandThatNeverWasNeutral) {
  Recording r;
  talk(r, 0, 300, 0.05, 0);
  r.spools(107, 0);  // before the next SYNC
  EXPECT_FALSE(r.neutral(105, 300).controller_silent);
  EXPECT_EQ(r.neutral(105, 300).command, std::nullopt);
}

TEST(NeutralTimes, AGapShorterThanTheValvesWatchdogIsNoSilence) {
  Recording r;
  talk(r, 0, 100, 0.5, 0.5);
  r.spools(110, 0);
  talk(r, 140, 300, 0.5, 0);  // 40 ms without the controller; the watchdog takes 50 ms
  EXPECT_FALSE(r.neutral(100, 300).controller_silent);
  EXPECT_FALSE(r.neutral(100, 135).controller_silent) << "nor one that is not over when the window ends";
}

TEST(NeutralTimes, WhatWasOnItsWayWhenTheControllerHungBreaksNoSilence) {
  Recording r;
  talk(r, 0, 100, 0.5, 0.5);
  r.commands(101, 0.5);
  r.spools(200, 0);
  r.spools(210, 0);
  EXPECT_TRUE(r.neutral(100, 400).controller_silent);
}

TEST(NeutralTimes, AControllerThatSpeaksBeforeTheSpoolsAreNeutralIsJudged) {
  Recording r;
  talk(r, 0, 100, 0.5, 0.5);
  talk(r, 160, 250, 0.5, 0.5);
  talk(r, 250, 400, 0, 0);
  EXPECT_FALSE(r.neutral(100, 400).controller_silent);
  EXPECT_EQ(r.neutral(100, 400).command, at_ms(251));
}

TEST(FrameLog, FindsTheLastFrameBeforeATime) {
  Recording r;
  r.sync(100);
  r.sync(105);
  r.spools(107, 0);
  EXPECT_EQ(last_frame_before(r.log(), canopen::kSyncId, at_ms(200)), at_ms(105));
  EXPECT_EQ(last_frame_before(r.log(), canopen::kSyncId, at_ms(105)), at_ms(100));
  EXPECT_EQ(last_frame_before(r.log(), canopen::kSyncId, at_ms(100)), std::nullopt);
}

TEST(FrameLog, ASpoolFollowsWhileItIsNearOneOfItsLastDemands) {
  Recording r;
  for (int ms = 100; ms <= 400; ms += 10) {
    r.command(kArm, ms, 0.002 * (ms - 100));                             // 0 ... 0.6
    r.spool(kArm, ms + 1, 0.002 * std::min(std::max(0, ms - 130), 70));  // 30 ms late, stuck at 0.14 from 200 ms
  }
  // At 281 ms the newest six demands are 0.26 ... 0.36: 0.14 is further than 0.1 below. At 271 they begin at 0.24.
  EXPECT_EQ(last_following(r.log(), test::solar(), kArm, at_ms(1000)), at_ms(271));
  EXPECT_EQ(last_following(r.log(), test::solar(), kArm, at_ms(201)), at_ms(191));
  EXPECT_EQ(last_following(r.log(), test::solar(), kBoom, at_ms(1000)), std::nullopt);
}

TEST(FrameLog, CountsCommandsThatWouldMoveTheMachine) {
  Recording r;
  r.commands(100, 0.4);
  r.commands(110, 0);
  r.command(kBoom, 120, 0.1);
  r.command(kBoom, 130, 0.1, canopen::kControlHold);
  r.command(kBoom, 140, -0.1);
  EXPECT_EQ(commands_not_neutral(r.log(), test::solar(), at_ms(100), at_ms(1000)), 5);
  EXPECT_EQ(commands_not_neutral(r.log(), test::solar(), at_ms(110), at_ms(140)), 1);
}

}  // namespace
}  // namespace knuckle::session
