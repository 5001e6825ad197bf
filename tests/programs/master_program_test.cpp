// The operator side's program with a simulated device, against the programs of machine side and nodes.
#include "app/programs/master_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "sim/haptic_device.h"
#include "sim/person.h"
#include "tests/programs/program_rig.h"
#include "tests/support/says.h"
#include "transport/hid_reports.h"

namespace knuckle::test {
namespace {

/// The machine's messages do not arrive while it is cut; the operator's do.
struct CutLink : Link {
  explicit CutLink(UdpLink wire) : udp(std::move(wire)) {}
  bool send(std::span<const std::uint8_t> bytes) noexcept override { return udp.send(bytes); }
  bool receive(Datagram& datagram) noexcept override { return udp.receive(datagram) && !cut; }
  UdpLink udp;
  std::atomic<bool> cut{false};
};

/// A hand on a simulated haptic device at the far end of a cable, and the operator's side as its program runs it.
class Desk {
 public:
  /// @param name of the machine that it leads; empty: the right one.
  explicit Desk(const std::string& address, const std::string& name = "") : link_(UdpLink::connect(address)) {
    setup_.device = load_device(find_config("device", "knuckle1"));
    setup_.machine = machine();
    if (!name.empty()) setup_.machine.name = name;
    setup_.start = random_start();
    hand_.emplace(setup_.device, sim::sample_limb(sim::LimbClass::kNormal, 1), cable_.device(), 1, kStart);
    mean([](sim::OperatorIntent& intent) {
      intent.joint_rad = kStart;
      intent.presence = true;
    });
    firmware_.emplace(RealtimeOptions{.name = "device", .period = 1ms, .fifo_priority = 65}, RealtimeClock(),
                      [this](Time now) { step(now); });
    master_thread_ = std::thread([this] {
      programs::ProgramConsole console("master", said.stream, false);
      outcome =
          programs::run_master(setup_, cable_.host(), link_, {[this] { return !end_; }, console}, {}, &csv.stream);
    });
  }
  ~Desk() { end(); }
  Desk(const Desk&) = delete;
  Desk& operator=(const Desk&) = delete;

  void mean(const std::function<void(sim::OperatorIntent&)>& change) {
    change(meant_);
    intents_.put(meant_);
  }
  /// As SIGTERM does.
  void end() {
    end_ = true;
    if (master_thread_.joinable()) master_thread_.join();
  }
  /// What the device says last; reports that the program did not read any more.
  [[nodiscard]] std::optional<DeviceState> last_state() {
    std::optional<DeviceState> last;
    HidReport report;
    while (cable_.host().read(report)) {
      if (const auto state = decode_state(report)) last = state;
    }
    return last;
  }

  void deafen(bool deaf) { link_.cut = deaf; }

  Heard said, csv;
  programs::MasterOutcome outcome;  // after end()

 private:
  void step(Time now) noexcept {
    intents_.take(intent_);
    hand_->step(now, intent_);
  }
  recording::OperatorSetup setup_;
  ThreadHid cable_;
  CutLink link_;
  sim::OperatorIntent meant_, intent_;  // the test's thread; the device's
  Mailbox<sim::OperatorIntent> intents_;
  std::optional<sim::HandAndDevice> hand_;
  std::atomic<bool> end_{false};
  std::optional<RealtimeThread> firmware_;
  std::thread master_thread_;
};

/// Where the machine is, by what its own program says last.
bool engage(Desk& desk, Site& site) {
  for (int attempt = 0; attempt < 10; ++attempt) {
    desk.mean([](sim::OperatorIntent& intent) { intent.enable = false; });
    if (!eventually([&] { return site.slave_said.says("enable_not_pressed"); })) return false;
    site.slave_said.forget();
    desk.mean([](sim::OperatorIntent& intent) { intent.enable = true; });
    const bool decided = eventually([&] { return site.slave_said.says("engaged") || site.slave_said.says("fault"); });
    if (decided && site.slave_said.says("engaged")) return true;
  }
  return false;
}

TEST(ProgramThreads, AMachineIsNotLedAsAnotherAndBothNamesAreTold) {
  Site site;
  Desk desk(site.address(), "compact080");
  EXPECT_TRUE(eventually([&] { return desk.said.says("other_machine: "); })) << desk.said.text();
  EXPECT_TRUE(desk.said.says("(here compact080, there " + machine().name + ")")) << desk.said.text();
  EXPECT_TRUE(eventually([&] { return site.slave_said.says("no_presence"); })) << "though somebody holds the device";
  desk.mean([](sim::OperatorIntent& intent) { intent.enable = true; });
  EXPECT_TRUE(eventually([&] { return desk.csv.says(",1,1,0,0,"); })) << "presence and enable, as the device has them";
  desk.end();
  EXPECT_FALSE(site.slave_said.says("engaged")) << site.slave_said.text();
}

TEST(ProgramThreads, AnOperatorIsToldWhyLessIsFeltAndWhenThatIsOver) {
  Site site;
  Desk desk(site.address());
  ASSERT_TRUE(engage(desk, site)) << site.slave_said.text() << desk.said.text();
  ASSERT_TRUE(eventually([&] { return desk.said.says("machine engaged"); })) << desk.said.text();
  EXPECT_FALSE(desk.said.says("felt force")) << desk.said.text();
  desk.deafen(true);
  EXPECT_TRUE(eventually([&] { return desk.said.says("felt force: cues_silence: "); })) << desk.said.text();
  desk.deafen(false);
  EXPECT_TRUE(eventually([&] { return desk.said.says("felt force is back in full"); })) << desk.said.text();
  desk.end();
  EXPECT_TRUE(std::any_of(desk.outcome.events.begin(), desk.outcome.events.end(), [](const auto& event) {
    return event.about == programs::MasterEvent::About::kFelt && event.warning.code == ReasonCode::kCuesSilence;
  }));
}

TEST(ProgramThreads, ADeviceLeadsAMachineIsWrittenDownAndLetsGoOfBothAtTheEnd) {
  Site site;
  Desk desk(site.address());
  ASSERT_TRUE(engage(desk, site)) << site.slave_said.text() << desk.said.text();
  EXPECT_TRUE(eventually([&] { return desk.said.says("machine engaged"); })) << desk.said.text();
  EXPECT_TRUE(desk.said.says("device is ready"));
  ASSERT_TRUE(eventually([&] { return desk.csv.says(",engaged,none,0,0,0,none,"); })) << "mode, blocking, fault";
  desk.mean([](sim::OperatorIntent& intent) { intent.joint_rad[kArm] += 0.1; });
  EXPECT_TRUE(eventually([&] { return driving_frames(site) > 10; })) << "the machine follows the hand";
  site.slave_said.forget();
  desk.end();
  EXPECT_TRUE(eventually([&] { return site.slave_said.says("ready"); })) << site.slave_said.text();
  EXPECT_FALSE(site.slave_said.says("fault")) << "it was let go of, not lost: " << site.slave_said.text();
  std::optional<DeviceState> state;
  ASSERT_TRUE(eventually([&] { return (state = desk.last_state()).has_value(); }));
  EXPECT_EQ(state->status & kDeviceTorqueOn, 0) << "no torque";
  EXPECT_TRUE(desk.said.says("stopped: machine and device released"));
  EXPECT_EQ(desk.outcome.records_lost, 0U);
  EXPECT_GT(desk.outcome.round_trip.count(), 0U);
  ASSERT_TRUE(desk.outcome.machine_status) << "the machine's side told of itself";
  EXPECT_EQ(desk.outcome.machine_status->period, 5ms);
  EXPECT_GT(desk.outcome.machine_status->steps, 0U);
  std::istringstream table(desk.csv.text());
  std::string header, row;
  ASSERT_TRUE(std::getline(table, header));
  for (const char* column :
       {"time_s,device_ok,presence,enable,clutch,stop", "forearm_rad,wrist_rad,finger_rad", "setpoint_boom_rad",
        "sent_force_x_N", "round_trip_s", "mode", "tip_force_z_N", "confidence"}) {
    EXPECT_TRUE(test::says(header, column));
  }
  const auto columns = std::count(header.begin(), header.end(), ',');
  double before_s = -1;
  int rows = 0;
  for (; std::getline(table, row); ++rows) {
    ASSERT_EQ(std::count(row.begin(), row.end(), ','), columns) << row;
    const double at_s = std::stod(row);
    EXPECT_GT(at_s, before_s);
    before_s = at_s;
  }
  EXPECT_GT(rows, 10);
  EXPECT_LE(rows, 200 * desk.outcome.ran_s + 1);
}

TEST(ProgramThreads, WithoutAMachineTheOperatorsSideSaysThatItHearsNothing) {
  UdpLink nobody = UdpLink::listen("127.0.0.1:0");
  Desk desk("127.0.0.1:" + std::to_string(nobody.port()));
  EXPECT_TRUE(eventually([&] { return desk.said.says("device is ready"); })) << desk.said.text();
  desk.end();
  EXPECT_FALSE(desk.said.says("machine ready"));
  for (const programs::MasterEvent& event : desk.outcome.events) EXPECT_FALSE(event.heard);
}

}  // namespace
}  // namespace knuckle::test
