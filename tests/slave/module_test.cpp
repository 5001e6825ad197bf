// A machine whose pilot valves and sensors hang on a CiA 401 module: its start-up, also of one that is left running by
// whoever led it before, and what its outputs do when nobody tells them. How it is led: led_by_frames_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>

#include "slave/node_setup.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/module_machine.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

constexpr std::uint8_t kModule = 0x41;

struct OnModule : test::BenchMachine {
  explicit OnModule(const MachineDescription& machine = test::module_machine()) : BenchMachine(machine) {}
  [[nodiscard]] sim::NodeProtocol& module() { return *nodes.node(kModule); }
  /// Of 0x6411, 0x6444 or 0x6443.
  [[nodiscard]] std::int32_t object(std::uint16_t index, std::uint8_t output) {
    return static_cast<std::int32_t>(module().value({index, output}));
  }
  /// By whomever.
  [[nodiscard]] bool told(canopen::NmtCommand command) const {
    return std::any_of(wire.begin(), wire.end(), [&](const auto& sent) {
      const auto nmt = canopen::parse_nmt(sent.frame);
      return nmt && nmt->command == command && nmt->node == kModule;
    });
  }
};

TEST(Module, IsToldNeutralForItselfAndForErrorsBeforeItIsStarted) {
  OnModule m;
  ASSERT_TRUE(m.reaches(Mode::kSelfTest, 4s) || m.engage()) << m.fault();
  ASSERT_TRUE(m.engage()) << m.fault();
  const auto started = std::find_if(m.wire.begin(), m.wire.end(), [](const auto& sent) {
    const auto nmt = canopen::parse_nmt(sent.frame);
    return nmt && nmt->command == canopen::NmtCommand::kStart && nmt->node == kModule;
  });
  ASSERT_NE(started, m.wire.end());
  for (std::uint8_t output = 1; output <= 4; ++output) {
    EXPECT_EQ(m.object(0x6443, output), 1);
    EXPECT_EQ(m.object(0x6444, output), 6000 << 16) << "6 V, in the upper half";
    const auto written = std::count_if(m.wire.begin(), started, [&](const auto& sent) {
      return sent.frame.id == canopen::sdo_request_id(kModule) && sent.frame.data[0] == 0x2B &&
             sent.frame.data[1] == 0x11 && sent.frame.data[2] == 0x64 && sent.frame.data[3] == output &&
             sent.frame.data[4] == 0x70 && sent.frame.data[5] == 0x17;
    });
    EXPECT_EQ(written, 1) << "0x6411 is neutral before it is started: output " << int{output};
  }
  EXPECT_EQ(m.module().value(canopen::kAnalogInputSends), 1U);
  EXPECT_EQ(m.module().value({0x1600 + 1, 0}), 4U);
  EXPECT_EQ(m.module().value({0x1600 + 1, 4}), 0x64110410U);
  EXPECT_EQ(m.module().value({0x1A00 + 2, 3}), 0x64010710U) << "the seventh input is mapped as by default";
  EXPECT_EQ(m.module().value({0x1800 + 2, 2}), 1U);
  EXPECT_EQ(m.module().value({0x1400 + 1, 5}), 50U);
  EXPECT_EQ(m.module().value(canopen::kConsumerHeartbeat), 1U << 16 | 150U);
  EXPECT_NE(m.module().value({0x1400, 1}) & canopen::kPdoDisabled, 0U);
}

TEST(Module, ErrorValuesMayStandInTheLowerHalf) {
  OnModule m(test::module_machine(test::kVoltageOutputs, "error_value_shift = 16", "error_value_shift = 0"));
  ASSERT_TRUE(m.engage()) << m.fault();
  EXPECT_EQ(m.object(0x6444, 1), 6000);
}

TEST(Module, WithMoreOutputsThanTheFileSaysIsNotStarted) {
  OnModule m;
  m.module().replace({0x6411, 0}, 8);
  m.engage();
  EXPECT_TRUE(test::is(m.loop.fault(), ReasonCode::kNodeSetup));
  EXPECT_EQ(m.setup_failure(), "module (node 0x41): reading 0x6411:00 gave 0x8, the machine file says 0x4");
}

TEST(Module, ABrokenWireIsAFaultInWords) {
  OnModule m;
  ASSERT_TRUE(m.engage()) << m.fault();
  ASSERT_TRUE(m.nodes.inject(kModule, sim::NodeFault::kInvalid));
  m.run(10ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << "one value may be damaged";
  m.run(20ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_TRUE(test::begins(m.fault(), "sensor_invalid: module (node 0x41), boom_head_pressure: "));
  EXPECT_TRUE(test::says(m.fault(), "; outside 4-20mA: its wire is broken or has a short circuit"));
}

constexpr std::uint32_t kNeutral = 6000;  // mV

/// Operational, its outputs neutral, its error values as delivered: raw 0 of a valve fed from half the supply is full
/// speed.
struct RunningModule : OnModule {
  RunningModule() {
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
  void tell(canopen::NmtCommand command) {
    bus.port(2).send(canopen::nmt_frame(command, kModule));
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
};

TEST(ModuleStart, OneThatRunsHasItsErrorValuesBeforeItIsToldToRest) {
  RunningModule m;
  EXPECT_EQ(m.furthest(2s), 0);
  EXPECT_TRUE(m.told(canopen::NmtCommand::kEnterPreOperational));
  EXPECT_TRUE(m.module().operational());
  EXPECT_EQ(m.module().value({0x6444, 1}), kNeutral << 16);
  EXPECT_TRUE(m.engage()) << m.fault();
}

TEST(ModuleStart, OneThatIsStoppedAnswersNothingAndIsStartedAllTheSame) {
  RunningModule m;
  for (std::uint8_t output = 1; output <= 4; ++output) m.module().replace({0x6444, output}, kNeutral << 16);
  m.hung = true;
  m.tell(canopen::NmtCommand::kStop);
  m.hung = false;
  EXPECT_EQ(m.furthest(3s), 0);
  EXPECT_TRUE(m.engage()) << m.fault();
}

TEST(ModuleStart, OneThatRunsAndTakesNoErrorValuesIsLeftRunning) {
  RunningModule m;
  m.module().refuse({0x6444, 2}, canopen::SdoAbort::kDeviceState);
  EXPECT_EQ(m.furthest(500ms), 0);
  EXPECT_FALSE(m.told(canopen::NmtCommand::kEnterPreOperational) || m.told(canopen::NmtCommand::kResetNode));
  EXPECT_TRUE(test::is(m.loop.client().fault(), ReasonCode::kNodeSetup));
  EXPECT_TRUE(test::begins(m.setup_failure(), "module (node 0x41): writing 0x6444:02 was refused"));
}

TEST(ModuleStart, AnotherDeviceUnderItsIdIsWrittenNothing) {
  RunningModule m;
  m.module().replace(canopen::kProductCode, 0x0999);
  EXPECT_EQ(m.furthest(500ms), 0);
  EXPECT_TRUE(test::is(m.loop.client().fault(), ReasonCode::kNodeIdentity));
  EXPECT_FALSE(m.told(canopen::NmtCommand::kEnterPreOperational));
  EXPECT_EQ(m.module().value({0x6444, 1}), 0U);
}

}  // namespace
}  // namespace knuckle::slave
