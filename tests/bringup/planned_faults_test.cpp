// Faults of simulated nodes as they are asked for, and when they are planned for the same moment.
#include "app/bringup/planned_faults.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "machine/kinematics.h"
#include "tests/bringup/hardware_bench.h"
#include "tests/support/broadcast_machine.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "transport/canopen.h"
#include "transport/virtual_can.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using test::solar;

TEST(NodeFaults, AreReadWithTheirNodeTimeAndLength) {
  const BusDescription& bus = solar().bus;
  const PlannedFault timed = parse_fault("node_silent:boom_valve@10+2.5", bus);
  EXPECT_EQ(timed.kind, sim::FaultKind::kNodeSilent);
  EXPECT_EQ(timed.node, bus.valve(0).id);
  EXPECT_EQ(timed.at_s, 10);
  EXPECT_EQ(timed.duration_s, 2.5);
  const PlannedFault signalled = parse_fault("wrong_identity:0x25@usr1", bus);
  EXPECT_EQ(signalled.node, 0x25);
  EXPECT_FALSE(signalled.at_s);
  EXPECT_EQ(parse_fault("babble@0", bus).kind, sim::FaultKind::kBabble);
}

TEST(NodeFaults, OfFramesAreByTheFramesOrTheSignalsName) {
  const BusDescription bus = knuckle::test::broadcast_machine().bus;
  const PlannedFault fault = parse_fault("values_frozen:arm_angle@10+2", bus);
  EXPECT_EQ(fault.kind, sim::FaultKind::kValuesFrozen);
  EXPECT_EQ(sim::subject_at(fault.node, bus).value().frame, 0U);
  EXPECT_EQ(sim::subject_at(parse_fault("frame_silent:body@1", bus).node, bus).value().frame, 2U);
  for (const auto& [bad, said] :
       {std::pair{"frame_silent@1", "needs a frame or a signal: frame_silent:FRAME@S"},
        {"frame_silent:head@1", "no frame or signal \"head\"; there are boom_head_pressure, "},
        {"frame_checksum:front_angle@1", "the frame has no checksum"}}) {
    const std::string line = knuckle::test::refusal([&] { return parse_fault(bad, bus); });
    EXPECT_TRUE(says(line, said));
  }
}

TEST(NodeFaults, RefuseWhatCannotBe) {
  const BusDescription& bus = solar().bus;
  for (const char* bad :
       {"node_silent", "node_silent@1", "node_silent:nobody@1", "node_silent:0x7F@1", "gremlin@1", "babble:tilt@1",
        "valve_stuck:tilt@1", "encoder_broken:tilt@1", "sensor_frozen:enable@1", "bus_off@1", "link_cut@1", "e_stop@",
        "e_stop@-1", "e_stop@nan", "e_stop@1+x", "e_stop@1e9"}) {
    const std::string said = knuckle::test::refusal([&] { return parse_fault(bad, bus); });
    EXPECT_TRUE(said.starts_with(std::string("--fault ") + bad + ": ")) << said;
  }
}

/// What was on the bus from 0.1 s on, when the faults begin, to 1.1 s.
std::vector<CanFrame> frames_with(const std::vector<std::string>& asked) {
  sim::MachineOnBus machine(sim::nominal_truth(solar()), {}, middle_of_range(solar()), 1);
  std::vector<PlannedFault> plan;
  for (const std::string& fault : asked) plan.push_back(parse_fault(fault, solar().bus));
  NodeFaults faults(std::move(plan), solar().bus);
  std::vector<CanFrame> frames;
  for (Time now{}; now < Time(1100ms); now += 1ms) {
    if (now == Time(100ms)) {
      machine.bus().set_tap(
          {[](void* kept, Time, const CanFrame& frame) { static_cast<std::vector<CanFrame>*>(kept)->push_back(frame); },
           &frames});
    }
    faults.step(now, 0, machine, [](const FaultEvent&) {});
    machine.step(now);
  }
  return frames;
}

auto count(const std::vector<CanFrame>& frames, std::uint32_t id) {
  return std::count_if(frames.begin(), frames.end(), [id](const CanFrame& frame) { return frame.id == id; });
}

TEST(NodeFaults, EveryNodeThatReceivesItsResetInTheSameMillisecondReboots) {
  const auto frames = frames_with({"node_reset:boom_valve@0.1", "node_reset:tilt@0.1", "node_reset:enable@0.1"});
  for (const std::uint8_t id : {solar().bus.valve(kBoom).id, solar().bus.tilt().id, solar().bus.enable().id})
    EXPECT_EQ(count(frames, canopen::heartbeat_id(id)), 1) << "boot-up of " << int{id};
  EXPECT_EQ(frames.size(), 3U);
}

TEST(NodeFaults, WhoeverBabblesTogetherFillsTheBusNoFullerThanOne) {
  constexpr std::uint32_t kBabbled = 0x001;
  const auto one = count(frames_with({"babble@0.1"}), kBabbled);
  const auto two = count(frames_with({"babble@0.1", "babble@0.1"}), kBabbled);
  EXPECT_GT(one, 1000);
  EXPECT_NEAR(static_cast<double>(two), static_cast<double>(one), 1);
  const auto in_turn = count(frames_with({"babble@0.1+0.5", "babble@0.6"}), kBabbled);
  EXPECT_NEAR(static_cast<double>(in_turn), static_cast<double>(one), 2);
}

TEST(NodeFaults, EveryForeignSenderSendsAsIfItWereAlone) {
  const BusDescription& bus = solar().bus;
  const std::uint32_t boom = bus.valve(kBoom).rpdo_id(), arm = bus.valve(kArm).rpdo_id();
  const auto valves = frames_with({"foreign_sender:boom_valve@0.1", "foreign_sender:arm_valve@0.1"});
  EXPECT_EQ(count(valves, boom), 20);
  EXPECT_EQ(count(valves, arm), 20);
  const auto controller_too = frames_with({"foreign_sender:boom_valve@0.1", "other_controller@0.1"});
  EXPECT_EQ(count(controller_too, boom), 20);
  EXPECT_EQ(count(controller_too, canopen::kSyncId), 20);
}

TEST(NodeFaults, EveryNodeIdThatIsTwiceStaysSoWhileAnotherComesAndGoes) {
  const BusDescription& bus = solar().bus;
  const std::uint32_t boom = canopen::heartbeat_id(bus.valve(kBoom).id), tilt = canopen::heartbeat_id(bus.tilt().id);
  const std::vector<std::string> reboots{"node_reset:boom_valve@0.2", "node_reset:tilt@0.2"};
  const auto boot_ups = [&](std::vector<std::string> faults) {
    faults.insert(faults.end(), reboots.begin(), reboots.end());
    const auto frames = frames_with(faults);
    return std::pair(count(frames, boom), count(frames, tilt));
  };
  EXPECT_EQ(boot_ups({}), std::pair(1L, 1L));
  EXPECT_EQ(boot_ups({"node_id_twice:boom_valve@0.1", "node_id_twice:tilt@0.1"}), std::pair(2L, 2L));
  EXPECT_EQ(boot_ups({"node_id_twice:boom_valve@0.1", "node_id_twice:tilt@0.1+0.05"}), std::pair(2L, 1L));
}

}  // namespace
}  // namespace knuckle::bringup
