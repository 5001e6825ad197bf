// Of a recording, at any time, what a console that was there would have kept by then.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "app/console/screens/console_data.h"
#include "app/console/screens/player_panel.h"
#include "machine/kinematics.h"
#include "tests/console/console_rig.h"
#include "tests/console/player/played_files.h"

namespace knuckle::console::screens {
namespace {

constexpr Duration kFrame = 20ms;

void expect_same(const LinkHistory& is, const LinkHistory& was) {
  ASSERT_EQ(is.size(), was.size());
  for (std::size_t ago = 0; ago < was.size(); ++ago) {
    for (std::size_t i = 0; i < kLinkMeasures; ++i) {
      const LinkHistory::Range &a = is.ago(ago, static_cast<LinkMeasure>(i)),
                               &b = was.ago(ago, static_cast<LinkMeasure>(i));
      ASSERT_EQ(std::isnan(a.most), std::isnan(b.most)) << ago << ' ' << i;
      if (std::isnan(b.most)) continue;
      EXPECT_NEAR(a.least, b.least, 1e-5) << ago << ' ' << i;
      EXPECT_NEAR(a.most, b.most, 1e-5) << ago << ' ' << i;
    }
  }
}

/// The same session, looked at while it ran and played afterwards.
TEST(KeptOfRun, HasTheMinutesOfTheLinkThatTheConsoleHadAtThatTime) {
  const test::TemporaryFolder folder;
  LinkHistory history;
  ConsoleView view;
  std::vector<std::pair<Time, LinkHistory>> had;
  const player::Played played = player::load({test::recorded_live(folder, [&](int tick, LiveSession& session) {
    if ((tick - 1) % 20 != 0) return;
    session.show(view);
    history.watch(view);
    if (tick % 1500 < 20) had.emplace_back(view.now, history);
  })});
  const Kinematics kinematics(played.machine);
  KeptOfRun kept(played.run, played.machine, kinematics);
  ASSERT_GT(had.size(), 3u);
  for (const auto& [at, was] : had) {
    SCOPED_TRACE(to_seconds(at));
    kept.show(at);
    ASSERT_NO_FATAL_FAILURE(expect_same(kept.shown().link, was));
  }
  kept.show(had.front().first);
  expect_same(kept.shown().link, had.front().second);
}

/// Twelve minutes of a link at ten messages a second, of which one packet is late after 100 s.
player::RunData twelve_minutes() {
  player::RunData data;
  data.operator_side = true;
  data.machine_period = 100ms;
  player::HandStanding standing;
  standing.heard = true;
  data.standings.push_back(standing);
  std::uint32_t sequence = 0;
  for (Time at{}; at <= Time(720s); at += 100ms) {
    const Duration round_trip = at == Time(100s) ? 500ms : 20ms;
    player::HandStep hand;
    hand.at = at;
    hand.round_trip_s = static_cast<float>(to_seconds(round_trip));
    hand.silence_s = 0;
    data.hand.push_back(hand);
    player::MachineStep machine;
    machine.at = at;
    machine.told.stamp.sequence = ++sequence;
    data.machine.push_back(machine);
    data.receipts.push_back({at, sequence});
    data.arrivals.push_back({at, at - round_trip, sequence, 1});
  }
  return data;
}

TEST(KeptOfRun, HasTenMinutesOfTheLinkUpToTheCursorAndNothingBehindIt) {
  const player::Run run(twelve_minutes());
  const MachineDescription machine = test::live_setup().machine;
  const Kinematics kinematics(machine);
  KeptOfRun kept(run, machine, kinematics);
  const auto latest = [&](Time at) {
    kept.show(at);
    float most = 0;
    for (std::size_t i = 0; i < kept.shown().link.size(); ++i)
      most = std::fmax(most, kept.shown().link.ago(i, LinkMeasure::kNewestRoundTrip).most);
    return most;
  };
  EXPECT_FLOAT_EQ(latest(Time(690s)), 0.5F) << "590 s ago";
  EXPECT_EQ(kept.shown().link.size(), LinkHistory::kSeconds);
  EXPECT_FLOAT_EQ(kept.shown().link.ago(590, LinkMeasure::kNewestRoundTrip).most, 0.5F);
  EXPECT_FLOAT_EQ(latest(Time(710s)), 0.02F) << "too long ago";
  EXPECT_FLOAT_EQ(latest(Time(99s)), 0.02F) << "yet to come";
  EXPECT_EQ(kept.shown().link.size(), 100u);
  EXPECT_FLOAT_EQ(latest(Time(101s)), 0.5F);
}

TEST(KeptOfRun, HasNoMinutesOfALinkWhoseOperatorsSideWasNotRecorded) {
  const test::TemporaryFolder folder;
  const player::Played played = player::load({test::one_side(folder, "press", false)});
  const Kinematics kinematics(played.machine);
  KeptOfRun kept(played.run, played.machine, kinematics);
  kept.show(played.run.last());
  for (std::size_t ago = 0; ago < kept.shown().link.size(); ++ago)
    EXPECT_TRUE(std::isnan(kept.shown().link.ago(ago, LinkMeasure::kLoss).most)) << "not 0 %";
}

std::size_t points(const ContactTrail& trail, Time now) {
  return static_cast<std::size_t>(std::count_if(trail.points().begin(), trail.points().end(), [now](const auto& point) {
    return ContactTrail::freshness(point, now) > 0;
  }));
}

TEST(KeptOfRun, HasTheTrailOfContactsUpToTheCursor) {
  const player::Played played = player::load({test::recorded("press")});
  const Kinematics kinematics(played.machine);
  KeptOfRun kept(played.run, played.machine, kinematics);
  ContactTrail trail;
  std::vector<std::pair<Time, ContactTrail>> had;
  for (Time at = played.run.first(); at <= played.run.last(); at += kFrame) {
    const ConsoleView view = played.run.view(at);
    if (!measured_freshness(view).stale()) (void)trail.watch(view, kinematics, reach_m(played.machine));
    had.emplace_back(at, trail);
  }
  ASSERT_GT(points(trail, played.run.last()), 0u) << "it presses on something";
  std::size_t without = 0;
  const auto check = [&](const auto& one) {
    kept.show(one.first);
    EXPECT_EQ(points(kept.shown().contacts, one.first), points(one.second, one.first)) << to_seconds(one.first);
    ASSERT_EQ(kept.shown().contacts.tip_m().has_value(), one.second.tip_m().has_value());
    if (one.second.tip_m())
      EXPECT_EQ(*kept.shown().contacts.tip_m(), *one.second.tip_m());
    else
      ++without;
  };
  std::for_each(had.rbegin(), had.rend(), check);
  EXPECT_GT(without, 10u) << "before the first contact there is none";
}

}  // namespace
}  // namespace knuckle::console::screens
