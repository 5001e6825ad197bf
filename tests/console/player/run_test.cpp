// What the player shows of any time is what was recorded of it, and nothing is made up.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "app/console/link_watch.h"
#include "app/console/named_fields.h"
#include "tests/console/player/played_files.h"

namespace knuckle::test {
namespace {

namespace player = console::player;
using recording::Topic;
constexpr double kFloat = 1e-6;  // rows are floats

void expect_near(const auto& a, const auto& b, double relative) {
  EXPECT_LE((a - b).norm(), relative * std::max(1.0, a.norm()));
}

TEST(PlayedRun, ShowsInEachStepWhatTheOperatorsLoopKnewInIt) {
  const player::Played played = player::load({recorded("lost_link")});
  int steps = 0, heard = 0, silent = 0;
  for_each_state<master::MasterState>(recorded("lost_link"), Topic::kOperatorState, [&](const auto& state) {
    const console::ConsoleView view = played.run.view(state.at);
    ++steps;
    ASSERT_EQ(view.link.heard, state.heard) << to_seconds(state.at);
    EXPECT_EQ(view.hand.presence, state.presence);
    EXPECT_EQ(view.hand.enable, state.enable);
    EXPECT_EQ(view.hand.stop, state.stop);
    EXPECT_EQ(view.hand.device.code, state.device.code);
    expect_near(view.hand.set_point_rad, state.setpoint_rad, kFloat);
    expect_near(view.hand.sent_force_N, state.sent_force_N, kFloat);
    EXPECT_NEAR(view.hand.hand_energy_J, state.energy_out_J - state.energy_in_J, kFloat);
    if (!state.heard) return;
    ++heard;
    EXPECT_NEAR(view.link.silence_s, state.silence_s, kFloat);
    EXPECT_NEAR(view.link.round_trip_s, state.round_trip_s, kFloat);
    ASSERT_EQ(view.machine.mode, state.mode) << to_seconds(state.at);
    EXPECT_EQ(view.machine.fault.code, state.fault.code);
    expect_near(view.machine.position_rad, state.machine_rad, kFloat);
    expect_near(view.machine.tip_force_N, state.tip_force_N, kFloat);
    EXPECT_NEAR(view.machine.confidence, state.confidence, kFloat);
    silent += state.silence_s > 0.25 ? 1 : 0;
  });
  EXPECT_EQ(steps, 2700);
  EXPECT_GT(heard, 2000);
  EXPECT_GT(silent, 100) << "the link is lost in it";
}

TEST(PlayedRun, KnowsWhenTheMachineWasFirstHeardAndItsModesInTheirOrder) {
  const player::Run run = player::load({recorded("lost_link")}).run;
  EXPECT_GT(run.first_heard(), run.first());
  EXPECT_TRUE(run.view(run.first_heard()).link.heard);
  EXPECT_FALSE(run.view(*run.step_before(run.first_heard())).link.heard);
  std::vector<Mode> modes;
  for (const auto& span : run.modes()) modes.push_back(span.mode);
  EXPECT_EQ(modes, (std::vector<Mode>{Mode::kSelfTest, Mode::kReady, Mode::kAligning, Mode::kEngaged, Mode::kFault}));
  const player::Run machine_alone = player::load({recorded("load")}).run;
  EXPECT_EQ(machine_alone.first_heard(), machine_alone.first());
}

TEST(PlayedRun, ShowsInEachStepWhatTheMachinesLoopKnewInItWhereOnlyThatWasRecorded) {
  const player::Played played = player::load({recorded("load")});
  ASSERT_FALSE(played.head.has_operator);
  int steps = 0;
  for_each_state<slave::SlaveState>(recorded("load"), Topic::kMachineState, [&](const auto& state) {
    const console::ConsoleView view = played.run.view(state.at);
    ++steps;
    ASSERT_EQ(view.machine.mode, state.mode);
    EXPECT_EQ(view.machine.limits, state.limits);
    EXPECT_EQ(view.machine.contact, state.contact);
    expect_near(view.machine.position_rad, state.joint_rad, kFloat);
    expect_near(view.machine.ahead_rad, state.ahead_rad, kFloat);
    expect_near(view.machine.tip_force_N, state.tip_force_N, kFloat);
    expect_near(view.machine.load_N, state.load_N, kFloat);
    EXPECT_NEAR(view.machine.payload_kg, state.payload_kg, 1e-6 * std::max(1.0, std::abs(state.payload_kg)));
    for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(view.machine.pressure_Pa[i], state.pressure_Pa[i], 1);
    expect_near(view.status.valve_command, state.valve_command, kFloat);
    expect_near(view.status.spool, state.spool, kFloat);
    EXPECT_EQ(view.hand.enable, state.heard && state.enable);
  });
  EXPECT_EQ(steps, 1040);
}

TEST(PlayedRun, SaysOfWhatWasNotRecordedThatItIsNotKnown) {
  const TemporaryFolder folder;
  const player::Played played = player::load({one_side(folder, "press", false)});
  const console::ConsoleView view = played.run.view(Time(2s));
  EXPECT_TRUE(view.link.heard);
  EXPECT_TRUE(view.hand.ghost_rad.array().isNaN().all());
  EXPECT_TRUE(view.hand.sent_force_N.array().isNaN().all());
  EXPECT_TRUE(std::isnan(view.hand.position_scale));
  EXPECT_TRUE(std::isnan(view.hand.hand_energy_J));
  EXPECT_TRUE(std::isnan(view.link.loss));
  EXPECT_TRUE(std::isnan(view.link.neutral_after_s));
  console::LinkSide link = view.link;
  played.run.show_link(Time(2s), link);
  EXPECT_EQ(link.round_trip.count(), 0u);
  EXPECT_FALSE(view.status_heard) << "a session on virtual time sends none";
  EXPECT_TRUE(std::isnan(view.status.oil_flow_m3ps));
}

TEST(PlayedRun, OfTheOperatorsSideAloneShowsTheMachineAsThatOfBothSides) {
  const TemporaryFolder folder;
  const player::Played both = player::load({recorded("press")});
  const player::Played alone = player::load({one_side(folder, "press", true)});
  for (Time at = both.run.first(); at <= both.run.last(); at += 3ms) {
    const console::ConsoleView a = both.run.view(at), b = alone.run.view(at);
    ASSERT_EQ(a.link.heard, b.link.heard);
    ASSERT_EQ(a.machine.mode, b.machine.mode);
    ASSERT_EQ(a.machine.position_rad, b.machine.position_rad);
    ASSERT_TRUE(!a.link.heard || a.machine.tip_force_N == b.machine.tip_force_N);
    EXPECT_TRUE(a.status_of_steps || !a.link.heard);
    EXPECT_FALSE(b.status_of_steps) << "the valves are known by the machine's status alone";
  }
}

/// The same session, looked at while it ran and played afterwards.
TEST(PlayedRun, ShowsWhatTheConsoleShowedAtThatTime) {
  const TemporaryFolder folder;
  std::vector<console::ConsoleView> shown;
  // Histograms are gathered every 200 ms, from the first time on that anybody looks.
  const player::Played played = player::load({recorded_live(folder, [&](int tick, console::LiveSession& session) {
    if (tick % 200 == 0) session.show(shown.emplace_back());
  })});
  for (const console::ConsoleView& was : shown) {
    console::ConsoleView is = played.run.view(was.now);
    played.run.show_link(was.now, is.link);
    SCOPED_TRACE(to_seconds(was.now));
    ASSERT_EQ(is.link.heard, was.link.heard);
    ASSERT_EQ(is.machine.mode, was.machine.mode);
    expect_near(is.machine.position_rad, was.machine.position_rad, kFloat);
    EXPECT_NEAR(is.hand.position_scale, was.hand.position_scale, kFloat);
    EXPECT_NEAR(is.hand.force_scale, was.hand.force_scale, 1e-9);
    EXPECT_EQ(is.hand.enable, was.hand.enable);
    EXPECT_EQ(is.link.round_trip.count(), was.link.round_trip.count());
    EXPECT_EQ(is.link.round_trip.max(), was.link.round_trip.max());
    EXPECT_EQ(is.link.arrival_jitter.quantile(0.99), was.link.arrival_jitter.quantile(0.99));
    EXPECT_EQ(is.link.hand_to_valve.count(), was.link.hand_to_valve.count());
    EXPECT_NEAR(is.link.loss, was.link.loss, 1e-12);
    EXPECT_EQ(is.status_heard, was.status_heard);
    if (!was.status_heard) continue;
    EXPECT_EQ(is.status.oil_flow_m3ps, was.status.oil_flow_m3ps);
    EXPECT_NEAR(is.status_age_s, was.status_age_s, 1e-9);
    EXPECT_EQ(is.status.steps, was.status.steps);
  }
  EXPECT_GT(shown.back().link.hand_to_valve.count(), 10u) << "it moved";
  EXPECT_GT(shown.back().link.arrival_jitter.count(), 500u);
}

bool lists_a_lost_link(const player::Played& played) {
  return std::any_of(played.events.begin(), played.events.end(), [](const console::EventRow& row) {
    return row.code == "link" && row.severity == console::Severity::kAlarm;
  });
}

TEST(PlayedRun, FindsWhereStepsAreMissingAndShowsNothingThere) {
  const TemporaryFolder folder;
  const player::Played played =
      player::load({with_holes(folder, "press", [](bool, Time at) { return at > Time(1s) && at < Time(1500ms); })});
  ASSERT_EQ(played.run.gaps().size(), 1u);
  EXPECT_EQ(played.run.gaps()[0].from, Time(1s));
  EXPECT_GE(played.run.gaps()[0].to, Time(1500ms));
  EXPECT_LE(played.run.gaps()[0].to, Time(1550ms)) << "what was under way to the operator's side";
  EXPECT_EQ(played.run.step_after(Time(1s)), Time(1500ms));
  EXPECT_EQ(played.run.step_before(Time(1500ms)), Time(1s));
  const console::ConsoleView before = played.run.view(Time(1s));
  for (Time at = Time(1001ms); at < Time(1500ms); at += 7ms) {
    console::ConsoleView view = played.run.view(at);
    played.run.show_link(at, view.link);
    EXPECT_FALSE(view.link.heard || view.status_heard || view.status_of_steps);
    EXPECT_TRUE(view.machine.tip_force_N.array().isNaN().all());
    EXPECT_TRUE(view.hand.set_point_rad.array().isNaN().all());
    EXPECT_TRUE(std::isnan(view.link.loss) && std::isnan(view.link.neutral_after_s));
    EXPECT_EQ(view.machine.position_rad, before.machine.position_rad) << "the picture stands";
    EXPECT_FALSE(console::link_verdict(view.link, 0));
  }
}

void expect_shown_as_without_the_hole(const player::Played& played, const player::Played& whole) {
  EXPECT_FALSE(lists_a_lost_link(played));
  ASSERT_EQ(played.run.gaps().size(), 1u);
  for (Time at = played.run.gaps()[0].to; at <= played.run.last(); at += 1ms) {
    const console::ConsoleView is = played.run.view(at), was = whole.run.view(at);
    ASSERT_EQ(is.link.heard, was.link.heard) << to_seconds(at);
    ASSERT_EQ(is.machine.position_rad, was.machine.position_rad) << to_seconds(at);
    console::LinkSide link = is.link;
    played.run.show_link(at, link);
    ASSERT_FALSE(link.loss > 0) << to_seconds(at);
  }
}

/// One in five steps of the operator's side has a message of the machine's.
TEST(PlayedRun, TakesNoHoleInTheRecordingForALossOnTheLinkWhereverItEnds) {
  constexpr Time kNone(1s);
  const player::Played whole = player::load({recorded("press")});
  EXPECT_FALSE(lists_a_lost_link(whole));
  for (Time end = Time(1490ms); end < Time(1500ms); end += 1ms) {  // twice over
    const std::array<std::pair<Time, Time>, 4> holes{{{end, end}, {end, kNone}, {kNone, end}, {end - 20ms, end}}};
    for (const auto& [operators, machines] : holes) {
      SCOPED_TRACE(std::to_string(to_seconds(operators)) + " s, " + std::to_string(to_seconds(machines)) + " s");
      const TemporaryFolder folder;
      const auto missing = [&](bool operator_side, Time at) {
        return at > Time(1s) && at < (operator_side ? operators : machines);
      };
      const player::Played played = player::load({with_holes(folder, "press", missing)});
      ASSERT_NO_FATAL_FAILURE(expect_shown_as_without_the_hole(played, whole));
      EXPECT_GE(played.run.gaps()[0].to, end);
      EXPECT_LE(played.run.gaps()[0].to, end + 50ms);
    }
  }
}

/// When the link of "lost_link" falls silent.
Time last_message_before_the_silence(const player::Run& run) {
  const auto& receipts = run.data().receipts;
  const auto silence = std::adjacent_find(receipts.begin(), receipts.end(),
                                          [](const auto& one, const auto& next) { return next.at - one.at > 250ms; });
  return silence == receipts.end() ? receipts.back().at : silence->at;
}

TEST(PlayedRun, HidesNoLossOnTheLinkThatBeginsRightBehindAHole) {
  const player::Played whole = player::load({recorded("lost_link")});
  const Time lost = last_message_before_the_silence(whole.run);
  ASSERT_GT(whole.run.view(lost + 350ms).link.silence_s, 0.3);
  // All that still comes is of missing steps; or nothing comes at all.
  for (const Time end : {lost - 10ms, lost + 30ms}) {
    SCOPED_TRACE(to_seconds(end));
    const TemporaryFolder folder;
    const auto missing = [&](bool operator_side, Time at) {
      return at > lost - 400ms && at < (operator_side ? end : std::max(end, lost));
    };
    const player::Played played = player::load({with_holes(folder, "lost_link", missing)});
    ASSERT_EQ(played.run.gaps().size(), 1u);
    EXPECT_LE(played.run.gaps()[0].to, lost + 255ms) << "the console would show it then";
    EXPECT_EQ(lists_a_lost_link(played), lists_a_lost_link(whole));
    const console::ConsoleView view = played.run.view(lost + 300ms);
    EXPECT_TRUE(played.run.recorded(lost + 300ms));
    EXPECT_GT(view.link.silence_s, 0.25);
    EXPECT_FALSE(view.link.heard) << "what the machine told before the hole is not the newest";
  }
}

TEST(PlayedRun, GoesOnOverAFewStepsThatTheRecorderDropped) {
  const TemporaryFolder folder;
  const auto missing = [](bool operator_side, Time at) {
    const auto ms = at.time_since_epoch() / 1ms % 200;
    return at > Time(500ms) && (operator_side ? ms < 20 : ms >= 100 && ms < 115);
  };
  const player::Played played = player::load({with_holes(folder, "press", missing)});
  EXPECT_TRUE(played.run.gaps().empty());
  EXPECT_FALSE(lists_a_lost_link(played));
  for (Time at = Time(600ms); at <= played.run.last(); at += 1ms) {
    console::ConsoleView view = played.run.view(at);
    ASSERT_TRUE(view.link.heard) << to_seconds(at);
    played.run.show_link(at, view.link);
    ASSERT_FALSE(view.link.loss > 0) << to_seconds(at);
  }
}

TEST(PlayedRun, ShowsInALongSilenceThatAllIsLost) {
  player::RunData data;
  data.operator_side = true;
  SlaveMessage message;
  for (Time at = Time(0s); at <= Time(30s); at += 5ms) {
    master::MasterState state;
    state.at = at;
    state.heard = true;
    state.silence_s = std::max(0.0, to_seconds(at) - 2);
    data.add(state);
    if (at > Time(2s)) continue;
    message.stamp.sequence++;
    data.add(at, message);
    data.arrivals.push_back({at, at, message.stamp.sequence, 1});
  }
  const player::Run run(std::move(data));
  for (const Time at : {Time(12500ms), Time(13500ms), Time(20s), Time(30s)}) {
    console::LinkSide link = run.view(at).link;
    run.show_link(at, link);
    EXPECT_GT(link.loss, 0.99) << to_seconds(at);
  }
}

TEST(NamedFields, GoOverWhereNameAndTypeAreTheSameAndHaveNoNumberWhereNothingIsKnown) {
  slave::SlaveState state;
  state.mode = Mode::kHold;
  state.confidence = 0.7;
  state.ahead_rad = {0.1, 0.2, 0.3};
  state.pressure_Pa[5] = 2e5;
  state.joint_rad = {1, 2, 3};
  SlaveMessage told;
  told.sensor_at = Time(3s);
  console::copy_named(state, told);
  EXPECT_EQ(told.mode, Mode::kHold);
  EXPECT_EQ(told.confidence, 0.7);
  EXPECT_EQ(told.ahead_rad, state.ahead_rad);
  EXPECT_EQ(told.pressure_Pa, state.pressure_Pa);
  EXPECT_EQ(told.sensor_at, Time(3s));
  EXPECT_EQ(told.position_rad, JointVector::Zero()) << "the state calls it otherwise";
  console::make_unknown(told);
  EXPECT_TRUE(std::isnan(told.confidence) && std::isnan(told.pressure_Pa[5]));
  EXPECT_TRUE(told.position_rad.array().isNaN().all());
  EXPECT_EQ(told.mode, Mode::kHold);
}

}  // namespace
}  // namespace knuckle::test
