// A rotary encoder on the simulated bus, byte for byte.
#include <gtest/gtest.h>

#include "tests/sim/can_rig.h"
#include "tests/support/bus_nodes.h"

namespace knuckle::sim {
namespace {

MachineDescription machine_with_a_rotary_encoder() {
  MachineDescription machine = rig::bus_machine();
  NodeDescription& boom = knuckle::test::node_in(machine.bus, NodeRole::kEncoder, kBoom);
  ++boom.channels[0].signal;  // its angle
  boom.rotary = {.steps_per_turn = 16384, .sign = -1, .zero_rad = 0.4};
  return machine;
}

struct RotaryRig : rig::BusRig {
  explicit RotaryRig(const SensorErrors& errors = {}) : nodes(machine_with_a_rotary_encoder(), errors, bus.port(1), 1) {
    step = [this](Time at) { nodes.step(at, signals); };
  }
  std::vector<int> shown(double joint_rad) {
    signals.shaft_rad[kBoom] = joint_rad;
    run(20ms);
    return rig::bytes(newest(0x1B0)->frame);
  }
  CanNodes nodes;
  MachineSignals signals;
};

TEST(RotaryNode, CountsTheStepsOfATurnFromItsZeroInItsDirection) {
  RotaryRig rig;
  rig.start();
  EXPECT_EQ(rig.shown(0.3), (std::vector<int>{0x05, 0x01, 0, 0}));  // 0.1 rad: 260.8 steps
  EXPECT_EQ(rig.shown(0.4), (std::vector<int>{0, 0, 0, 0}));
  EXPECT_EQ(rig.shown(0.5), (std::vector<int>{0xFB, 0x3E, 0, 0})) << "261 before the turn's end";
}

TEST(RotaryNode, HasTheErrorsOfALengthAtItsLever) {
  SensorErrors errors;
  errors.encoder_offset_m[kBoom] = 0.01;
  errors.rotary_lever_m = 0.5;
  RotaryRig rig(errors);
  rig.start();
  EXPECT_EQ(rig.shown(0.3), (std::vector<int>{0xD1, 0, 0, 0}));  // 0.08 rad: 208.6 steps
}

TEST(RotaryNode, ShowsWhatItIsPresetToAndKeepsItOverAReset) {
  RotaryRig rig;
  rig.start();
  rig.shown(0.3);
  ASSERT_TRUE(rig.ask(canopen::sdo_download(0x30, canopen::kEncoderPreset, 16380, 4)));
  EXPECT_EQ(rig.shown(0.3), (std::vector<int>{0xFC, 0x3F, 0, 0}));
  EXPECT_EQ(rig.shown(0.2), (std::vector<int>{0x01, 0x01, 0, 0})) << "261 steps on, over the turn's end";
  rig.ask(canopen::sdo_download(0x30, canopen::kStoreParameters, canopen::kSaveSignature, 4));
  rig.send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, 0x30));
  rig.run(20ms);
  rig.send(canopen::nmt_frame(canopen::NmtCommand::kStart, 0x30));
  EXPECT_EQ(rig.shown(0.3), (std::vector<int>{0xFC, 0x3F, 0, 0}));
}

TEST(RotaryNode, BreaksAsItsKindDoes) {
  RotaryRig rig;
  rig.start();
  ASSERT_TRUE(rig.nodes.inject(0x30, NodeFault::kInvalid));
  EXPECT_EQ(rig.shown(0.3), (std::vector<int>{0xFF, 0xFF, 0xFF, 0x7F}));
  ASSERT_TRUE(rig.nodes.inject(0x30, NodeFault::kBrokenWire));
  const std::vector<int> before = rig.shown(0.3), after = rig.shown(0.3);  // 20 ms at 5 rad/s
  EXPECT_NEAR((after[0] | after[1] << 8) - (before[0] | before[1] << 8), 261, 14);
  ASSERT_TRUE(rig.nodes.inject(0x30, NodeFault::kNone));
  EXPECT_EQ(rig.shown(0.3), (std::vector<int>{0x05, 0x01, 0, 0}));
}

}  // namespace
}  // namespace knuckle::sim
