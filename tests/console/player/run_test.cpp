// What the player shows of any time is what was recorded of it, and nothing is made up.
#include <gtest/gtest.h>

#include <cmath>

#include "app/console/live_session.h"
#include "app/session/session_head.h"
#include "recording/recorder.h"
#include "tests/console/console_rig.h"
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
    expect_near(view.machine.tip_force_N, state.tip_force_N, kFloat);
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
    ASSERT_EQ(a.machine.tip_force_N, b.machine.tip_force_N);
    EXPECT_TRUE(a.status_of_steps || !a.link.heard);
    EXPECT_FALSE(b.status_of_steps) << "the valves are known by the machine's status alone";
  }
}

/// The same session, looked at while it ran and played afterwards.
TEST(PlayedRun, ShowsWhatTheConsoleShowedAtThatTime) {
  const TemporaryFolder folder;
  session::SimulateOptions options;
  options.scenario = "free_motion";
  options.loss = 0.05;
  options.jitter_ms = 8;
  const session::SessionSetup setup = session::load_session(options).setup;
  std::vector<console::ConsoleView> shown;
  {
    recording::RecorderOptions how;
    how.file = folder.file("live.mcap");
    recording::Head head = session::session_head(setup, options);
    head.far_end_is_this_machine = false;
    recording::Recorder recorder(how, head, setup.machine);
    console::LiveSession session(setup, console::LiveSession::Led::kByScenario, nullptr);
    session.record_to(recorder);
    for (int tick = 1; tick <= 6000; ++tick) {
      session.step({});
      if (tick % 50 == 0) recorder.drain();
      // Histograms are gathered every 200 ms, from the first time on that anybody looks.
      if (tick % 200 == 0) session.show(shown.emplace_back());
    }
    recorder.close();
  }
  const player::Played played = player::load({folder.file("live.mcap")});
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
}

TEST(PlayedRun, FindsWhereStepsAreMissingAndShowsNothingFreshThere) {
  const TemporaryFolder folder;
  const std::string file = folder.file("gap.mcap");
  const auto missing = [](Time at) { return at > Time(1s) && at < Time(1500ms); };
  rewrite(recorded("press"), file, head_of(recorded("press")), {1},
          [&](const std::string& topic, std::vector<std::uint8_t>& message) {
            master::MasterState mine;
            slave::SlaveState its;
            if (topic == "/operator/state" && recording::decode(message, mine)) return !missing(mine.at);
            if (topic == "/machine/state" && recording::decode(message, its)) return !missing(its.at);
            const auto wires = recording::decode_wires(message);
            return !wires || !missing(wires->at);
          });
  const player::Played played = player::load({file});
  ASSERT_EQ(played.run.gaps().size(), 1u);
  EXPECT_EQ(played.run.gaps()[0].from, Time(1s));
  EXPECT_EQ(played.run.gaps()[0].to, Time(1500ms));
  EXPECT_GE(played.run.view(Time(1400ms)).link.silence_s, 0.4) << "greyed by its age";
  EXPECT_EQ(played.run.step_after(Time(1s)), Time(1500ms));
  EXPECT_EQ(played.run.step_before(Time(1500ms)), Time(1s));
}

TEST(PlayedRun, HasTheMachinesModesInTheirOrder) {
  const player::Played played = player::load({recorded("lost_link")});
  std::vector<Mode> modes;
  for (const auto& span : played.run.modes()) modes.push_back(span.mode);
  EXPECT_EQ(modes, (std::vector<Mode>{Mode::kSelfTest, Mode::kReady, Mode::kAligning, Mode::kEngaged, Mode::kFault}));
}

}  // namespace
}  // namespace knuckle::test
