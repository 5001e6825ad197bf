// Leading a machine along paths over whatever makes the time of its bus pass.
#include "app/motion/led_machine.h"

#include <gtest/gtest.h>

#include <vector>

#include "machine/load.h"
#include "sim/machine_on_bus.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/command_machine.h"
#include "tests/support/solar.h"
#include "transport/canopen.h"

namespace knuckle::motion {
namespace {

const JointVector kStart(0.3, -1.5, -0.9), kAway(0.45, -1.3, -1.1);

struct Bench {
  explicit Bench(const sim::MachineTruth& truth = sim::nominal_truth(test::solar()), Time first_step = {},
                 const JointVector& start_rad = kStart, const MachineDescription& machine = test::solar())
      : simulated(std::make_shared<sim::MachineOnBus>(truth, sim::WorldDescription{}, start_rad, 1)),
        access(sim::access_to(simulated)),
        led(machine, access, first_step) {
    simulated->bus().set_tap({[](void* self, Time at, const CanFrame& frame) {
                                if (frame.id == canopen::kSyncId) static_cast<Bench*>(self)->syncs.push_back(at);
                              },
                              this});
  }
  std::string refusal() {
    try {
      led.engage();
      led.go_to(kAway);
    } catch (const NotLed& ended) {
      return ended.what();
    }
    return "";
  }
  std::vector<Time> syncs;
  std::shared_ptr<sim::MachineOnBus> simulated;
  BusAccess access;
  LedMachine led;
};

TEST(LedMachine, EngagesAMachineThatIsReadyBeforeItIsHeard) {
  const MachineDescription machine = test::command_machine();
  const auto simulated =
      std::make_shared<sim::MachineOnBus>(sim::nominal_truth(machine), sim::WorldDescription{}, kStart, 1);
  BusAccess access = sim::access_to(simulated);
  LedMachine led(machine, access, {});
  EXPECT_NO_THROW(led.engage());
}

TEST(LedMachine, RecordsOneSampleAStepWithTheRawReadingsOfItsCalibratedEncoders) {
  MachineDescription machine = test::solar();
  sim::MachineTruth truth = sim::nominal_truth(machine);
  machine.sensors.encoder_offset_m = truth.encoder_offset_m = JointVector(2e-3, -1e-3, 1.5e-3);
  Bench bench(truth, {}, kStart, machine);
  bench.led.engage();
  estimation::Recording recording;
  const std::size_t before = bench.syncs.size();
  for (int ms = 0; ms < 200; ++ms) {
    const bool added = bench.led.record(recording);
    EXPECT_EQ(added, bench.access.now().time_since_epoch() % 5ms == 0ms) << ms;
    if (!added || recording.samples.size() > 1) continue;
    const JointVector shown_m = bench.simulated->plant().cylinder_m + truth.encoder_offset_m;
    EXPECT_LT((recording.samples[0].cylinder_m - shown_m).cwiseAbs().maxCoeff(), 3e-4);
  }
  EXPECT_EQ(recording.samples.size(), 40U);
  EXPECT_EQ(recording.usable.size(), 40U);
  EXPECT_EQ(recording.valve.size(), 40U);
  EXPECT_NEAR(static_cast<double>(bench.syncs.size() - before), 40, 1);
}

TEST(LedMachine, StepsItsLoopFirstWhenToldAndInItsPeriodFromThereOn) {
  Bench at_once, later(sim::nominal_truth(test::solar()), Time(5ms));
  for (Bench* bench : {&at_once, &later}) bench->led.pause(100ms);
  ASSERT_EQ(at_once.syncs.size(), later.syncs.size() + 1);
  EXPECT_LT(at_once.syncs.front(), Time(2ms));
  for (std::size_t i = 0; i < later.syncs.size(); ++i) {
    const Time sent(static_cast<int>(i + 1) * 5ms);
    EXPECT_GT(later.syncs[i], sent);
    EXPECT_LT(later.syncs[i], sent + 750us) << "behind a frame that is on its way and two commands to nodes at most";
  }
}

TEST(LedMachine, WhoeverIsAskedEachStepMayEndIt) {
  Bench bench;
  int steps = 0;
  bench.led.each_step = [&steps] {
    if (++steps == 10) throw std::runtime_error("enough");
  };
  EXPECT_THROW(bench.led.engage(), std::runtime_error);
  EXPECT_EQ(bench.access.now(), Time(45ms));
}

// A cylinder's stop lies beyond the working range: commissioning leaves machines there.
TEST(LedMachine, LeadsAMachineBackFromBeyondItsWorkingRange) {
  const double end_rad = test::solar().links[kBoom].max_rad;
  Bench bench(sim::nominal_truth(test::solar()), {}, JointVector(end_rad + 0.06, kStart[kArm], kStart[kBucket]));
  EXPECT_EQ(bench.refusal(), "");
  bench.led.rest(1500ms);
  EXPECT_LT((bench.simulated->plant().joint_rad - kAway).cwiseAbs().maxCoeff(), 0.03);
  EXPECT_LT(bench.simulated->plant().joint_radps.norm(), 0.01);
}

TEST(LedMachine, HoldOnTheWayAlongAPathIsTheEndOfItAndNamed) {
  Bench bench;
  bench.led.engage();
  bench.led.rest(1500ms);
  estimation::JointPath path;
  path.joint_rad.assign(100, bench.simulated->plant().joint_rad);
  path.joint_rad.resize(200, bench.simulated->plant().joint_rad + JointVector(0, 0.5, 0));
  bench.led.lead(path);
  try {
    (void)bench.led.run_until([&] { return bench.led.done(); }, 10s);
    FAIL() << "a path that jumps was followed";
  } catch (const NotLed& ended) {
    EXPECT_NE(std::string(ended.what()).find("arm: set-point "), std::string::npos) << ended.what();
  }
}

TEST(LedMachine, SaysWhichNodeKeepsItFromEngaging) {
  sim::MachineTruth truth = sim::nominal_truth(test::solar());
  knuckle::test::node_in(truth.machine.bus, NodeRole::kEncoder, kArm).product +=
      1;  // another device than the file says
  Bench bench(truth);
  const std::string said = bench.refusal();
  EXPECT_NE(said.find("the machine did not engage within 15 s: arm_encoder (node 0x31): reading 0x1018:02 gave 0x"),
            std::string::npos)
      << said;
}

TEST(LedMachine, SaysWhyTheMachineIsNoLongerEngaged) {
  Bench bench;
  bench.led.engage();
  bench.simulated->machine().set_estop(true);
  const std::string said = bench.refusal();
  EXPECT_NE(said.find("the machine is no longer engaged: "), std::string::npos) << said;
  EXPECT_NE(said.find("E-stop"), std::string::npos) << said;
}

}  // namespace
}  // namespace knuckle::motion
