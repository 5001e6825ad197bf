// A console whose loop drives a machine that is elsewhere, on virtual time: either may stand still while the other goes
// on.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "app/console/console_loop.h"
#include "app/session/session_sides.h"
#include "slave/status_reporter.h"
#include "tests/console/console_rig.h"
#include "transport/impaired_link.h"

namespace knuckle::test {

/// A console with a simulated hand, over a link to a machine that goes on whatever the console does.
struct FarRig {
  explicit FarRig(session::SessionSetup session_setup = live_setup()) : setup(std::move(session_setup)) {
    far.side.report_status(setup.machine, true);
  }

  session::SessionSetup setup;
  ImpairedLink network{{}, {}, 1};
  session::SimulatedMachineSide far{setup.machine, setup.truth, setup.scenario, setup.seed, network.b()};
  console::ConsoleLoop loop{
      std::make_unique<console::OperatorStation>(console::station_setup(setup), network.a(), nullptr)};
  console::HeldKeys keys;
  console::ConsoleInput input;
  console::ConsoleView view;
  Time now{};
  bool runs = true, told = false;

  void run(Duration time) {
    for (const Time until = now + time; now < until;) {
      now += 1ms;
      network.advance(now);
      far.step(now, [this] { far.side.step(now); });
      if (!runs) continue;
      input.hand = console::hand_from_keys(keys);
      input.at = now;
      input.attended = true;
      loop.put(input);
      loop.step(now);
      loop.take(view);
      for (console::ConsoleEvent event; loop.next(event);) told |= event.kind == console::ConsoleEventKind::kOwnPause;
    }
  }
  void engage() {
    run(5s);
    keys.enable = true;
    run(5s);
    ASSERT_EQ(view.machine.mode, Mode::kEngaged) << text(view.machine.blocking);
  }
};

}  // namespace knuckle::test
