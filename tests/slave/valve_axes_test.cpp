// A valve node with several axes: each is set up, started, told and heard by itself, and a fault of one is the node's.
// Frames are read byte by byte here.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "slave/node_setup.h"
#include "tests/slave/jog_bench.h"
#include "tests/slave/leading.h"
#include "tests/slave/supervised_bus.h"

namespace knuckle::slave {
namespace {

using Axes = std::array<std::uint8_t, 3>;  // of boom, arm and bucket
constexpr Axes kInOrder{1, 2, 3}, kMixed{4, 1, 2};

MachineDescription joined(MachineDescription machine, const Axes& axes) {
  test::join_valves(machine.bus, axes);
  return machine;
}

std::uint32_t told_id(std::uint8_t axis) {
  return 0x110U + 0x100U * axis;  // 0x210, 0x310, ...
}
std::uint32_t heard_id(std::uint8_t axis) {
  return 0x90U + 0x100U * axis;  // 0x190, 0x290, ...
}

unsigned word_in(const CanFrame& frame) {
  return frame.data[0] | static_cast<unsigned>(frame.data[1]) << 8U;
}
int set_point_in(const CanFrame& frame) {
  return static_cast<std::int16_t>(frame.data[2] | frame.data[3] << 8U);
}

CanFrame status_of(std::uint8_t axis, unsigned word, int spool = 0) {
  const auto steps = static_cast<std::uint16_t>(spool);
  return {.id = heard_id(axis),
          .size = 4,
          .data = {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U),
                   static_cast<std::uint8_t>(steps), static_cast<std::uint8_t>(steps >> 8U)}};
}

class ValveAxes : public ::testing::TestWithParam<Axes> {};
INSTANTIATE_TEST_SUITE_P(Axes, ValveAxes, ::testing::Values(kInOrder, kMixed));

TEST_P(ValveAxes, AreSetUpEachInItsObjectsAndItsPdosAndWhatIsNotOursIsOff) {
  test::BenchMachine m(joined(test::test_machine(), GetParam()));
  sim::NodeProtocol& node = *m.nodes.node(0x10);
  node.replace({0x1402, 1}, 0x410);  // on as delivered
  ASSERT_TRUE(m.engage()) << m.setup_failure();
  for (std::uint8_t axis = 1; axis <= 4; ++axis) {
    const auto index = [axis](unsigned first) { return static_cast<std::uint16_t>(first + axis - 1U); };
    const bool ours = std::count(GetParam().begin(), GetParam().end(), axis) > 0;
    const std::uint32_t off = ours ? 0 : 0x80000000;
    EXPECT_EQ(node.value({index(0x1400), 1}) & 0x80000000U, off) << int{axis};
    EXPECT_EQ(node.value({index(0x1800), 1}) & 0x80000000U, off) << int{axis};
    if (!ours) continue;
    const std::uint32_t shift = 0x08000000U * (axis - 1U);
    EXPECT_EQ(node.value({index(0x1400), 1}), told_id(axis));
    EXPECT_EQ(node.value({index(0x1400), 5}), 50U) << "its own watchdog";
    EXPECT_EQ(node.value({index(0x1600), 0}), 2U);
    EXPECT_EQ(node.value({index(0x1600), 1}), 0x60400010U + shift);
    EXPECT_EQ(node.value({index(0x1600), 2}), 0x63000110U + shift);
    EXPECT_EQ(node.value({index(0x1800), 1}), heard_id(axis));
    EXPECT_EQ(node.value({index(0x1800), 2}), 4U);
    EXPECT_EQ(node.value({index(0x1A00), 1}), 0x60410010U + shift);
    EXPECT_EQ(node.value({index(0x1A00), 2}), 0x63010110U + shift);
  }
}

/// The client alone, with the simulated nodes.
class AxesOnBus : public SupervisedBus, public ::testing::WithParamInterface<Axes> {
 protected:
  AxesOnBus() : SupervisedBus(joined(machine_with_exact_limits(), GetParam())) {}
  void statuses_of_all_but(std::uint8_t silent) {
    for (const std::uint8_t axis : GetParam())
      if (axis != silent) client.receive(status_of(axis, 0xF), now);
    inputs();
  }
  void axes_up() {
    ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
    for (const NodeDescription& node : machine.bus.nodes) heartbeat(node.id);
    statuses_of_all_but(0);
    step();
    ASSERT_TRUE(client.operational()) << text(client.fault());
    port.sent.clear();
  }
  void expect_all_neutral(std::size_t least) {
    for (const std::uint8_t axis : GetParam()) {
      EXPECT_GE(sent(told_id(axis)).size(), least) << int{axis};
      for (const CanFrame& frame : sent(told_id(axis))) EXPECT_EQ(set_point_in(frame), 0) << int{axis};
    }
    for (const CanFrame& frame : sent(0x240)) EXPECT_EQ(frame.data[0], 0) << "enable output";
  }
};
INSTANTIATE_TEST_SUITE_P(Axes, AxesOnBus, ::testing::Values(kMixed));

TEST_P(AxesOnBus, AllAreToldNeutralFromTheFirstFrameOnUntilTheirNodeIsOperational) {
  step(passed(kArm, 0.3), true);
  expect_all_neutral(1);
  for (const std::uint8_t axis : GetParam()) EXPECT_EQ(word_in(sent(told_id(axis)).front()), 0U);
  for (int ms = 0; ms < 4000 && !client.operational(); ++ms) {
    tick();
    if (to_ms(now) % 5 != 0) continue;
    for (CanFrame frame; port.receive(frame);) client.receive(frame, now);
    client.begin_step(now);
    if (!client.operational()) client.end_step(passed(kArm, 0.3), true, now);
  }
  ASSERT_TRUE(client.operational()) << text(client.fault());
  expect_all_neutral(10);
  for (const std::uint8_t axis : GetParam()) {
    std::vector<unsigned> words;
    for (const CanFrame& frame : sent(told_id(axis)))
      if (words.empty() || words.back() != word_in(frame)) words.push_back(word_in(frame));
    EXPECT_EQ(words, (std::vector<unsigned>{0x0, 0x1, 0x3, 0x7})) << "each state by its own status, axis " << int{axis};
  }
}

TEST_P(AxesOnBus, OnlyTheAxisThatIsOpenedIsToldSo) {
  axes_up();
  for (int joint = 0; joint < kJoints; ++joint) {
    port.sent.clear();
    for (int i = 0; i < 2; ++i) step(passed(joint, 0.25), true);
    for (std::size_t other = 0; other < kJoints; ++other) {
      const auto frames = sent(told_id(GetParam()[other]));
      ASSERT_FALSE(frames.empty());
      EXPECT_EQ(set_point_in(frames.back()), static_cast<int>(other) == joint ? 4096 : 0);
      EXPECT_EQ(word_in(frames.back()), 0x7U);
    }
  }
}

TEST_P(AxesOnBus, AFaultOfOneIsTheNodesAndTellsAllNeutral) {
  for (std::size_t joint = 0; joint < kJoints; ++joint) {
    SCOPED_TRACE(joint);
    client.restart();
    axes_up();
    for (int i = 0; i < 2; ++i) step(passed(kBoom, 0.25), true);
    port.sent.clear();
    client.receive(status_of(GetParam()[joint], 0x1), now);  // DISABLED, and not ready
    for (int i = 0; i < 4; ++i) step(passed(kBoom, 0.25), true);
    EXPECT_EQ(client.phase(), Phase::kFailed);
    expect_fault(ReasonCode::kNodeFault, 0x10, 0x1, 0xF);
    EXPECT_TRUE(client.says_stopped(0x10));
    expect_all_neutral(2);
    leave_nodes_alone();
  }
}

TEST_P(AxesOnBus, OneThatIsNotHeardIsMissedAlthoughTheOthersAre) {
  axes_up();
  for (int i = 0; i < 12; ++i) {  // 48 ms; allowed are 31.25 ms and a period of 7.8 ms
    now += 4ms;
    if (i % 2 == 0) statuses_of_all_but(GetParam()[kBucket]);
    step();
  }
  EXPECT_TRUE(test::is(client.fault(), ReasonCode::kSensorStale, signal_subject(kBucket))) << "that axis";
}

TEST_P(AxesOnBus, ASpoolThatCannotBeIsTheFaultOfItsAxis) {
  axes_up();
  client.receive(status_of(GetParam()[kArm], 0xF, 32767), now);
  step();
  EXPECT_TRUE(test::is(client.fault(), ReasonCode::kSensorInvalid, signal_subject(kArm))) << "that axis";
}

TEST_P(AxesOnBus, ARestartLeadsTheAxisThatWasInFaultOutOfItAndAllToActive) {
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
  const std::uint32_t lost = told_id(GetParam()[kBoom]);
  for (int ms = 0; ms < 100; ++ms) {
    tick();
    if (to_ms(now) % 5 != 0) continue;
    for (CanFrame frame; port.receive(frame);) client.receive(frame, now);
    for (const std::uint8_t axis : GetParam())
      if (told_id(axis) != lost) bus.port(0).send({.id = told_id(axis), .size = 4, .data = {0x7}});
    bus.port(0).send(canopen::heartbeat_frame(1, canopen::NmtState::kOperational));
    bus.port(0).send(canopen::sync_frame());
  }
  client.restart();
  ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault()) << text(client.setup_failure(), client.bus());
  for (const CanFrame& frame : sent(lost)) EXPECT_EQ(set_point_in(frame), 0);
}

TEST(ValveAxesGuard, TheTimerOfOneAxisAloneIsNone) {
  struct Case {
    std::vector<canopen::Object> missing;
    bool starts;
  };
  for (const Case& c : {Case{{{0x1016, 1}}, true},
                        {{{0x1400, 5}}, true},  // the heartbeat is left
                        {{{0x1016, 1}, {0x1402, 5}}, false},
                        {{{0x1016, 1}, {0x1400, 5}}, false}}) {
    test::BenchMachine m(joined(test::test_machine(), kInOrder));
    for (const canopen::Object object : c.missing) m.nodes.node(0x10)->remove(object);
    bool unguarded = false;
    for (const Time end = m.now + 3s; m.now < end; m.tick())
      unguarded = unguarded || m.loop.client().setup_failure().what == SetupFailure::What::kUnguarded;
    EXPECT_EQ(unguarded, !c.starts) << std::hex << c.missing.back().index;
    EXPECT_EQ(m.loop.client().operational(), c.starts) << text(m.loop.client().fault());
  }
}

TEST(ValveAxesGuard, IsTriedWithOneAxisAfterAnotherAndTheSetPointsOfAllWithheld) {
  for (std::size_t place = 0; place < kJoints; ++place) {
    JogBench rig(joined(test::test_machine(), kMixed));
    const test::BenchMachine& m = rig.bench;
    rig.start();
    const NodeDescription& node = m.description.bus.valve(kBoom);
    const int opened = node.channels[place].info().index;
    rig.jog.try_guard(node, opened);
    rig.finish();
    const GuardSeen& seen = rig.jog.guard_seen();
    ASSERT_TRUE(seen.tried == GuardSeen::Tried::kYes && seen.told_s && seen.stopped_s) << place;
    EXPECT_FALSE(seen.pilot_off_s);
    EXPECT_EQ(seen.emergency, 0x8250);
    for (int joint = 0; joint < kJoints; ++joint) {
      const std::uint8_t axis = kMixed[static_cast<std::size_t>(joint)];
      const auto frames = m.frames(told_id(axis));
      const bool open = std::any_of(frames.begin(), frames.end(), [](const auto& f) { return set_point_in(f) != 0; });
      EXPECT_EQ(open, joint == opened) << joint;
      Duration longest{};
      Time last = kNever;
      for (const auto& [at, frame] : m.wire) {
        if (frame.id != told_id(axis)) continue;
        if (last != kNever) longest = std::max(longest, at - last);
        last = at;
      }
      EXPECT_GT(longest, 50ms) << "withheld for longer than its watchdog waits, of joint " << joint;
    }
  }
}

TEST(ValveAxesStop, IsOrderlyForAllAndTheOneThatDidNotConfirmIsNamedAndKeepsItsNodeWatching) {
  const Axes& axes = kMixed;
  for (int lost = -1; lost < kJoints; ++lost) {
    test::BenchMachine m(joined(test::test_machine(), axes));
    ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
    m.move(JointVector(0.25, -0.25, -0.3), 400ms);
    ASSERT_GT(m.loop.commands().cwiseAbs().minCoeff(), 0.12);
    m.wire.clear();
    if (lost >= 0)
      m.can.lost = {told_id(axes[static_cast<std::size_t>(lost)]), heard_id(axes[static_cast<std::size_t>(lost)])};
    OrderlyStop stop(m.description, m.can);
    const Time since = m.now;
    test::take_out_of_service(m, stop);
    const auto open = stop.unconfirmed_valves();
    for (int joint = 0; joint < kJoints; ++joint)
      EXPECT_EQ(open[static_cast<std::size_t>(joint)], joint == lost) << joint << ' ' << lost;
    for (const auto& [at, frame] : m.wire) {
      const bool told = std::any_of(axes.begin(), axes.end(), [&](auto axis) { return frame.id == told_id(axis); });
      if (!told || at <= since + 5ms) continue;
      EXPECT_EQ(set_point_in(frame), 0);
    }
    EXPECT_EQ(m.frames(0x000).size(), lost < 0 ? 12U : 0U) << "resets: none where one did not confirm";
    m.run(300ms);
    EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector(0, 0, 0));
    EXPECT_FALSE(m.nodes.outputs().pilot);
  }
}

}  // namespace
}  // namespace knuckle::slave
