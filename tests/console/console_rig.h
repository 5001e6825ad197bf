// A console's loop on virtual time, with a person at the keys who looks 60 times a second.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/console/console_host.h"
#include "app/console/console_loop.h"
#include "app/console/hand_input.h"
#include "app/session/frame_log.h"
#include "app/session/session_setup.h"

namespace knuckle::test {

inline session::SimulateOptions simulated(const std::string& scenario, std::uint64_t seed = 1) {
  session::SimulateOptions options;
  options.scenario = scenario;
  options.seed = seed;
  return options;
}
inline session::SessionSetup live_setup(const std::string& scenario = "free_motion", std::uint64_t seed = 1) {
  return session::load_session(simulated(scenario, seed)).setup;
}

/// A new session of this setup.
inline std::unique_ptr<console::LiveSession> live_session(
    const session::SessionSetup& setup, console::LiveSession::Led led = console::LiveSession::Led::kByPerson) {
  return std::make_unique<console::LiveSession>(setup, led, nullptr);
}

struct ConsoleRig {
  explicit ConsoleRig(session::SessionSetup session_setup = live_setup(),
                      console::LiveSession::Led led = console::LiveSession::Led::kByPerson)
      : setup(std::move(session_setup)), loop(live_session(setup, led), true) {}

  /// Goes on for so long, a frame of the window every 16 ms unless it stalls.
  void run(double seconds) {
    const Time until = now + from_seconds(seconds);
    while (now < until) {
      now += 1ms;
      if (!stalled && now.time_since_epoch() % 16ms == Duration::zero()) look();
      loop.step(now);
      drain();
    }
  }
  void look() {
    input.hand = console::hand_from_keys(keys);
    input.at = now;
    input.attended = attended;
    loop.put(input);
    loop.take(view);
    loop.collect();
  }
  void drain() {
    TimedFrame frame;
    while (loop.next(frame)) frames.push_back(frame);
    if (stalled) return;
    console::ConsoleEvent event;
    while (loop.next(event)) events.push_back(event);
  }
  /// Enable is held until the machine is led. @return whether it came to that.
  bool engage() {
    keys.enable = true;
    for (int i = 0; i < 200 && view.machine.mode != Mode::kEngaged; ++i) run(0.05);
    return view.machine.mode == Mode::kEngaged;
  }
  /// Self test and start-up are over.
  void start_up() {
    for (int i = 0; i < 200 && view.machine.mode != Mode::kReady; ++i) run(0.05);
  }
  [[nodiscard]] session::NeutralTimes neutral_since(Time from) const {
    return session::neutral_times(frames, setup.machine, from, now);
  }

  session::SessionSetup setup;
  console::ConsoleLoop loop;
  Time now{};
  console::HeldKeys keys;
  console::ConsoleInput input;
  console::ConsoleView view;
  session::FrameLog frames;
  std::vector<console::ConsoleEvent> events;
  bool stalled = false, attended = true;
};

/// Engaged, and moving: the boom goes up.
inline void lead(ConsoleRig& rig) {
  rig.start_up();
  ASSERT_TRUE(rig.engage()) << text(rig.view.machine.blocking);
  rig.keys.boom_up = true;
  rig.run(1);
  ASSERT_EQ(rig.view.machine.mode, Mode::kEngaged);
  ASSERT_GT(rig.view.machine.velocity_radps[kBoom], 0.1);
}

inline void expect_neutral_within(const ConsoleRig& rig, Time from, Duration limit) {
  const session::NeutralTimes neutral = rig.neutral_since(from);
  ASSERT_TRUE(neutral.command.has_value());
  EXPECT_LE(*neutral.command - from, limit);
  ASSERT_TRUE(neutral.spool.has_value());
  EXPECT_LE(*neutral.spool - from, limit + 120ms);
}

inline bool told(const ConsoleRig& rig, console::ConsoleEventKind kind, bool on) {
  return std::any_of(rig.events.begin(), rig.events.end(),
                     [&](const console::ConsoleEvent& e) { return e.kind == kind && e.on == on; });
}

/// A window that draws nothing.
struct HostWindow {
  console::ConsoleHost& host;
  console::HeldKeys keys{};
  console::ConsoleInput input{};
  console::EventBook book{};
  /// Where the computer stood still for long enough to make what is held count no more, enable is let go of and pressed
  /// again, as a person would.
  bool presses_again = true;

  /// Goes on until it is so. @return false: it never was, for much longer than it can take.
  bool until(const std::function<bool(const console::ConsoleView&)>& so) {
    for (int frame = 0; frame < 60 * 120; ++frame) {
      input.attended = true;
      input.hand = console::hand_from_keys(keys);
      if (presses_again && host.view().input.release_enable) input.hand = {};
      input.at = host.now();
      host.put(input);
      for (console::ConsoleEvent event; host.next(event);) book.add(event, {});
      if (so(host.view())) return true;
      RealtimeClock clock;
      clock.sleep_until(clock.now() + 16ms);
    }
    return false;
  }
  bool until_mode(Mode mode) {
    return until([mode](const console::ConsoleView& view) { return view.link.heard && view.machine.mode == mode; });
  }
};

}  // namespace knuckle::test
