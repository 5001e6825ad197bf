// Faults happen when the plan says, last as long as it says, and are judged from the input they take away.
#include "app/session/fault_injection.h"

#include <gtest/gtest.h>

#include "machine/load.h"
#include "tests/support/bus_nodes.h"
#include "transport/canopen.h"
#include "transport/link_messages.h"
#include "transport/virtual_can.h"

namespace knuckle::session {
namespace {

using namespace std::chrono_literals;
using sim::FaultKind;

const JointVector kPose(0.7, -1.3, -0.7);

Scenario standing_at(const JointVector& joints_rad) {
  Scenario scenario;
  scenario.start_rad = joints_rad;
  return scenario;
}

/// All that faults are put into, idle.
struct Bench {
  explicit Bench(std::vector<ScheduledFault> schedule) : faults(std::move(schedule), network, description.bus) {}

  void step(int phase, Duration in_phase) {
    now += 1ms;
    hand.cable.advance();
    network.advance(now);
    MasterMessage message;
    message.stamp.sequence = ++sequence;
    message.stamp.sent_at = now;
    (void)faults.operator_end().send(encode(message).view());
    faults.step(now, phase, in_phase, far, hand);
    Datagram datagram;
    while (faults.machine_end().receive(datagram))
      got_good = decode_master(datagram.view()).has_value() ? now : got_good;
  }
  void run(int phase, double seconds) {
    for (int i = 0; i < static_cast<int>(1000 * seconds); ++i) step(phase, i * 1ms);
  }

  MachineDescription description = load_machine(find_config("machine", "solar015"));
  DeviceDescription device = load_device(find_config("device", "knuckle1"));
  ImpairedLink network{{}, {}, 1};
  Scenario scenario = standing_at(kPose);
  FaultInjection faults;
  SimulatedMachineSide far{description, sim::nominal_truth(description), scenario, 1, faults.machine_end()};
  HandSide hand{device, sim::sample_limb(sim::LimbClass::kNormal, 1), 1, kPose};
  Time now{}, got_good = kNever;
  std::uint32_t sequence = 0;
};

ScheduledFault fault_of(FaultKind kind, int phase = 1, double after_s = 0.2, double duration_s = 0.3) {
  return {kind, phase, after_s, duration_s, 0};
}

TEST(FaultInjection, BreaksInItsPhaseAtItsTimeAndMendsAfterwards) {
  Bench bench({fault_of(FaultKind::kLoopHung)});
  bench.run(0, 1);
  EXPECT_TRUE(bench.faults.injected().empty()) << "another phase, however long it lasts";
  for (int ms = 0; ms < 1000; ++ms) {
    bench.step(1, ms * 1ms);
    EXPECT_EQ(bench.faults.slave_runs(), ms < 200 || ms >= 500) << ms;
  }
  ASSERT_EQ(bench.faults.injected().size(), 1U);
  const Injected& injected = bench.faults.injected().front();
  EXPECT_EQ(injected.mended_at - injected.at, 300ms);
  bench.run(1, 1);
  EXPECT_EQ(bench.faults.injected().size(), 1U) << "once only";
}

TEST(FaultInjection, ASlowLinkGetsSlowerBitByBit) {
  Bench slow({fault_of(FaultKind::kLinkSlow, 1, 0.2, 2)});
  slow.run(1, 0.2);
  Duration longest{};
  int arrived = 0;
  for (int i = 0; i < 1500; ++i) {
    const Time before = slow.got_good;
    slow.step(1, 200ms + i * 1ms);
    if (slow.got_good == before) continue;
    ++arrived;
    longest = std::max(longest, slow.got_good - before);
  }
  EXPECT_GT(arrived, 1000) << "all of them, some late";
  EXPECT_LE(longest, 3ms) << "no outage";
  EXPECT_NEAR(to_seconds(slow.now) * 1e3 - double(slow.sequence), 0, 1e-9);
}

/// Of what came of the machine's messages, one per millisecond, in that part of the phase.
struct Reports {
  double share = 0;
  Duration delay{};  ///< Of the newest.
};
Reports reports(Bench& bench, int from_ms, int to_ms) {
  Reports seen;
  for (int ms = from_ms; ms < to_ms; ++ms) {
    bench.step(1, ms * 1ms);
    SlaveMessage message;
    message.stamp.sent_at = bench.now;
    (void)bench.faults.machine_end().send(encode(message).view());
    Datagram datagram;
    while (bench.faults.operator_end().receive(datagram)) {
      seen.share += 1.0 / (to_ms - from_ms);
      seen.delay = bench.now - decode_slave(datagram.view())->stamp.sent_at;
    }
  }
  return seen;
}

TEST(FaultInjection, ALinkThatIsSlowAndLossyAtOnceIsBothAndStaysWhatIsNotMendedYet) {
  for (const bool slow_first : {true, false}) {
    Bench bench({fault_of(FaultKind::kLinkSlow, 1, 0, slow_first ? 2 : 4),
                 fault_of(FaultKind::kLinkLossy, 1, 0, slow_first ? 4 : 2)});
    (void)reports(bench, 0, 1200);
    const Reports both = reports(bench, 1200, 1900);
    EXPECT_NEAR(both.share, 1 - sim::kLinkLossyShare, 0.06);
    EXPECT_EQ(both.delay, sim::kLinkSlowBy);
    (void)reports(bench, 1900, 2400);
    const Reports one = reports(bench, 2400, 3900);
    EXPECT_NEAR(one.share, slow_first ? 1 - sim::kLinkLossyShare : 1, 0.06);
    EXPECT_EQ(one.delay, slow_first ? 0ms : sim::kLinkSlowBy);
    (void)reports(bench, 3900, 4400);
    const Reports none = reports(bench, 4400, 4900);
    EXPECT_NEAR(none.share, 1, 1e-9);
    EXPECT_EQ(none.delay, 0ms);
  }
}

TEST(FaultInjection, ACutLinkLosesWhatIsSentAndCountsFromTheLastSetPointThatCame) {
  Bench bench({fault_of(FaultKind::kLinkCut)});
  bench.run(1, 0.4);
  ASSERT_EQ(bench.faults.injected().size(), 1U);
  const Injected& cut = bench.faults.injected().front();
  EXPECT_LE(bench.got_good, cut.at);
  EXPECT_EQ(cut.last_good_input, bench.got_good);
  bench.run(2, 0.4);
  EXPECT_GT(bench.got_good, cut.mended_at);
  EXPECT_LE(cut.last_good_input, cut.at) << "what comes after it was mended does not count";
}

TEST(FaultInjection, SetPointsThatAreNotNumbersAreNoGoodInput) {
  Bench bench({fault_of(FaultKind::kLinkNaN)});
  bench.run(1, 0.45);
  const Injected& spoiled = bench.faults.injected().front();
  EXPECT_LE(bench.got_good, spoiled.at);
  EXPECT_EQ(spoiled.last_good_input, bench.got_good);
  bench.run(2, 0.2);
  EXPECT_EQ(bench.got_good, bench.now);
}

TEST(FaultInjection, OtherFaultsCountFromWhenTheyHappen) {
  for (const FaultKind kind : {FaultKind::kDeviceUnplugged, FaultKind::kDeviceSilent, FaultKind::kEncoderBroken,
                               FaultKind::kValveStuck, FaultKind::kEStop, FaultKind::kLoopHung}) {
    Bench bench({fault_of(kind)});
    bench.run(1, 0.3);
    ASSERT_EQ(bench.faults.injected().size(), 1U);
    EXPECT_EQ(bench.faults.injected().front().last_good_input, bench.faults.injected().front().at);
  }
}

TEST(FaultInjection, WhatTheControllerSuffersShowsInItsStateUntilItIsMended) {
  const std::vector<std::pair<FaultKind, CanState>> states{{FaultKind::kBusOff, CanState::kBusOff},
                                                           {FaultKind::kCanDown, CanState::kDown},
                                                           {FaultKind::kNoAcknowledge, CanState::kPassive},
                                                           {FaultKind::kBusCut, CanState::kPassive}};
  for (const auto& [kind, state] : states) {
    Bench bench({fault_of(kind)});
    CanBus& controller = bench.far.simulated.controllers_end();
    bench.run(1, 0.15);
    EXPECT_EQ(controller.state(), CanState::kActive) << name(kind);
    bench.run(1, 0.25);
    EXPECT_EQ(controller.state(), state) << name(kind);
    bench.run(2, 0.3);
    controller.acknowledge();
    EXPECT_EQ(controller.state(), CanState::kActive) << name(kind);
  }
}

/// A fault that latches at 100 ms while valves are driven; told to be neutral at once.
struct Watched {
  explicit Watched(int enable_until_ms, int enable_again_ms) {
    for (int ms = 0; ms < 1000; ms += 5) {
      const bool enable = ms < enable_until_ms || ms >= enable_again_ms;
      watch.step(Time(ms * 1ms), ms < 100 || ms >= 600 ? Mode::kEngaged : Mode::kFault,
                 {ReasonCode::kLinkLost, 0, 200, 200}, enable);
    }
  }
  void command(int ms, double set_point) {
    for (const NodeDescription& valve : test::nodes_with(machine.bus, NodeRole::kValve)) {
      frames.push_back({Time(ms * 1ms), canopen::valve_command_frame(canopen::rpdo1_id(valve.id),
                                                                     {canopen::kControlActive, set_point})});
    }
  }
  SessionRecord judge(Time wire_ran_at = Time::min()) {
    SessionRecord record;
    watch.judge(
        frames, machine, Time(1s),
        [&](Time latched_at) {
          return Cause{latched_at - 50ms, latched_at - 60ms, wire_ran_at};
        },
        record);
    return record;
  }
  MachineDescription machine = load_machine(find_config("machine", "solar015"));
  FaultWatch watch;
  FrameLog frames;
};

TEST(FaultWatch, CountsToNeutralFromTheLastGoodInput) {
  Watched w(300, 500);
  w.command(90, 0.4);
  w.command(101, 0);
  w.command(700, 0.4);  // after enable was let go and pressed again: as it should be
  const SessionRecord record = w.judge();
  ASSERT_EQ(record.faults.size(), 1U);
  EXPECT_NEAR(record.faults[0].at_s, 0.1, 1e-9);
  EXPECT_NEAR(record.faults[0].last_good_input_s, 0.05, 1e-9);
  EXPECT_NEAR(record.faults[0].injected_s.value_or(0), 0.04, 1e-9);
  EXPECT_NEAR(record.faults[0].command_neutral_s, 0.101, 1e-9);
  EXPECT_EQ(record.resumed_by_itself, 0);
}

TEST(FaultWatch, AMachineThatMovesBeforeEnableIsPressedAnewResumedByItself) {
  for (const int resumed_ms : {200, 400}) {  // with enable still held; let go but not pressed again
    Watched w(300, 500);
    w.command(90, 0.4);
    w.command(101, 0);
    w.command(resumed_ms, 0.4);
    w.command(resumed_ms + 20, 0);
    EXPECT_EQ(w.judge().resumed_by_itself, 1) << resumed_ms;
  }
}

TEST(FaultWatch, WhatAWireOfAnotherThreadHeldUpWasSentBefore) {
  Watched w(300, 500);
  w.command(90, 0.4);
  w.command(140, 0.4);  // sent at 95 ms; the wire's thread stood until 140 ms
  w.command(141, 0);
  EXPECT_EQ(w.judge(Time(140ms)).resumed_by_itself, 0);
  EXPECT_EQ(w.judge().resumed_by_itself, 1);
  w.command(200, 0.4);
  EXPECT_EQ(w.judge(Time(140ms)).resumed_by_itself, 1);
}

TEST(FaultWatch, AMachineThatIsNeverToldToStopHasNoTime) {
  Watched w(300, 500);
  w.command(90, 0.4);
  w.command(450, 0.4);
  const SessionRecord record = w.judge();
  EXPECT_EQ(record.faults[0].command_neutral_s, 0);
  EXPECT_EQ(record.resumed_by_itself, 1);
}

}  // namespace
}  // namespace knuckle::session
