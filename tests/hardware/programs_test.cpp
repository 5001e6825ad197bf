// The programs of machine side and nodes against each other, in threads, over a bus and a link that exist anywhere:
// which modes they pass, in which order things go over the wire, and what they say. Never how long it took.
#include <gtest/gtest.h>

#include <optional>
#include <thread>

#include "app/hardware/node_program.h"
#include "app/hardware/program_options.h"
#include "app/hardware/slave_program.h"
#include "core/error.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "tests/hardware/program_rig.h"
#include "transport/canopen.h"
#include "transport/link_messages.h"
#include "transport/udp_link.h"

namespace knuckle::test {
namespace {

using app::ModeEvent;

const JointVector kStart(0.7, -1.3, -0.7);

MachineDescription machine() {
  return load_machine(find_config("machine", "solar015"));
}

/// A machine's nodes and its machine side, each as its program runs it.
class Site {
 public:
  explicit Site(std::vector<std::string> faults = {}) : wire_(machine_.bus.bit_rate) {
    setup_.truth = sim::nominal_truth(machine_);
    setup_.start_rad = kStart;
    for (const std::string& fault : faults) setup_.faults.push_back(app::parse_fault(fault, machine_.bus));
    node_thread_ = std::thread([this] {
      app::ProgramConsole console("node", node_said.stream, false);
      node = app::run_node(setup_, wire_.nodes(), {[this] { return !end_node_; }, console}, signals, &truth.stream);
    });
    slave_thread_ = std::thread([this] {
      app::ProgramConsole console("slave", slave_said.stream, false);
      slave = app::run_slave(machine_, wire_.slave(), link_, {[this] { return !end_slave_; }, console},
                             {&candump.stream, "can7", &csv.stream});
    });
  }
  ~Site() {
    end_slave();
    end_node();
  }
  Site(const Site&) = delete;
  Site& operator=(const Site&) = delete;

  /// As SIGTERM does.
  void end_slave() {
    end_slave_ = true;
    if (slave_thread_.joinable()) slave_thread_.join();
  }
  void end_node() {
    end_node_ = true;
    if (node_thread_.joinable()) node_thread_.join();
  }
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(link_.port()); }
  [[nodiscard]] app::FrameLog frames() const { return wire_.frames(); }
  [[nodiscard]] const MachineDescription& description() const { return machine_; }

  Heard node_said, slave_said, candump, csv, truth;
  app::NodeOutcome node;    // after end_node()
  app::SlaveOutcome slave;  // after end_slave()
  std::atomic<std::uint32_t> signals{0};

 private:
  MachineDescription machine_ = machine();
  app::NodeSetup setup_;
  Wire wire_;
  UdpLink link_ = UdpLink::listen("127.0.0.1:0");
  std::atomic<bool> end_slave_{false}, end_node_{false};
  std::thread node_thread_, slave_thread_;
};

/// An operator's side in the test's hand: says 500 times a second what the test wants it to.
class Hand {
 public:
  explicit Hand(const std::string& address) : link_(UdpLink::connect(address)) {
    said_.device_ok = said_.presence = true;
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  void say(const std::function<void(MasterMessage&)>& change) {
    const std::lock_guard lock(mutex_);
    change(said_);
  }
  /// Nothing is sent any more, or again.
  void silent(bool on) { silent_ = on; }
  /// Follows the machine's pose, as an aligned hand does.
  [[nodiscard]] std::optional<SlaveMessage> machine() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  [[nodiscard]] bool sees(Mode mode) const {
    const auto told = machine();
    return told && told->mode == mode;
  }

 private:
  void run(const std::stop_token& stop) {
    const RealtimeClock clock;
    Datagram datagram;
    while (!stop.stop_requested()) {
      {
        const std::lock_guard lock(mutex_);
        while (link_.receive(datagram)) {
          if (const auto told = decode_slave(datagram.view())) heard_ = told;
        }
        ++said_.sequence;
        said_.sent_at = clock.now();
        if (heard_) said_.echoed_slave_time = heard_->sent_at;
        if (heard_ && heard_->mode != Mode::kEngaged) said_.position_rad = heard_->position_rad;
        if (!silent_) link_.send(encode(said_).view());
      }
      clock.sleep_until(clock.now() + 2ms);
    }
  }
  UdpLink link_;
  mutable std::mutex mutex_;
  MasterMessage said_;
  std::optional<SlaveMessage> heard_;
  std::atomic<bool> silent_{false};
  std::jthread thread_;
};

/// Presses enable once the machine is ready for it, and waits until it is led.
bool engage(Hand& hand) {
  hand.say([](MasterMessage& m) { m.enable = false; });
  if (!eventually([&] {
        const auto told = hand.machine();
        return told && told->blocking.code == ReasonCode::kEnableNotPressed;
      })) {
    return false;
  }
  hand.say([](MasterMessage& m) { m.enable = true; });
  return eventually([&] { return hand.sees(Mode::kEngaged); });
}

std::vector<Mode> modes_of(const app::SlaveOutcome& outcome) {
  std::vector<Mode> modes;
  for (const ModeEvent& event : outcome.events) {
    if (modes.empty() || modes.back() != event.mode) modes.push_back(event.mode);
  }
  return modes;
}

/// Set-points with the valves ACTIVE and not at zero, from this place of the log on.
int driving_frames(const Site& site, std::size_t from = 0) {
  const app::FrameLog log = site.frames();
  int count = 0;
  for (std::size_t i = from; i < log.size(); ++i) {
    for (const auto& valve : site.description().bus.valves) {
      if (log[i].frame.id != canopen::rpdo1_id(valve.id)) continue;
      const auto told = canopen::parse_valve_command(log[i].frame);
      if (told && told->set_point != 0 && (told->control_word & 7) == canopen::kControlActive) ++count;
    }
  }
  return count;
}

TEST(ProgramThreads, AnEngagedSessionGoesThroughItsModesInOrder) {
  Site site;
  Hand hand(site.address());
  ASSERT_TRUE(engage(hand)) << site.slave_said.text();
  const JointVector was = hand.machine()->position_rad;
  hand.say([](MasterMessage& m) { m.position_rad[kArm] += 0.05; });
  EXPECT_TRUE(eventually([&] { return hand.machine()->position_rad[kArm] > was[kArm] + 0.02; })) << "it follows";
  hand.say([](MasterMessage& m) { m.enable = false; });
  EXPECT_TRUE(eventually([&] { return hand.sees(Mode::kReady); }));
  site.end_slave();
  EXPECT_EQ(modes_of(site.slave), (std::vector<Mode>{Mode::kSelfTest, Mode::kReady, Mode::kAligning, Mode::kEngaged,
                                                     Mode::kReady, Mode::kOff}));
  EXPECT_TRUE(site.slave.unconfirmed.empty());
  EXPECT_EQ(site.slave.records_lost, 0U);
  EXPECT_EQ(site.slave.malformed_datagrams, 0U);
  EXPECT_TRUE(site.slave.loop.policy.starts_with("SCHED_"));
  EXPECT_TRUE(site.slave_said.says("slave loop runs as SCHED_"));
  EXPECT_TRUE(site.slave_said.says("engaged"));
}

TEST(ProgramThreads, AToldEndGoesNeutralThenDisablesThenFallsSilent) {
  Site site;
  Hand hand(site.address());
  ASSERT_TRUE(engage(hand)) << site.slave_said.text();
  hand.say([](MasterMessage& m) { m.position_rad[kBoom] += 0.1; });
  ASSERT_TRUE(eventually([&] { return driving_frames(site) > 10; }));
  site.end_slave();
  EXPECT_TRUE(eventually([&] { return hand.sees(Mode::kOff); })) << "the operator is told";
  EXPECT_TRUE(site.slave_said.says("stopped: valves disabled, pilot pressure off")) << site.slave_said.text();

  const auto& bus = site.description().bus;
  std::ptrdiff_t last_driving = -1, hold = -1, disabled = -1, release = -1, last_sync = -1, last_heartbeat = -1;
  const app::FrameLog log = site.frames();
  for (std::size_t n = 0; n < log.size(); ++n) {
    const CanFrame& frame = log[n].frame;
    const auto i = static_cast<std::ptrdiff_t>(n);
    if (frame.id == canopen::rpdo1_id(bus.valves[0].id)) {
      const auto told = canopen::parse_valve_command(frame);
      const unsigned word = told->control_word & 7U;
      if (word == canopen::kControlActive && told->set_point != 0) last_driving = i;
      if (word == canopen::kControlHold && told->set_point == 0) hold = i;
      if (word == canopen::kControlDisabled) disabled = i;
    } else if (frame.id == canopen::kNmtId &&
               canopen::parse_nmt(frame)->command == canopen::NmtCommand::kEnterPreOperational) {
      release = i;
    } else if (frame.id == canopen::kSyncId) {
      last_sync = i;
    } else if (frame.id == canopen::heartbeat_id(bus.controller_id)) {
      last_heartbeat = i;
    }
  }
  EXPECT_GE(last_driving, 0);
  EXPECT_LT(last_driving, hold);
  EXPECT_LT(hold, disabled);
  EXPECT_LT(disabled, release);
  EXPECT_LT(last_sync, last_heartbeat) << "heartbeats go on until all is off";
  EXPECT_EQ(canopen::parse_heartbeat(log[static_cast<std::size_t>(last_heartbeat)].frame), canopen::NmtState::kStopped);
}

TEST(ProgramThreads, ASilentOperatorEndsNeutralAndOnlyANewPressResumes) {
  Site site;
  Hand hand(site.address());
  ASSERT_TRUE(engage(hand)) << site.slave_said.text();
  hand.say([](MasterMessage& m) { m.position_rad[kBoom] += 0.2; });
  ASSERT_TRUE(eventually([&] { return driving_frames(site) > 10; }));
  hand.silent(true);
  ASSERT_TRUE(eventually([&] { return site.slave_said.says("fault link_lost"); })) << site.slave_said.text();
  const std::size_t latched = site.frames().size();
  hand.silent(false);  // with enable still pressed
  ASSERT_TRUE(eventually([&] {
    const auto told = hand.machine();
    return told && told->mode == Mode::kFault && told->blocking.code == ReasonCode::kReleaseToRecover;
  }));
  std::this_thread::sleep_for(200ms);  // it would have moved by now
  EXPECT_EQ(driving_frames(site, latched), 0);
  EXPECT_TRUE(hand.sees(Mode::kFault));
  EXPECT_TRUE(engage(hand)) << "let go and pressed again";
}

TEST(ProgramThreads, NodesBreakAsPlannedAndTheMachineSideSaysWhatIsWrong) {
  Site site({"node_silent:arm_encoder@usr1"});
  Hand hand(site.address());
  ASSERT_TRUE(engage(hand)) << site.slave_said.text();
  ++site.signals;
  ASSERT_TRUE(eventually([&] { return site.slave_said.says("fault sensor_stale: node 0x31"); }))
      << site.slave_said.text();
  EXPECT_TRUE(eventually([&] { return site.node_said.says("broken: node_silent:arm_encoder@usr1"); }));
  site.end_slave();
  site.end_node();
  ASSERT_EQ(site.node.faults.size(), 1U);
  EXPECT_LT(site.node.faults[0].mended_at_s, 0);
}

TEST(ProgramThreads, RecordsHoldEveryFrameAndEveryMeasurement) {
  Site site;
  Hand hand(site.address());
  ASSERT_TRUE(eventually([&] { return hand.sees(Mode::kReady); })) << site.slave_said.text();
  site.end_slave();
  site.end_node();
  EXPECT_TRUE(site.candump.says(" can7 080#\n")) << "what it sent";
  EXPECT_TRUE(site.candump.says(" can7 1A0#")) << "what it heard";
  const std::string csv = site.csv.text();
  EXPECT_EQ(csv.rfind("time_s,boom_head_Pa,boom_rod_Pa,", 0), 0U);
  EXPECT_NE(csv.find(",ready,"), std::string::npos);
  const std::string truth = site.truth.text();
  EXPECT_GT(std::count(truth.begin(), truth.end(), '\n'), 10);
  EXPECT_EQ(site.node.records_lost, 0U);
}

}  // namespace
}  // namespace knuckle::test
