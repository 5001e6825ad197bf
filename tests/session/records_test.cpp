// Records with no room left say so, and the verdict listens; no number of a row is missing in tables and digests; what
// counts as an input when a link is lost; how long each limit held the machine back.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "app/session/fault_injection.h"
#include "app/session/frame_log.h"
#include "app/session/record_windows.h"
#include "app/session/session.h"
#include "app/session/session_logs.h"
#include "app/session/session_record.h"
#include "app/session/session_result.h"
#include "core/fields.h"
#include "machine/load.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/few_nodes.h"
#include "transport/link_messages.h"
#include "transport/virtual_can.h"

namespace knuckle::session {
namespace {

SessionSetup short_session(const MachineDescription& machine = load_machine(find_config("machine", "solar015"))) {
  SessionSetup setup;
  setup.machine = machine;
  setup.device = load_device(find_config("device", "knuckle1"));
  setup.scenario = load_scenario(find_config("scenario", "free_motion"), setup.machine);
  setup.scenario.duration_s = 1;
  setup.truth = sim::sample_truth(setup.machine, 1);
  setup.limb = sim::sample_limb(setup.scenario.limb, 1);
  return setup;
}

std::uint64_t lost_after(double seconds) {
  Session session(short_session());
  while (session.elapsed_s() < seconds) session.step();
  return session.take_outcome().record.records_lost;
}

TEST(Recorder, CountsWhatItHasNoRoomFor) {
  EXPECT_EQ(lost_after(1), 0u);
  EXPECT_GE(lost_after(2.5), 99u);  // rows: 1 s and one to spare at 200 Hz
}

TEST(Recorder, HasRoomForTheFramesOfTheFastestBus) {
  BusDescription bus;
  bus.sync_Hz = 250;
  bus.set_point_every_nth_sync = bus.valve_status_every_nth_sync = 1;
  EXPECT_GE(most_frames(bus, 10), 10 * 250 * (1 + 6 + 3 + 1 + 2 * 3));
}

/// Node by node a millisecond apart, the frames of one cycle.
Time put_frames(const std::vector<std::uint32_t>& ids, Time at, MachineLog& log) {
  for (const std::uint32_t id : ids) {
    CanFrame frame;
    frame.id = id;
    log.note(at += 1ms, frame);
  }
  return at;
}

/// Of six transmitters, and of one that sends several frames.
TEST(SessionLogs, ALatencyBeginsWithTheLastPressureOfACycleAndEndsWithItsLastSetPoint) {
  const MachineDescription few = parse_machine(test::few_nodes_text(), "few_nodes.toml");
  for (const SessionSetup& setup : {short_session(), short_session(few)}) {
    SessionLogs logs(setup);
    std::vector<std::uint32_t> ids{0x1A0, 0x2A0, 0x3A0};
    if (test::nodes_with(setup.machine.bus, NodeRole::kPressure).size() == 6)
      ids = {0x1A0, 0x1A1, 0x1A2, 0x1A3, 0x1A4, 0x1A5};
    const Time pressures = put_frames(ids, Time(100ms), logs.machine);
    logs.slave.measured.push_back({Time(150ms), Time(150ms)});
    logs.slave.acted.push_back({Time(120ms), Time(160ms)});
    const Time set_points = put_frames({0x210, 0x211, 0x212}, Time(160ms), logs.machine);
    logs.master.felt.push_back({Time(150ms), Time(190ms)});
    const SessionOutcome outcome = logs.hand_over(setup.machine, operator_of(setup), Time(1s), [](Time at) {
      return Cause{at, {}};
    });
    std::map<std::string, double> longest_ms;
    for (const HopLatency& hop : outcome.hops)
      if (hop.samples > 0) longest_ms[hop.hop] = hop.latency_us.max / 1000;
    const std::map<std::string, double> expected{{"pressure_to_slave", 1000 * to_seconds(Time(150ms) - pressures)},
                                                 {"pressure_to_hand", 1000 * to_seconds(Time(190ms) - pressures)},
                                                 {"hand_to_valve", 1000 * to_seconds(set_points - Time(120ms))}};
    ASSERT_EQ(longest_ms.size(), expected.size());
    for (const auto& [hop, ms] : expected) EXPECT_NEAR(longest_ms[hop], ms, 1e-6) << hop;
  }
}

TEST(Verdict, IsFailedByALostRecordWhateverTheScenarioAsks) {
  SessionResult result;
  EXPECT_EQ(judge(result).passed, true);
  result.record.records_lost = 1;
  const Judged judged = judge(result);
  EXPECT_EQ(judged.passed, false);
  ASSERT_EQ(judged.criteria.size(), 1u);
  EXPECT_EQ(judged.criteria[0].name, "records_lost");
}

TEST(FaultWatch, CountsFaultsBeyondItsRoom) {
  FaultWatch watch;
  for (int i = 0; i < 70; ++i) {
    watch.step(Time(2 * i * 1s), Mode::kFault, {}, false);
    watch.step(Time((2 * i + 1) * 1s), Mode::kReady, {}, false);
  }
  SessionRecord record;
  watch.judge(
      {}, load_machine(find_config("machine", "solar015")), Time(200s),
      [](Time at) {
        return Cause{at, {}};
      },
      record);
  EXPECT_EQ(record.faults.size() + record.records_lost, 70u);
  EXPECT_GT(record.records_lost, 0u);
}

TEST(FaultInjection, ACopyOfASetPointIsNoNews) {
  const SessionSetup setup = short_session();
  ImpairedLink network({}, {}, 1);
  FaultInjection faults({{sim::FaultKind::kLinkCut, 0, 0.03, 1}}, network, setup.machine.bus);
  SimulatedMachineSide far(setup.machine, setup.truth, setup.scenario, 1, faults.machine_end());
  HandSide hand(setup.device, setup.limb, 1, setup.scenario.hand_rad);
  MasterMessage message;
  for (int t = 1; t <= 30; ++t) {
    const Time now(t * 1ms);
    network.advance(now);
    faults.step(now, 0, t * 1ms, far, hand);
    message.stamp.sequence = t <= 10      ? static_cast<std::uint32_t>(t)
                             : t % 2 == 0 ? 10U
                                          : 9U;  // from 10 ms on: old ones
    if (t < 30) faults.operator_end().send(encode(message).view());
    Datagram datagram;
    while (faults.machine_end().receive(datagram)) {
    }
  }
  ASSERT_EQ(faults.injected().size(), 1u);
  EXPECT_EQ(faults.injected()[0].last_good_input, Time(10ms));
}

double time_of(const std::vector<LimitTime>& times, const std::string& limit) {
  const auto found = std::find_if(times.begin(), times.end(), [&](const auto& one) { return one.limit == limit; });
  return found != times.end() ? found->time_s : -1;
}

TEST(LimitTimes, AddUpForEachLimitAndForTheWallThatIsNear) {
  SessionRecord record;
  for (int i = 0; i <= 100; ++i) {
    Sample sample;
    sample.t_s = 0.01 * i;
    sample.tip_m = i <= 60 ? PlanarVector(3.2, 0) : PlanarVector(1, -2.5);
    if (i > 40 && i <= 90) sample.machine.limits |= kLimitVirtualWall;  // 0.2 s at the reach, 0.3 s at the floor
    if (i > 50 && i <= 60) sample.machine.limits |= kLimitPressure;
    record.samples.push_back(sample);
  }
  const auto times = limit_times(record, {.floor_m = -2.6, .ceiling_m = 3.3, .reach_m = 3.3});
  EXPECT_NEAR(time_of(times, "reach"), 0.2, 1e-9);
  EXPECT_NEAR(time_of(times, "floor"), 0.3, 1e-9);
  EXPECT_EQ(time_of(times, "ceiling"), 0);
  EXPECT_NEAR(time_of(times, "pressure"), 0.1, 1e-9);
  EXPECT_EQ(time_of(times, "force ceiling"), 0);
  EXPECT_EQ(time_of(times, "virtual wall"), -1) << "told by their own names";
}

/// What the processor wants: of a plane's vectors (Eigen::Vector2d) 16 bytes, of a reason's code that of the reason.
std::size_t alignment_of(const Field& field) {
  if (field.type == NumberType::kUint16 && field.word != nullptr) return alignof(Reason);
  if (!field.vector) return field.size;
  return field.count == 2 ? alignof(PlanarVector) : alignof(double);
}

/// A member that no list visits leaves a gap that no padding explains.
TEST(SampleFields, CoverEveryByteOfEachStructButPadding) {
  const auto expect_covered = [](std::vector<Field> fields, std::size_t size) {
    std::sort(fields.begin(), fields.end(), [](const Field& a, const Field& b) { return a.offset < b.offset; });
    std::size_t end = fields.front().offset;
    for (const Field& field : fields) {
      EXPECT_LT(field.offset - end, alignment_of(field)) << "before " << field.name;
      end = field.offset + field.size;
    }
    EXPECT_LT(size - end, alignof(PlanarVector));
  };
  expect_covered(fields_of<slave::SlaveState>(), sizeof(slave::SlaveState));
  expect_covered(fields_of<master::MasterState>(), sizeof(master::MasterState));
  expect_covered(fields_of<Truth>(), sizeof(Truth));
  expect_covered(fields_of<Hand>(), sizeof(Hand));
}

}  // namespace
}  // namespace knuckle::session
