// What the machine's side tells of itself, against the bench machine: whose hand is on the valves, what the loop's
// thread says of its time, and the oil that moving cylinders take.
#include "slave/status_reporter.h"

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "tests/slave/bench_machine.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/no_alloc.h"
#include "tests/support/two_buses.h"
#include "transport/can_buses.h"

namespace knuckle::slave {
namespace {

/// Keeps what was sent, decoded.
class Told final : public Link {
 public:
  Told() { statuses.reserve(1000); }
  bool send(std::span<const std::uint8_t> bytes) noexcept override {
    if (const auto status = decode_status(bytes)) statuses.push_back(*status);
    return true;
  }
  bool receive(Datagram& /*datagram*/) noexcept override { return false; }
  std::vector<MachineStatus> statuses;
};

struct ReportingBench {
  explicit ReportingBench(Mailbox<LoopHealth>* health = nullptr, bool simulated = false)
      : reporter(m.description, m.bus.port(0), meter, told, simulated, health) {}
  void tick() {
    m.tick();
    if (m.ticks % 5 == 0) reporter.step(m.now, m.loop);
  }
  void run(Duration time) {
    for (const Time end = m.now + time; m.now < end;) tick();
  }
  /// Engaged, with a report of the device at an hour; that report is on the valves' wire.
  void lead_with_report() {
    m.hand.device_report_at = Time(1h);
    ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
    run(100ms);
    ASSERT_EQ(reporter.sent().acted_report_at, Time(1h));
  }
  test::BenchMachine m;
  CanMeter meter;
  Told told;
  StatusReporter reporter;
};

TEST(StatusReporter, TellsTwentyTimesASecondWithRisingNumbers) {
  ReportingBench bench;
  bench.run(10s);
  const auto& told = bench.told.statuses;
  ASSERT_EQ(told.size(), 200U);
  for (std::size_t i = 1; i < told.size(); ++i) {
    EXPECT_EQ(told[i].stamp.sequence, told[i - 1].stamp.sequence + 1);
    EXPECT_EQ(told[i].stamp.sent_at - told[i - 1].stamp.sent_at, 50ms);
  }
  EXPECT_EQ(told.back().period, 5ms);
  EXPECT_EQ(told.front().machine.text(), "test");
  EXPECT_GT(told.back().steps, 1900U);
  EXPECT_EQ(told.back().fifo_priority, 0);
}

TEST(StatusReporter, TellsWhetherTheMachineIsASimulationAndWhetherItsForcesAreCalibrated) {
  for (const bool simulated : {false, true}) {
    ReportingBench bench(nullptr, simulated);
    bench.run(100ms);
    ASSERT_FALSE(bench.told.statuses.empty());
    EXPECT_EQ(bench.told.statuses.back().simulated, simulated);
    EXPECT_FALSE(bench.told.statuses.back().calibrated);
  }
  ReportingBench bench;
  MachineDescription description = bench.m.description;
  description.dynamics_calibration.emplace();
  StatusReporter reporter(description, bench.m.bus.port(0), bench.meter, bench.told, false);
  reporter.step(Time(1s), bench.m.loop);
  ASSERT_EQ(bench.told.statuses.size(), 1U);
  EXPECT_TRUE(bench.told.statuses.back().calibrated);
}

TEST(StatusReporter, TellsWhyTheForceIsKnownNoBetter) {
  ReportingBench bench;
  bench.run(10ms);
  ASSERT_FALSE(bench.m.loop.state());
  ASSERT_EQ(bench.m.loop.confidence(), 0);
  EXPECT_EQ(bench.reporter.sent().force_doubts, estimation::kBadInput) << "sensors are not usable yet";
  ASSERT_TRUE(bench.m.engage()) << text(bench.m.loop.blocking());
  bench.run(500ms);
  const std::uint16_t doubts = bench.reporter.sent().force_doubts;
  EXPECT_EQ(doubts, bench.m.loop.force().confidence_reasons);
  EXPECT_TRUE(doubts & estimation::kBiasNotLearned) << "it has never moved freely";
  EXPECT_FALSE(doubts & estimation::kBadInput);
}

/// Which set-point each of its frames on the wire was made of, against what was told afterwards.
TEST(StatusReporter, TellsWhoseReportIsOnTheValvesWireAndHowLongAgo) {
  ReportingBench bench;
  auto& m = bench.m;
  ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
  bench.told.statuses.clear();
  struct Step {
    Time report;
    bool sent = false;  // a set-point frame
  };
  std::map<Time, Step> steps;
  Time report = kNever;
  const std::uint32_t valve = canopen::rpdo1_id(m.description.bus.valve(0).id);
  for (int n = 0; n < 400; ++n) {
    m.wire.clear();
    m.link_up = n % 3 == 0;  // so that some wait for the valve frame
    m.hand.device_report_at = Time(1h + n * 1ms);
    for (int ms = 0; ms < 5; ++ms) {
      bench.tick();
      if (m.ticks % 5 != 0) continue;
      if (m.link_up) report = m.hand.device_report_at;
      steps[m.now] = {report};
    }
    // The frame of a step is on the wire before the next one.
    const Time stepped = steps.rbegin()->first;
    for (const auto& w : m.wire) {
      if (w.frame.id == valve) steps[w.at > stepped ? stepped : stepped - 5ms].sent = true;
    }
  }
  ASSERT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault());
  int told = 0;
  for (const MachineStatus& status : bench.told.statuses) {
    const Time stepped_at = status.stamp.sent_at - m.start.origin;
    const auto acted = steps.find(stepped_at - status.acted_ago);
    if (stepped_at < steps.begin()->first + 100ms || stepped_at == steps.rbegin()->first) continue;
    ASSERT_NE(acted, steps.end());
    EXPECT_TRUE(acted->second.sent);
    EXPECT_EQ(status.acted_report_at, acted->second.report);
    EXPECT_LT(status.acted_ago, 5ms) << "every step";
    ++told;
  }
  EXPECT_GT(told, 30);
}

TEST(StatusReporter, NobodysReportIsOnTheWireOnceNobodyLeadsOrNoSetPointLeavesTheController) {
  constexpr void (*kEnds[])(test::BenchMachine&) = {[](test::BenchMachine& m) { m.hand.enable = false; },
                                                    [](test::BenchMachine& m) { m.bus.bus_off(0); },
                                                    [](test::BenchMachine& m) { m.bus.take_down(0, true); }};
  for (const auto end : kEnds) {
    ReportingBench bench;
    bench.m.hand.device_report_at = Time(1h);
    bench.run(1s);
    EXPECT_EQ(bench.reporter.sent().acted_report_at, kNever) << "not led yet";
    ASSERT_NO_FATAL_FAILURE(bench.lead_with_report());
    end(bench.m);
    bench.run(100ms);
    EXPECT_EQ(bench.reporter.sent().acted_report_at, kNever);
    EXPECT_EQ(bench.reporter.sent().acted_ago, 0ns);
  }
}

TEST(StatusReporter, AReportIsNoLongerOnTheWireThanTheValvesWatchdogLetsIt) {
  ReportingBench bench;
  ASSERT_NO_FATAL_FAILURE(bench.lead_with_report());
  const Time sent_at = bench.m.loop.client().set_points_at();
  const Duration watchdog = from_seconds(bench.m.description.bus.valve_watchdog_s);
  bench.reporter.step(sent_at + watchdog, bench.m.loop);
  EXPECT_EQ(bench.reporter.sent().acted_report_at, Time(1h));
  EXPECT_EQ(bench.reporter.sent().acted_ago, watchdog);
  bench.reporter.step(sent_at + watchdog + StatusReporter::kPeriod, bench.m.loop);
  ASSERT_EQ(bench.m.loop.mode(), Mode::kEngaged);
  EXPECT_EQ(bench.reporter.sent().acted_report_at, kNever);
}

TEST(StatusReporter, ShowsTheLedMachineAndOldSensorsTakeNoOil) {
  ReportingBench bench;
  auto& m = bench.m;
  ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
  m.move(JointVector(0.25, -0.25, -0.3), 400ms);
  bench.run(5ms);
  const MachineStatus& status = bench.reporter.sent();
  EXPECT_TRUE(status.pilot_on);
  EXPECT_EQ(status.valve_command, m.loop.commands());
  EXPECT_EQ(status.spool, m.loop.client().spool());
  EXPECT_GT(status.spool.cwiseAbs().minCoeff(), 0.05);
  ASSERT_GT(status.oil_flow_m3ps, 0);
  EXPECT_GT(status.hydraulic_power_W, 0);
  for (const NodeDescription& valve : test::nodes_with(m.description.bus, NodeRole::kValve))
    m.nodes.inject(valve.id, sim::NodeFault::kFrozen);
  m.nodes.inject(m.description.bus.encoder(kArm).id, sim::NodeFault::kSilent);
  bench.run(200ms);
  ASSERT_TRUE(m.loop.state());
  EXPECT_GT(oil_demand(m.description, *m.loop.state(), status.spool).flow_m3ps, 0) << "as it was";
  EXPECT_EQ(status.oil_flow_m3ps, 0);
  EXPECT_EQ(status.hydraulic_power_W, 0);
}

TEST(StatusReporter, PassesOnWhatTheLoopsThreadSaysOfItsTime) {
  Mailbox<LoopHealth> mailbox;
  ReportingBench bench(&mailbox);
  LoopHealth health;
  health.period = 5ms;
  health.steps = 12'345;
  health.overruns = 6;
  health.fifo_priority = 80;
  for (int i = 0; i < 99; ++i) health.wake_lateness.add(20us);
  health.wake_lateness.add(1ms);
  for (int i = 0; i < 100; ++i) health.execution.add(200us);
  mailbox.put(health);
  bench.run(200ms);
  const MachineStatus& status = bench.reporter.sent();
  EXPECT_EQ(status.steps, 12'345U);
  EXPECT_EQ(status.overruns, 6U);
  EXPECT_EQ(status.fifo_priority, 80);
  EXPECT_LE(status.wake_lateness.p50, 23us);
  EXPECT_EQ(status.wake_lateness.max, 1ms);
  EXPECT_EQ(status.execution.p99, 200us);
}

TEST(StatusReporter, TellsLoadAndLossesOfTheBus) {
  ReportingBench bench;
  bench.run(55ms);  // told once, and once more
  const CanFrame frame{.id = 0x7FF, .size = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
  int sent = 0;
  for (int i = 0; i < 100; ++i) {
    if (!bench.m.bus.port(0).send(frame)) continue;
    bench.meter.add(frame);
    ++sent;
  }
  const double share = sent * static_cast<double>(frame_bits(frame)) / (0.050 * bench.m.description.bus.bit_rate);
  bench.run(50ms);
  EXPECT_DOUBLE_EQ(bench.reporter.sent().buses[0].load, share);
  EXPECT_GE(bench.reporter.sent().can_errors, static_cast<std::uint32_t>(100 - sent));
  EXPECT_LT(sent, 100);
  bench.run(50ms);
  EXPECT_EQ(bench.reporter.sent().buses[0].load, 0);
}

TEST(StatusReporter, TellsLoadAndStateOfEachOfTwoBuses) {
  test::BenchMachine m(parse_machine(test::two_buses_text(), "m.toml"));
  CanBuses buses(m.bus.port(0), &m.second.port(0));
  CanMeter meter;
  Told told;
  StatusReporter reporter(m.description, buses, meter, told, false);
  reporter.step(m.now, m.loop);
  const CanFrame frame{.id = 0x7FF, .size = 8, .data = {1, 2, 3}};
  meter.add(frame);
  CanFrame second = frame;
  second.id |= kSecondBus;
  for (int i = 0; i < 3; ++i) meter.add(second);
  m.bus.disturb(0, true);
  m.second.bus_off(0);
  (void)buses.state();  // as the loop does in each of its steps
  reporter.step(m.now + StatusReporter::kPeriod, m.loop);
  const MachineStatus& status = told.statuses.back();
  const double share = static_cast<double>(frame_bits(frame)) / 0.050;
  EXPECT_NEAR(status.buses[0].load, share / 500e3, 1e-12);
  EXPECT_NEAR(status.buses[1].load, 3 * share / 250e3, 1e-12);
  EXPECT_EQ(status.buses[0].state, CanState::kPassive);
  EXPECT_EQ(status.buses[1].state, CanState::kBusOff);
}

TEST(StatusReporter, AllocatesNothing) {
  Mailbox<LoopHealth> mailbox;
  ReportingBench bench(&mailbox);
  mailbox.put({});
  bench.run(2s);
  const test::NoAllocScope scope;
  for (int i = 0; i < 40; ++i) bench.reporter.step(bench.m.now + i * 5ms, bench.m.loop);
  const auto allocations = scope.allocations();
  EXPECT_EQ(allocations, 0U);
}

TEST(OilDemand, IsTheFilledChambersAreaTimesSpeedAndItsPressureTimesThat) {
  const MachineDescription machine = test::test_machine();  // bores 65, 60, 60 mm, rods 35 mm
  estimation::JointState state;
  state.lever_m = {0.5, -0.4, 0.3};
  state.rate_radps = {0.2, 0.5, 0};  // boom extends at 0.1 m/s, arm retracts at 0.2 m/s
  state.pressure_Pa = {100e5, 30e5, 20e5, 50e5, 40e5, 40e5};
  const OilDemand demand = oil_demand(machine, state, {0.5, -0.5, 0.5});
  EXPECT_NEAR(demand.flow_m3ps, 3.31831e-4 + 3.73064e-4, 1e-8);
  EXPECT_NEAR(demand.power_W, 3318.31 + 1865.32, 0.1);
}

TEST(OilDemand, WhatItsLoadMovesOrAClosedValveHoldsTakesNothing) {
  const MachineDescription machine = test::test_machine();
  estimation::JointState state;
  state.lever_m = {0.5, 0.4, 0.3};
  state.rate_radps = {-0.2, 0.1, 0.5};
  state.pressure_Pa = {100e5, 30e5, 20e5, 50e5, -1e5, 40e5};
  EXPECT_EQ(oil_demand(machine, state, {0.5, 0, 0}).flow_m3ps, 0);
  const OilDemand sucking = oil_demand(machine, state, {0, 0, 1});
  EXPECT_GT(sucking.flow_m3ps, 0);
  EXPECT_EQ(sucking.power_W, 0) << "a vacuum gives no power back";
}

TEST(OilDemand, ASpoolInsideItsDeadBandIsClosedWhateverItsDitherSays) {
  MachineDescription machine = test::test_machine();
  for (CylinderDescription& cylinder : machine.cylinders) {
    cylinder.valve.dead_band_extend = 0.11;
    cylinder.valve.dead_band_retract = 0.06;
  }
  estimation::JointState state;
  state.pressure_Pa.fill(50e5);
  for (const double direction : {1.0, -1.0}) {  // as its load moves it
    state.lever_m.setConstant(0.4 * direction);
    state.rate_radps.setConstant(0.2);
    for (const double spool : {-0.06, -0.0075, 0.0, 0.0075, 0.11})
      EXPECT_EQ(oil_demand(machine, state, JointVector::Constant(spool)).flow_m3ps, 0) << spool;
    const double open = direction > 0 ? 0.111 : -0.061;
    EXPECT_GT(oil_demand(machine, state, JointVector::Constant(open)).flow_m3ps, 0);
  }
}

}  // namespace
}  // namespace knuckle::slave
