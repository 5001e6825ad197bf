// A module that is left running by whoever led it before, and is started: whatever state it is in, its outputs do
// nothing that is not neutral.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "machine/reason_text.h"
#include "slave/node_setup.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/module_machine.h"

namespace knuckle::slave {
namespace {

constexpr std::uint8_t kId = 0x41;
constexpr std::uint32_t kNeutral = 6000;  // mV

/// Operational, its outputs neutral, its error values as delivered: raw 0 of a valve fed from half the supply is full
/// speed.
struct RunningModule : test::BenchMachine {
  RunningModule() : BenchMachine(calibrated(test::module_machine())) {
    signals.shaft_rad = JointVector(0.3, -1.5, -0.8);
    hung = true;
    run(20ms);
    for (std::uint8_t output = 1; output <= 4; ++output) module().replace({0x6411, output}, kNeutral);
    tell(canopen::NmtCommand::kStart);
    EXPECT_TRUE(module().operational());
    EXPECT_EQ(module().value({0x6444, 1}), 0U);
    EXPECT_EQ(nodes.outputs().spool_demand, JointVector::Zero());
    wire.clear();
    hung = false;
  }
  [[nodiscard]] sim::NodeProtocol& module() { return *nodes.node(kId); }
  void tell(canopen::NmtCommand command) {
    bus.port(2).send(canopen::nmt_frame(command, kId));
    run(5ms);
    for (CanFrame heard; controllers_end.receive(heard);) {  // long ago when the loop comes
    }
  }
  /// For so long, nobody leading. @return the furthest that any valve was told to open
  [[nodiscard]] double furthest(Duration time) {
    double most = 0;
    for (const Time end = now + time; now < end;) {
      tick();
      most = std::max(most, nodes.outputs().spool_demand.cwiseAbs().maxCoeff());
    }
    return most;
  }
  [[nodiscard]] bool told(canopen::NmtCommand command) const {
    return std::any_of(wire.begin(), wire.end(), [&](const auto& sent) {
      const auto nmt = canopen::parse_nmt(sent.frame);
      return nmt && nmt->command == command && nmt->node == kId;
    });
  }
};

TEST(ModuleStart, OneThatRunsHasItsErrorValuesBeforeItIsToldToRest) {
  RunningModule m;
  EXPECT_EQ(m.furthest(2s), 0);
  EXPECT_TRUE(m.told(canopen::NmtCommand::kEnterPreOperational));
  EXPECT_TRUE(m.module().operational());
  EXPECT_EQ(m.module().value({0x6444, 1}), kNeutral << 16);
  EXPECT_TRUE(m.engage()) << text_with_code(m.loop.fault(), m.description.bus);
}

TEST(ModuleStart, OneThatIsStoppedAnswersNothingAndIsStartedAllTheSame) {
  RunningModule m;
  for (std::uint8_t output = 1; output <= 4; ++output) m.module().replace({0x6444, output}, kNeutral << 16);
  m.hung = true;
  m.tell(canopen::NmtCommand::kStop);
  m.hung = false;
  EXPECT_EQ(m.furthest(3s), 0);
  EXPECT_TRUE(m.engage()) << text_with_code(m.loop.fault(), m.description.bus);
}

TEST(ModuleStart, OneThatRunsAndTakesNoErrorValuesIsLeftRunning) {
  RunningModule m;
  m.module().refuse({0x6444, 2}, canopen::SdoAbort::kDeviceState);
  EXPECT_EQ(m.furthest(500ms), 0);
  EXPECT_FALSE(m.told(canopen::NmtCommand::kEnterPreOperational) || m.told(canopen::NmtCommand::kResetNode));
  EXPECT_EQ(m.loop.client().fault().code, ReasonCode::kNodeSetup);
  const std::string why = text(m.loop.client().setup_failure(), m.description.bus);
  EXPECT_EQ(why.rfind("module (node 0x41): writing 0x6444:02 was refused", 0), 0U) << why;
}

TEST(ModuleStart, AnotherDeviceUnderItsIdIsWrittenNothing) {
  RunningModule m;
  m.module().replace(canopen::kProductCode, 0x0999);
  EXPECT_EQ(m.furthest(500ms), 0);
  EXPECT_EQ(m.loop.client().fault().code, ReasonCode::kNodeIdentity);
  EXPECT_FALSE(m.told(canopen::NmtCommand::kEnterPreOperational));
  EXPECT_EQ(m.module().value({0x6444, 1}), 0U);
}

}  // namespace
}  // namespace knuckle::slave
