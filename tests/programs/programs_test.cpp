// The machine side's program and the nodes' against each other, in threads, over a bus and a link that exist anywhere:
// which modes they pass, in which order things go over the wire, and what they say. Never how long it took.
#include <gtest/gtest.h>

#include <thread>

#include "tests/programs/program_rig.h"
#include "tests/support/says.h"

namespace knuckle::test {
namespace {

using programs::ModeEvent;

/// Modes in the order they were told, faults of a busy computer and the way back from them left in.
std::vector<Mode> modes_of(const programs::SlaveOutcome& outcome) {
  std::vector<Mode> modes;
  for (const ModeEvent& event : outcome.events) {
    if (modes.empty() || modes.back() != event.mode) modes.push_back(event.mode);
  }
  return modes;
}

bool in_order(const std::vector<Mode>& modes, const std::vector<Mode>& wanted) {
  auto next = wanted.begin();
  for (const Mode mode : modes) {
    if (next != wanted.end() && mode == *next) ++next;
  }
  return next == wanted.end();
}

std::string names_of(const std::vector<Mode>& modes) {
  std::string text;
  for (const Mode mode : modes) text += std::string(name(mode)) + " ";
  return text;
}

TEST(ProgramThreads, AnEngagedSessionGoesThroughItsModesInOrderAndRecordsAllOfIt) {
  Site site;
  Hand hand(site.address());
  ASSERT_TRUE(engage(hand)) << site.slave_said.text();
  const JointVector was = hand.machine()->position_rad;
  hand.lead(kArm, 0.05);
  EXPECT_TRUE(eventually([&] { return hand.machine()->position_rad[kArm] > was[kArm] + 0.02; })) << "it follows";
  EXPECT_TRUE(eventually([&] {
    const auto status = hand.status();
    return status && status->pilot_on && status->acted_report_at != kNever && status->buses[0].load > 0.05;
  })) << "it tells of itself, and whose hand is on the valves";
  hand.say([](MasterMessage& m) { m.enable = false; });
  EXPECT_TRUE(eventually([&] { return hand.sees(Mode::kReady); }));
  site.end_slave();
  const std::vector<Mode> modes = modes_of(site.slave);
  EXPECT_TRUE(
      in_order(modes, {Mode::kSelfTest, Mode::kReady, Mode::kAligning, Mode::kEngaged, Mode::kReady, Mode::kOff}))
      << names_of(modes);
  EXPECT_EQ(modes.back(), Mode::kOff);
  for (std::size_t i = 1; i < modes.size(); ++i) {
    if (modes[i] == Mode::kEngaged) {
      EXPECT_TRUE(modes[i - 1] == Mode::kAligning || modes[i - 1] == Mode::kHold) << names_of(modes);
    }
  }
  EXPECT_TRUE(site.slave.unconfirmed.empty());
  EXPECT_EQ(site.slave.records_lost, 0U);
  EXPECT_EQ(site.slave.malformed_datagrams, 0U);
  EXPECT_TRUE(site.slave.loop.policy.starts_with("SCHED_"));
  EXPECT_TRUE(site.slave_said.says("slave loop runs as SCHED_"));
  EXPECT_TRUE(site.slave_said.says("engaged"));
  site.end_node();
  EXPECT_TRUE(site.candump.says(" can7 080#\n")) << "what it sent";
  EXPECT_TRUE(site.candump.says(" can7 1A0#")) << "what it heard";
  const std::string csv = site.csv.text(), truth = site.truth.text();
  EXPECT_EQ(csv.rfind("time_s,mode,", 0), 0U);
  EXPECT_TRUE(test::says(csv, ",ready,"));
  EXPECT_GT(std::count(truth.begin(), truth.end(), '\n'), 10);
  EXPECT_EQ(site.node.records_lost, 0U);
}

/// A bus on which somebody else's SYNC is heard, one before each step.
class LedByAnother final : public CanBus {
 public:
  bool send(const CanFrame&) noexcept override {
    ++sent;
    return true;
  }
  bool receive(CanFrame& frame) noexcept override {
    frame = canopen::sync_frame();
    const bool more = !drained_;
    drained_ = more;
    if (more) ++heard;
    return more;
  }
  [[nodiscard]] CanState state() const noexcept override { return CanState::kActive; }
  std::atomic<int> sent{0}, heard{0};

 private:
  bool drained_ = false;
};

TEST(ProgramThreads, WhoHasNeverCommandedEndsWithoutAFrameOnAnothersMachine) {
  LedByAnother bus;
  UdpLink link = UdpLink::listen("127.0.0.1:0");
  Heard said;
  constexpr double kPatience_s = 60;
  programs::SlaveOutcome outcome;
  {
    programs::ProgramConsole console("slave", said.stream, false);  // says the last at its end
    outcome = programs::run_slave(machine(), bus, link, random_start(),
                                  {[&bus] { return bus.heard < 20; }, console, kPatience_s});
  }
  EXPECT_GE(bus.heard, 20);
  EXPECT_EQ(bus.sent, 0);
  EXPECT_TRUE(said.says("stopped: nothing was commanded, so nothing was sent")) << said.text();
  EXPECT_FALSE(outcome.commanded);
  EXPECT_TRUE(outcome.unconfirmed.empty());
}

TEST(ProgramThreads, AToldEndGoesNeutralThenDisablesThenFallsSilent) {
  Site site;
  Hand hand(site.address());
  ASSERT_TRUE(engage(hand)) << site.slave_said.text();
  hand.lead(kBoom, 0.1);
  ASSERT_TRUE(eventually([&] { return driving_frames(site) > 10; }));
  site.end_slave();
  EXPECT_TRUE(eventually([&] { return hand.sees(Mode::kOff); })) << "the operator is told";
  EXPECT_TRUE(site.slave_said.says("stopped: valves disabled, pilot pressure off")) << site.slave_said.text();

  const auto& bus = site.description().bus;
  std::ptrdiff_t last_driving = -1, hold = -1, disabled = -1, release = -1, last_sync = -1, last_heartbeat = -1;
  const session::FrameLog log = site.frames();
  for (std::size_t n = 0; n < log.size(); ++n) {
    const CanFrame& frame = log[n].frame;
    const auto i = static_cast<std::ptrdiff_t>(n);
    if (frame.id == canopen::rpdo1_id(bus.valve(0).id)) {
      const auto told = canopen::parse_valve_command(frame);
      const unsigned word = told->control_word & 7U;
      if (word == canopen::kControlActive && told->set_point != 0) last_driving = i;
      if (word == canopen::kControlHold && told->set_point == 0) hold = i;
      if (word == canopen::kControlDisabled) disabled = i;
    } else if (frame.id == canopen::kNmtId &&
               canopen::parse_nmt(frame)->command == canopen::NmtCommand::kResetCommunication) {
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
  EXPECT_LT(last_heartbeat, release) << "nodes would call our silence a fault";
  EXPECT_EQ(canopen::parse_heartbeat(log[static_cast<std::size_t>(last_heartbeat)].frame), canopen::NmtState::kStopped);
}

TEST(ProgramThreads, NodesBreakAsPlannedAndTheMachineSideSaysWhatIsWrong) {
  Site site({"node_silent:arm_encoder@usr1"});
  Hand hand(site.address());
  ASSERT_TRUE(engage(hand)) << site.slave_said.text();
  ++site.signals;
  ASSERT_TRUE(eventually([&] { return site.slave_said.says("fault sensor_stale: arm_encoder (node 0x31): "); }))
      << site.slave_said.text();
  EXPECT_TRUE(eventually([&] { return site.node_said.says("fault injected: node_silent:arm_encoder@usr1"); }));
  site.end_slave();
  site.end_node();
  ASSERT_EQ(site.node.faults.size(), 1U);
  EXPECT_LT(site.node.faults[0].mended_at_s, 0);
}

std::ptrdiff_t frames_with(const Site& site, std::uint32_t id) {
  const session::FrameLog log = site.frames();
  return std::count_if(log.begin(), log.end(), [id](const TimedFrame& timed) { return timed.frame.id == id; });
}

TEST(SlaveOutcome, KeepsOneOfEachNodesCodesHoweverTheyAlternate) {
  programs::SlaveOutcome outcome;
  const auto hears = [&outcome](Time at, std::uint8_t node, std::uint16_t code) {
    return outcome.add({at, node, {code, 1, {}}});
  };
  int told = 0;
  for (int i = 0; i < 1000; ++i)
    for (const std::uint16_t code : {std::uint16_t{0x5030}, std::uint16_t{0}})
      told += hears(Time{} + i * 1s, 0x25, code) ? 1 : 0;
  EXPECT_EQ(told, 2);
  EXPECT_TRUE(hears(Time(1h), 0x24, 0x5030)) << "another node";
  ASSERT_EQ(outcome.emergencies.size(), 3U);
  EXPECT_EQ(outcome.emergencies[0].times, 1000U);
  EXPECT_EQ(outcome.emergencies[0].first.at, Time{});
  EXPECT_EQ(outcome.emergencies[0].last_at, Time(999s));
  EXPECT_EQ(outcome.records_lost, 0U);
}

TEST(SlaveOutcome, CountsTheCodesOfANodeThatMakesUpEverNewOnes) {
  programs::SlaveOutcome outcome;
  for (int code = 0; code < 1000; ++code) outcome.add({Time{}, 0x25, {static_cast<std::uint16_t>(code), 1, {}}});
  EXPECT_EQ(outcome.emergencies.size(), programs::SlaveOutcome::kMostEmergencies);
  EXPECT_EQ(outcome.records_lost, 1000 - programs::SlaveOutcome::kMostEmergencies);
}

TEST(ProgramThreads, EmergenciesAreToldInWordsAndAFloodOfThemOnce) {
  Site site({"emcy_storm:arm_encoder@usr1+0.2"});
  Hand hand(site.address());
  ASSERT_TRUE(engage(hand)) << site.slave_said.text();
  ASSERT_TRUE(eventually([&] {
    ++site.signals;  // again, wherever it is over
    return frames_with(site, canopen::emcy_id(0x31)) > 60;
  }));
  ASSERT_TRUE(eventually([&] { return site.slave_said.says("emergency: arm_encoder (node 0x31): 0xFF00"); }))
      << site.slave_said.text();
  ASSERT_TRUE(eventually([&] { return site.slave_said.says("emergency: arm_encoder (node 0x31): 0x0000"); }))
      << "taken back";
  site.end_slave();
  ASSERT_EQ(site.slave.emergencies.size(), 2U);
  EXPECT_EQ(site.slave.emergencies[0].first.node, 0x31);
  EXPECT_EQ(site.slave.emergencies[0].first.emergency.code, 0xFF00);
  EXPECT_GT(site.slave.emergencies[0].times, 20U);
  EXPECT_EQ(site.slave.emergencies[1].first.emergency.code, 0);
  EXPECT_TRUE(site.slave.setup_failures.empty());
}

/// Nodes that answer nothing; one of them sends as many emergencies before each step as are kept of one.
class FloodedBus final : public CanBus {
 public:
  bool send(const CanFrame& /*frame*/) noexcept override { return true; }
  bool receive(CanFrame& frame) noexcept override {
    frame = canopen::emergency_frame(0x31, {0xFF00, 1, {}});
    if (++given_ <= slave::EmergencyLog::kKept) return true;
    given_ = 0;
    ++steps;
    return false;
  }
  [[nodiscard]] CanState state() const noexcept override { return CanState::kActive; }
  std::atomic<int> steps{0};

 private:
  std::size_t given_ = 0;
};

TEST(ProgramThreads, AFloodOfEmergenciesKeepsNoOtherNewsOut) {
  constexpr int kUnseenSteps = 400;  // 2 s: a set-up that nobody answers fails within one
  MachineDescription impatient = machine();
  impatient.bus.boot_timeout_s = 0.5;
  impatient.bus.sdo_timeout_s = 0.1;
  FloodedBus bus;
  UdpLink link = UdpLink::listen("127.0.0.1:0");
  const auto flooded = [&bus] { return bus.steps >= kUnseenSteps; };
  programs::SlaveRecords records;
  records.on_mode = [&](const ModeEvent&) { (void)eventually(flooded); };  // from the first mode on nobody looks
  Heard said;
  programs::SlaveOutcome outcome;
  {
    programs::ProgramConsole console("slave", said.stream, false);  // says the last at its end
    outcome = programs::run_slave(impatient, bus, link, random_start(), {[&] { return !flooded(); }, console}, records);
  }
  EXPECT_GT(outcome.records_lost, 0U) << "more than there is room for";
  EXPECT_EQ(outcome.emergencies.size(), 1U);
  EXPECT_FALSE(outcome.setup_failures.empty()) << said.text();
}

TEST(ProgramThreads, PressuresThatComeWithoutStatusAreToldAtTheStart) {
  MachineDescription lacking = machine();
  node_in(lacking.bus, NodeRole::kPressure, 2).tpdo_maps = {{0x91300120}};
  Site site({}, lacking);
  EXPECT_TRUE(eventually([&] {
    return site.slave_said.says("sensors: arm_head_pressure sends arm_head_pressure without status (0x6150): ");
  })) << site.slave_said.text();
  EXPECT_FALSE(site.slave_said.says("sensors: boom_head_pressure"));
}

TEST(ProgramThreads, WhyANodeCouldNotBeSetUpIsToldInWords) {
  Site site({"wrong_identity:boom_valve@0"});
  ASSERT_TRUE(eventually([&] {
    return site.slave_said.says("set-up: boom_valve (node 0x10): reading 0x1018:02 gave 0x409");
  })) << site.slave_said.text();
  site.end_slave();
  ASSERT_FALSE(site.slave.setup_failures.empty());
  EXPECT_EQ(site.slave.setup_failures[0].failure.node, 0x10);
}

/// A controller that is off the bus, or was and has been restarted; what it is given to send is counted.
class RestartedBus final : public CanBus {
 public:
  bool send(const CanFrame& /*frame*/) noexcept override {
    if (was_off_) return false;
    ++sent_;
    return true;
  }
  bool receive(CanFrame& /*frame*/) noexcept override { return false; }
  [[nodiscard]] CanState state() const noexcept override { return was_off_ ? CanState::kBusOff : CanState::kActive; }
  void acknowledge() noexcept override { was_off_ = off_.load(); }

  void restart() { off_ = false; }
  [[nodiscard]] int sent() const { return sent_; }

 private:
  std::atomic<bool> off_{true}, was_off_{true};
  std::atomic<int> sent_{0};
};

TEST(ProgramThreads, NodesWhoseControllerWasRestartedAfterABusOffAreThereAgain) {
  programs::NodeSetup setup;
  setup.truth = sim::nominal_truth(machine());
  setup.start_rad = kStart;
  setup.faults = {bringup::parse_fault("node_emergency:tilt@0+0.1", machine().bus),
                  bringup::parse_fault("emcy_storm:tilt@0.2", machine().bus)};
  RestartedBus bus;
  Heard said;
  std::atomic<bool> end{false};
  const std::atomic<std::uint32_t> signals{0};
  std::thread nodes([&] {
    programs::ProgramConsole console("node", said.stream, false);
    (void)programs::run_node(setup, bus, {[&] { return !end; }, console}, signals);
  });
  EXPECT_TRUE(eventually([&] { return said.says("fault ended: node_emergency"); }));
  EXPECT_EQ(bus.sent(), 0) << "off the bus";
  bus.restart();
  EXPECT_TRUE(eventually([&] { return bus.sent() > 0; }));
  end = true;
  nodes.join();
}

}  // namespace
}  // namespace knuckle::test
