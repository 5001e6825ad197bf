// The simulated CiA 401 module: what its outputs do in each state, and what its inputs say.
#include <gtest/gtest.h>

#include "machine/set_points.h"
#include "sim/can_nodes.h"
#include "tests/support/module_machine.h"

namespace knuckle::sim {
namespace {

constexpr std::uint8_t kId = 0x41;

/// A module and who tells it, without a bus.
struct Told {
  void hear(const CanFrame& frame) { module.receive(frame, now, out); }
  void nmt(canopen::NmtCommand command) { hear(canopen::nmt_frame(command, kId)); }
  void write(canopen::Object object, std::uint32_t value, std::uint8_t size) {
    hear(canopen::sdo_download(kId, object, value, size));
  }
  void run(Duration time) {
    for (const Time end = now + time; now < end;) {
      now += 1ms;
      node.step(now, out);
    }
  }
  /// Error values of 6 V, and 50 ms of patience, as start-up sets them.
  void set_up(std::uint32_t mode = 1) {
    run(2ms);
    for (std::uint8_t output = 1; output <= 4; ++output) {
      write({0x6411, output}, 6000, 2);
      write({0x6443, output}, mode, 1);
      write({0x6444, output}, 6000U << 16, 4);
    }
    write({0x1401, 5}, 50, 2);
  }
  void say(std::int16_t boom_mV) {
    const auto raw = static_cast<std::uint16_t>(boom_mV);
    hear({0x341,
          8,
          {static_cast<std::uint8_t>(raw), static_cast<std::uint8_t>(raw >> 8), 0x70, 0x17, 0x70, 0x17, 0x70, 0x17}});
    node.step(now, out);
  }
  [[nodiscard]] double boom() const { return set_point_in(node.output_frame(0), kBoom, machine.bus).value(); }

  MachineDescription machine = test::module_machine();
  ModuleNode node{*machine.bus.find(kId), machine.bus};
  NodeProtocol& module = node.protocol();
  Outbox out;
  Time now{1s};
};

TEST(ModuleNode, OutputsHaveNoSupplyUntilItIsStarted) {
  Told told;
  told.run(2ms);
  EXPECT_EQ(told.boom(), 0) << "as delivered its outputs and error values are 0 V, full retraction";
  told.nmt(canopen::NmtCommand::kStart);
  told.run(1ms);
  EXPECT_EQ(told.boom(), -2) << "0 V is twice as far as the file's 3 V";
}

TEST(ModuleNode, WithoutFramesOrOutOfOperationOutputsTakeTheirErrorValues) {
  for (const int how : {0, 1, 2}) {
    Told told;
    told.set_up();
    told.nmt(canopen::NmtCommand::kStart);
    told.say(9000);
    ASSERT_EQ(told.boom(), 1);
    if (how == 0) told.run(52ms);
    if (how == 1) told.nmt(canopen::NmtCommand::kEnterPreOperational);
    if (how == 2) told.nmt(canopen::NmtCommand::kStop);
    told.run(1ms);
    EXPECT_EQ(told.boom(), 0) << how;
    EXPECT_FALSE(told.module.operational());
  }
}

TEST(ModuleNode, WhoseErrorModeIsOffStaysWhereItIs) {
  Told told;
  told.set_up(0);
  told.nmt(canopen::NmtCommand::kStart);
  told.say(9000);
  told.run(60ms);
  EXPECT_EQ(told.boom(), 1);
}

}  // namespace
}  // namespace knuckle::sim
