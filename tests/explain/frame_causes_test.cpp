// What explain says of a machine that has frames of its own in place of nodes.
#include <gtest/gtest.h>

#include <vector>

#include "app/explain/cause.h"
#include "app/explain/timeline.h"
#include "core/frame_words.h"
#include "machine/reason_text.h"
#include "tests/support/command_machine.h"
#include "tests/support/says.h"
#include "tests/support/two_buses.h"

namespace knuckle::explain {
namespace {

using test::says;

/// Each of the machine's frames as often as it comes, for two seconds until the stop and half a second from then on.
struct OwnFrames {
  explicit OwnFrames(const MachineDescription& of) : machine(of) {
    window.from = Time(98s);
    window.to = stop.at + 500ms;
  }
  /// @param silent a frame, by its name, that does not come from `gone` on; "all": none does
  void come(const std::string& silent = "", Time gone = Time::max()) {
    for (Time now = window.from; now < window.to; now += 1ms) {
      for (const BroadcastFrame& frame : machine.bus.broadcasts) {
        const bool due = (now - window.from) % from_seconds(frame.period_s) == Duration::zero();
        if (!due || (now >= gone && (silent == "all" || silent == frame.name))) continue;
        CanFrame one{.id = frame.id, .size = frame.bytes, .data = {}};
        const Duration counts = std::min(now, counts_until) - window.from;
        if (frame.closing.counter) close_frame(frame.closing, static_cast<std::uint64_t>(counts / 25ms) % 256, one);
        window.can.push_back({now, WireEventKind::kCanReceived, one});
      }
    }
  }
  [[nodiscard]] Evidence evidence() const { return evidence_of(stop, window, machine); }
  [[nodiscard]] Cause cause() const { return likely_cause(stop, window, evidence(), machine); }
  [[nodiscard]] std::string inputs() {
    std::uint32_t number = 0;
    for (Time now = window.from; now < window.to; now += 5ms) window.machine_steps.push_back({now, ++number});
    std::string text;
    for (const std::string& line : last_inputs(stop, window, evidence(), machine.bus)) text += line + '\n';
    return text;
  }
  void stopped_by(ReasonCode code, NodeRole role, int index, float value = 0, float limit = 0) {
    stop.reason = {code, subject_of(role, index, machine.bus), value, limit};
  }

  MachineDescription machine;
  Window window;
  Stop stop{.at = Time(100s), .reason = {}};
  Time counts_until = Time::max();
};

std::string text_of(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

TEST(ExplainFrames, NamesTheFrameThatDoesNotComeAndSinceWhen) {
  OwnFrames bus(test::command_machine());
  bus.come("front_angle", Time(99960ms));
  bus.stopped_by(ReasonCode::kSensorStale, NodeRole::kEncoder, kBoom, 45, 40);
  const Cause cause = bus.cause();
  EXPECT_EQ(cause.id, "frame_missing");
  EXPECT_TRUE(says(cause.text, "front_angle (0x18FF1021) did not come since 99.950 s"));
  EXPECT_EQ(cause.since, Time(99950ms));
  const std::string inputs = bus.inputs();
  for (const char* said : {"3 of 4 frames of the machine came in time; controller sound; ",
                           "front_angle (0x18FF1021): 50 ms old (usual every 10 ms), not again by 100.500 s",
                           "changed first: front_angle (0x18FF1021) missed its turn at 99.960 s"})
    EXPECT_TRUE(says(inputs, said));
  EXPECT_FALSE(says(inputs, "node"));
}

TEST(ExplainFrames, OfAllThatStoppedAtOnceBlamesNoSingleOneNorOneThatWasNotDue) {
  for (const double slope_period_s : {0.02, 1.0}) {
    MachineDescription machine = test::command_machine();
    for (BroadcastFrame& frame : machine.bus.broadcasts)
      if (frame.name == "body") frame.period_s = slope_period_s;
    OwnFrames bus(machine);
    bus.come("all", Time(99960ms));
    bus.stopped_by(ReasonCode::kSensorStale, NodeRole::kEncoder, kBoom, 45, 40);
    EXPECT_EQ(bus.cause().id, "frames_missing") << slope_period_s;
  }
}

TEST(ExplainFrames, SaysSinceWhenACounterStands) {
  OwnFrames bus(test::command_machine());
  bus.counts_until = Time(99900ms);
  bus.come();
  bus.stopped_by(ReasonCode::kSensorInvalid, NodeRole::kEnable, kPilotOnIndex, 0, kCounterStands);
  const Cause cause = bus.cause();
  EXPECT_EQ(cause.id, "frame_repeated");
  EXPECT_TRUE(says(cause.text, "machine_state (0x18FF4021): its counter stands since 99.900 s"));
  EXPECT_EQ(cause.since, Time(99900ms));
}

TEST(ExplainFrames, OfAFrameThatIsTooShortSpeaksOfNoPdo) {
  OwnFrames bus(test::command_machine());
  bus.come();
  bus.stopped_by(ReasonCode::kFrameShort, NodeRole::kEncoder, kArm, 7, 8);
  const Cause cause = bus.cause();
  EXPECT_EQ(cause.id, "frame_short");
  EXPECT_FALSE(says(cause.text, "PDO"));
}

/// The controller there sends nothing that anybody could acknowledge, and no node is on it.
TEST(ExplainFrames, OfACutBusWithoutNodesSpeaksOfItsFramesAlone) {
  OwnFrames bus(parse_machine(test::two_buses_text(), "m.toml"));
  bus.come("all", Time(100s));
  bus.stop.reason = {ReasonCode::kBusPassive, 1, 0, 0};
  bus.window.changes.push_back({Time(100s), WireEventKind::kCanState,
                                static_cast<std::uint32_t>(CanState::kPassive) | 1U << recording::kStateOfBit});
  const Cause cause = bus.cause();
  EXPECT_EQ(cause.id, "bus_cut");
  EXPECT_TRUE(says(cause.text, "bus machine is cut"));
  EXPECT_TRUE(says(cause.text, "from 100.000 s on no frame of it was heard"));
  EXPECT_TRUE(says(bus.inputs(), "controller of bus machine error-passive since 100.000 s"));
}

/// It is asked for the first time when something stops.
TEST(ExplainFrames, ASoundControllerHasNotChanged) {
  OwnFrames bus(test::command_machine());
  bus.come();
  bus.stopped_by(ReasonCode::kFrameShort, NodeRole::kEncoder, kArm, 7, 8);
  bus.window.changes.push_back({Time(100s), WireEventKind::kCanState, static_cast<std::uint32_t>(CanState::kActive)});
  EXPECT_FALSE(bus.evidence().can_changed);
}

TEST(ExplainFrames, SaysWhatEndsMotionWhereNoCommandFrameGoesOut) {
  OwnFrames bus(test::command_machine());
  bus.come();
  bus.stop.reason = {ReasonCode::kLoopOverrun, 0, 1000, 50};
  bus.window.machine_steps = {{Time(99s), 1}, {Time(100s), 2}};
  const Cause cause = bus.cause();
  EXPECT_EQ(cause.id, "machine_loop_paused");
  const std::string ends = "the machine's own controller ends all motion 50 ms after the last one, which is not proved";
  EXPECT_TRUE(says(text_of(cause.supports), "no command frame was sent meanwhile: " + ends));
  const WhatFollowed after = what_followed(bus.stop, bus.window, bus.machine);
  EXPECT_TRUE(says(lines_of(after, bus.stop).front(), "no command got onto the wire any more: " + ends));
}

}  // namespace
}  // namespace knuckle::explain
