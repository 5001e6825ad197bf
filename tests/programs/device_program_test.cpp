// The haptic device as a program: in real time, at the other end of a packet socket pair.
#include "app/programs/device_program.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <algorithm>
#include <atomic>
#include <sstream>
#include <thread>

#include "app/programs/programs.h"
#include "machine/load.h"
#include "master/device_driver.h"
#include "tests/support/places.h"
#include "tests/support/run_inside.h"
#include "tests/support/says.h"
#include "transport/hid_file_port.h"
#include "transport/hid_reports.h"
#include "transport/link_messages.h"

namespace knuckle::programs {
namespace {

DeviceProgramSetup setup_of_the_shipped_device() {
  const std::string config = test::source_dir() + "/config/";
  DeviceProgramSetup setup;
  setup.device = load_device(config + "devices/knuckle1.toml");
  setup.plan.machine = load_machine(config + "machines/solar015.toml");
  setup.limb = sim::sample_limb(sim::LimbClass::kNormal, 1);
  setup.start_rad = JointVector(0.35, -1.5, -0.8);
  setup.serial = 77;
  return setup;
}

/// The program in a thread of its own, and a driver at the other end of the cable.
struct Rig {
  explicit Rig(DeviceProgramSetup what, Link* screen = nullptr) : setup(std::move(what)) {
    int ends[2] = {-1, -1};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET, 0, ends), 0);
    host.emplace(ends[0]);
    device.emplace(ends[1]);
    driver.emplace(setup.device, *host);
    program = std::thread([this, screen] {
      ProgramConsole console("test", told, false);
      outcome = run_device(setup, *device, screen, {[this] { return !stop; }, console}, &csv);
      ended = true;
    });
  }
  ~Rig() { end(); }
  void end() {
    stop = true;
    if (program.joinable()) program.join();
  }
  /// Drives until the condition holds, without saying how long that may take: far beyond this, something hangs.
  template <typename Condition>
  bool drive_until(Condition condition) {
    for (int i = 0; i < 60'000; ++i) {
      const Time now = clock.now();
      driver->step(now);
      driver->command(JointVector::Zero());
      if (condition()) return true;
      clock.sleep_until(now + 1ms);
    }
    return false;
  }

  DeviceProgramSetup setup;
  std::optional<HidFilePort> host, device;
  std::optional<master::DeviceDriver> driver;
  RealtimeClock clock;
  std::ostringstream told, csv;
  DeviceProgramOutcome outcome;
  std::atomic<bool> stop{false}, ended{false};
  std::thread program;
};

TEST(DeviceProgramThreads, ADriverTakesItForADeviceThatAHandHoldsStill) {
  Rig rig(setup_of_the_shipped_device());
  ASSERT_TRUE(rig.drive_until([&] { return rig.driver->reading().ok; })) << text(rig.driver->reading().reason);
  EXPECT_TRUE(rig.driver->reading().presence);
  EXPECT_FALSE(rig.driver->reading().enable);
  EXPECT_NEAR((rig.driver->reading().joint_rad - rig.setup.start_rad).norm(), 0, 0.01);
  rig.end();
  EXPECT_FALSE(rig.outcome.finished);  // there was nothing to finish
  EXPECT_TRUE(rig.outcome.phases.empty());
  const std::string csv = rig.csv.str();
  EXPECT_EQ(csv.rfind("time_s,forearm_rad,", 0), 0u);
  const std::string header = csv.substr(0, csv.find('\n'));
  const std::string row = csv.substr(header.size() + 1, csv.find('\n', header.size() + 1) - header.size() - 1);
  EXPECT_EQ(std::count(row.begin(), row.end(), ','), std::count(header.begin(), header.end(), ','));
}

/// Shows a machine that follows the hand and becomes engaged once the driver sees enable pressed.
struct Screen final : Link {
  bool send(std::span<const std::uint8_t>) noexcept override { return false; }
  bool receive(Datagram& datagram) noexcept override {
    if (turn++ % 3 == 2) return false;
    if (turn % 3 == 1) {
      SlaveMessage machine;
      machine.position_rad = pose;
      machine.mode = engaged ? Mode::kEngaged : Mode::kReady;
      datagram = encode(machine);
    } else {
      MasterMessage asked;
      asked.position_rad = pose;
      datagram = encode(asked);
    }
    return true;
  }
  JointVector pose;
  std::atomic<bool> engaged{false};
  int turn = 0;
};

TEST(DeviceProgramThreads, ItsOperatorActsOnWhatTheScreenShowsAndTheProgramEndsWithTheOperator) {
  DeviceProgramSetup setup = setup_of_the_shipped_device();
  setup.plan.phases = {{.kind = sim::PhaseKind::kEngage, .timeout_s = 50},
                       {.kind = sim::PhaseKind::kLetGo, .duration_s = 0.1}};
  setup.plan.phase_names = {"engage", "let_go"};
  Screen screen;
  screen.pose = setup.start_rad;
  Rig rig(setup, &screen);
  ASSERT_TRUE(rig.drive_until([&] { return rig.driver->reading().enable; }));  // the machine is ready and aligned
  screen.engaged = true;
  ASSERT_TRUE(rig.drive_until([&] { return rig.ended.load(); }));
  rig.end();
  EXPECT_TRUE(rig.outcome.finished);
  ASSERT_EQ(rig.outcome.phases.size(), 2u);
  EXPECT_EQ(rig.outcome.phases[1].name, "let_go");
  EXPECT_FALSE(rig.outcome.phases[0].timed_out);
  EXPECT_TRUE(test::says(rig.told.str(), "operator: engage"));
}

TEST(DeviceProgramThreads, BreaksWhatItWasAskedToAndTellsWhenTheDeviceTakesItsTorqueAway) {
  DeviceProgramSetup setup = setup_of_the_shipped_device();
  setup.faults = {parse_device_fault("truncated@0+0.5")};
  Rig rig(setup);
  ASSERT_TRUE(rig.drive_until([&] { return rig.driver->reading().reason.code == ReasonCode::kDeviceReport; }));
  ASSERT_TRUE(rig.drive_until([&] { return rig.driver->reading().ok; }));
  // The host falls silent while torque is on.
  HidReport report;
  const auto latched = [&] {
    bool seen = false;
    while (rig.host->read(report)) {
      const auto state = decode_state(report);
      seen = seen || (state && (state->status & kDeviceLatched) != 0);
    }
    return seen;
  };
  bool seen = false;
  for (int i = 0; i < 60'000 && !seen; ++i) {
    rig.clock.sleep_until(rig.clock.now() + 1ms);
    seen = latched();
  }
  EXPECT_TRUE(seen);
  rig.end();
  ASSERT_EQ(rig.outcome.faults.size(), 2u);
  EXPECT_TRUE(rig.outcome.faults[0].broken && !rig.outcome.faults[1].broken);
  ASSERT_FALSE(rig.outcome.latches.empty());
  EXPECT_EQ(rig.outcome.latches.back().fault & kDeviceFaultWatchdog, kDeviceFaultWatchdog);
}

TEST(DeviceCommands, PrintTheReportDescriptorAGadgetIsSetUpWith) {
  const test::ProgramRun run = test::run_inside([] {
    return cli::parse_command_line({"knuckle", "", "", {device_entry()}}, {"device", "--descriptor", "-"}).run();
  });
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.out, std::string(kHidReportDescriptor.begin(), kHidReportDescriptor.end()));
}

}  // namespace
}  // namespace knuckle::programs
