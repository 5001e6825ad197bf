// The console's thread as it runs behind a window: real time, real sockets. Nothing here judges how fast it was.
#include "app/console/console_host.h"

#include <gtest/gtest.h>

#include <sstream>
#include <vector>

#include "app/session/session_setup.h"
#include "core/error.h"
#include "slave/status_reporter.h"
#include "tests/console/console_rig.h"
#include "tests/support/candump.h"
#include "transport/udp_link.h"

namespace knuckle::test {
namespace {

using Led = console::LiveSession::Led;

TEST(ConsoleHostThread, KeysLeadTheMachineAndStopEndsItThoughEnableIsHeldOnAndEveryFrameIsLogged) {
  std::ostringstream candump;
  console::ConsoleHost host(simulated("free_motion"), Led::kByPerson, nullptr, &candump);
  HostWindow window{host};
  host.begin();
  ASSERT_TRUE(window.until_mode(Mode::kReady));
  window.keys.enable = true;
  ASSERT_TRUE(window.until_mode(Mode::kEngaged));
  const JointVector start_rad = host.view().machine.position_rad;
  window.keys.boom_up = true;
  ASSERT_TRUE(window.until(
      [&](const console::ConsoleView& v) { return v.machine.position_rad[kBoom] > start_rad[kBoom] + 0.1; }));
  window.input.stop = true;
  ASSERT_TRUE(window.until_mode(Mode::kFault));
  const double stopped_s = host.view().simulated_s;
  window.input.stop = false;
  window.presses_again = false;
  ASSERT_TRUE(window.until([&](const console::ConsoleView& v) { return v.simulated_s > stopped_s + 1; }));
  EXPECT_NE(host.view().machine.mode, Mode::kEngaged) << "enable is still held";
  host.stop();
  EXPECT_EQ(host.frames_lost(), 0u);
  std::istringstream log(candump.str());
  const std::vector<WireFrame> frames = read_candump(log);
  ASSERT_FALSE(frames.empty());
  EXPECT_GT(frames.back().at_s, stopped_s + 0.9) << "of the second after the stop, too";
  EXPECT_EQ(window.book.matching({console::Severity::kAlarm, "operator_stop"}).size(), 1u);
}

TEST(ConsoleHostThread, BeginsTheSessionAnewAsOftenAsAskedAndWithWhatWasChosen) {
  console::ConsoleHost host(simulated("free_motion"), Led::kByPerson, nullptr, nullptr);
  HostWindow window{host};
  host.begin();
  ASSERT_TRUE(window.until_mode(Mode::kReady));
  session::SimulateOptions slow = simulated("wall_contact");
  slow.delay_ms = 40;
  host.choose(slow, Led::kByPerson);
  for (std::uint32_t run = 2; run < 5; ++run) {
    ++window.input.reset_count;
    ASSERT_TRUE(window.until([run](const console::ConsoleView& v) { return v.run == run; }));
  }
  ASSERT_TRUE(window.until_mode(Mode::kReady));
  EXPECT_NEAR(host.view().link.round_trip_s, 0.08, 0.02);
}

TEST(ConsoleHostThread, LeadsAMachineOverTheNetworkAndStopReachesIt) {
  const session::SessionSetup setup = session::load_session(simulated("free_motion")).setup;
  UdpLink machine_end = UdpLink::listen("127.0.0.1:0");
  UdpLink operator_end = UdpLink::connect("127.0.0.1:" + std::to_string(machine_end.port()));
  session::SimulatedMachineSide far(setup.machine, setup.truth, setup.scenario, setup.seed, machine_end);
  far.side.report_status(setup.machine, true);
  const RealtimeClock clock;
  Time machine_time{};  // a clock of its own, that no busy computer makes jump
  RealtimeThread machine({.name = "machine", .period = 1ms}, clock, [&](Time /*now*/) {
    machine_time += 1ms;
    far.step(machine_time, [&] { far.side.step(machine_time); });
  });
  console::ConsoleHost host(console::station_setup(setup), operator_end, nullptr);
  HostWindow window{host};
  host.begin();
  ASSERT_TRUE(window.until_mode(Mode::kReady));
  window.input.stop = true;
  ASSERT_TRUE(window.until_mode(Mode::kFault));
  EXPECT_EQ(host.view().machine.fault.code, ReasonCode::kOperatorStop);
  host.stop();
  machine.stop();
  EXPECT_FALSE(far.side.slave.operator_input().message().presence);
}

TEST(ConsoleHost, RefusesWhatItCannotBeginAndKeepsWhatWasChosen) {
  console::ConsoleHost host(simulated("free_motion"), Led::kByPerson, nullptr, nullptr);
  EXPECT_THROW(host.choose(simulated("no_such_place"), Led::kByPerson), InputError);
  EXPECT_THROW(host.choose(simulated("recorded_dig"), Led::kByScenario), InputError);  // without its recording
  EXPECT_THROW(host.choose(simulated("link_faults"), Led::kByPerson), InputError);     // which would never happen
  EXPECT_EQ(host.session()->scenario.name, "free_motion");
  host.choose(simulated("recorded_dig"), Led::kByPerson);  // a person needs none
  EXPECT_EQ(host.session()->scenario.name, "recorded_dig");
}

}  // namespace
}  // namespace knuckle::test
