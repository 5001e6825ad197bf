// A machine whose pilot valves and sensors hang on a CiA 401 module: its start-up, what its outputs do when nobody
// tells them, and how it is led.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "machine/reason_text.h"
#include "machine/set_points.h"
#include "slave/command_frames.h"
#include "slave/node_setup.h"
#include "slave/orderly_stop.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/module_machine.h"

namespace knuckle::slave {
namespace {

constexpr std::uint8_t kModule = 0x41;
constexpr std::uint32_t kOutputs = 0x341;

struct OnModule : test::BenchMachine {
  explicit OnModule(const MachineDescription& machine = test::module_machine()) : BenchMachine(calibrated(machine)) {
    signals.shaft_rad = JointVector(0.3, -1.5, -0.8);
  }
  [[nodiscard]] std::string fault() const { return text_with_code(loop.fault(), description.bus); }
  [[nodiscard]] bool closed() const {
    return (signals.spool.array().abs() < description.cylinders[kBoom].valve.dead_band_extend).all();
  }
  [[nodiscard]] sim::NodeProtocol& module() { return *nodes.node(kModule); }
  /// Of 0x6411, 0x6444 or 0x6443.
  [[nodiscard]] std::int32_t object(std::uint16_t index, std::uint8_t output) {
    return static_cast<std::int32_t>(module().value({index, output}));
  }
};

class ModuleOf : public testing::TestWithParam<const char*> {
 protected:
  ModuleOf() : m(test::module_machine(GetParam())) {}
  OnModule m;
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
  EXPECT_EQ(m.loop.fault().code, ReasonCode::kNodeSetup) << m.fault();
  const std::string why = text(m.loop.client().setup_failure(), m.description.bus);
  EXPECT_EQ(why, "module (node 0x41): reading 0x6411:00 gave 0x8, the machine file says 0x4");
}

/// Nor reset: its outputs would be at the device's defaults, which need not be neutral.
TEST(Module, ThatTakesNoErrorValuesIsNotStarted) {
  OnModule m;
  m.module().refuse({0x6444, 3}, canopen::SdoAbort::kDeviceState);
  m.engage();
  EXPECT_EQ(m.loop.fault().code, ReasonCode::kNodeSetup) << m.fault();
  EXPECT_TRUE(std::none_of(m.wire.begin(), m.wire.end(), [](const auto& sent) {
    const auto nmt = canopen::parse_nmt(sent.frame);
    return nmt && nmt->command == canopen::NmtCommand::kResetNode && nmt->node == kModule;
  }));
}

TEST(Module, WithoutAnyGuardIsStartedOnlyIfTheFileSaysWhy) {
  for (const char* why : {"", "unguarded = \"a relay\"\n"}) {
    OnModule m(
        test::module_machine(test::kVoltageOutputs, "error_value_shift", std::string(why) + "error_value_shift"));
    m.module().remove({0x1401, 5});
    m.module().remove(canopen::kConsumerHeartbeat);
    EXPECT_EQ(m.engage(), *why != 0) << m.fault();
  }
}

TEST_P(ModuleOf, FollowsTheHandAndStandsWithIt) {
  ASSERT_TRUE(m.engage()) << m.fault();
  const JointVector from = m.angles();
  m.move(JointVector(0.1, -0.1, 0.15), 2s);
  m.move(JointVector::Zero(), 1500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << m.fault();
  const JointVector went = m.angles() - from, wanted(0.2, -0.2, 0.3);
  for (int i = 0; i < kJoints; ++i) EXPECT_NEAR(went[i], wanted[i], 0.04) << i;
}

TEST_P(ModuleOf, ItsOutputsGoToTheirErrorValuesWhenTheControllerDies) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 1s);
  ASSERT_FALSE(m.closed());
  m.hung = true;
  // 50 ms without frames, and the spool's way home.
  m.run(50ms + 100ms);
  EXPECT_TRUE(m.closed());
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
  m.run(1s);
  EXPECT_TRUE(m.closed());
  EXPECT_FALSE(m.nodes.outputs().pilot) << "the enable node has missed the heartbeat";
}

TEST_P(ModuleOf, ThatIsOffTheBusIsNeutralAndAFault) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 1s);
  m.nodes.inject(kModule, sim::NodeFault::kSilent);
  m.run(200ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.fault().rfind("sensor_stale: module (node 0x41): ", 0), 0U) << m.fault();
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
  EXPECT_TRUE(m.closed());
  // Its cable is mended: nothing moves before the operator has let go and pressed again.
  m.nodes.inject(kModule, sim::NodeFault::kNone);
  m.run(2s);
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
  EXPECT_TRUE(m.engage()) << m.fault();
}

TEST_P(ModuleOf, ThatStartsAnewIsNeutralAndAFault) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 1s);
  m.bus.port(2).send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, kModule));
  m.move(JointVector(0.15, 0, 0), 100ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault) << m.fault();
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
}

TEST_P(ModuleOf, StopsByItsEStopAndDoesNotResume) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 500ms);
  m.nodes.set_estop(true);
  m.move(JointVector(0.15, 0, 0), 100ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop);
  m.nodes.set_estop(false);
  m.move(JointVector(0.15, 0, 0), 500ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEStop) << "enable is still held";
  EXPECT_TRUE(m.closed());
}

TEST_P(ModuleOf, PilotPressureIsOffWhileNobodyLeads) {
  ASSERT_TRUE(m.engage()) << m.fault();
  EXPECT_TRUE(m.nodes.outputs().pilot);
  m.hand.enable = false;
  m.run(300ms);
  EXPECT_FALSE(m.nodes.outputs().pilot);
}

TEST_P(ModuleOf, AValveThatStaysOpenIsFoundByTheMotion) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.jammed[kArm] = 0.5;
  m.run(1s);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.fault().rfind("motion_not_following: arm: ", 0), 0U) << m.fault();
}

TEST_P(ModuleOf, AnotherSenderOfItsOutputsIsAFault) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.bus.port(2).send({.id = kOutputs, .size = 8, .data = {}});
  m.run(20ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.loop.fault().code, ReasonCode::kOtherController) << m.fault();
}

TEST_P(ModuleOf, IsLeftNeutralByAnOrderlyStop) {
  ASSERT_TRUE(m.engage()) << m.fault();
  m.move(JointVector(0.15, 0, 0), 500ms);
  ASSERT_FALSE(m.closed());
  m.hung = true;
  m.run(2ms);  // what was sent before
  OrderlyStop stop(m.description, m.can);
  stop.go_on_from(m.loop.client().command_frames());
  m.wire.clear();
  for (int i = 0; i < 200 && !stop.done(); ++i) {
    stop.step(m.now);
    m.run(5ms);
  }
  m.run(500ms);
  EXPECT_TRUE(stop.done());
  EXPECT_FALSE(stop.unconfirmed_pilot());
  EXPECT_TRUE(m.closed());
  EXPECT_FALSE(m.module().operational());
  EXPECT_EQ(m.nodes.outputs().spool_demand, JointVector::Zero());
  int told = 0;
  for (const auto& sent : m.wire) {
    for (int joint = 0; joint < kJoints; ++joint) {
      const auto set_point = set_point_in(sent.frame, joint, m.description.bus);
      told += set_point ? 1 : 0;
      EXPECT_EQ(set_point.value_or(0), 0);
    }
  }
  EXPECT_GT(told, 0);
}

INSTANTIATE_TEST_SUITE_P(Outputs, ModuleOf, testing::Values(test::kVoltageOutputs, test::kCurrentOutputs),
                         [](const auto& kind) { return kind.index == 0 ? "HalfTheSupply" : "MagnetEachWay"; });

TEST(Module, ABrokenWireIsAFaultInWords) {
  OnModule m;
  ASSERT_TRUE(m.engage()) << m.fault();
  ASSERT_TRUE(m.nodes.inject(kModule, sim::NodeFault::kInvalid));
  m.run(10ms);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << "one value may be damaged";
  m.run(20ms);
  EXPECT_EQ(m.loop.mode(), Mode::kFault);
  EXPECT_EQ(m.fault().rfind("sensor_invalid: module (node 0x41), boom_head_pressure: ", 0), 0U) << m.fault();
  EXPECT_NE(m.fault().find("; outside 4-20mA: its wire is broken or has a short circuit"), std::string::npos)
      << m.fault();
}

TEST(Module, ThatSendsNoInputsUntilItIsToldToIsHeard) {
  OnModule m;
  ASSERT_TRUE(m.engage()) << m.fault();
  m.module().replace(canopen::kAnalogInputSends, 0);
  m.run(100ms);
  EXPECT_EQ(m.loop.fault().code, ReasonCode::kSensorStale) << m.fault();
}

class KeptBus final : public CanBus {
 public:
  bool send(const CanFrame& frame) noexcept override {
    if (full) return false;
    sent.push_back(frame);
    return true;
  }
  bool receive(CanFrame&) noexcept override { return false; }
  CanState state() const noexcept override { return CanState::kActive; }
  std::uint64_t errors() const noexcept override { return 0; }
  std::vector<CanFrame> sent;
  bool full = false;
};

/// Seeded: whatever is commanded, from step to step, an output does nothing that no gate has let pass. Decoded byte by
/// byte.
TEST(Module, AnOutputThatNoGateLetMoveIsNeutral) {
  const MachineDescription machine = test::module_machine();
  std::mt19937 random(61);
  std::uniform_real_distribution<> value(-0.35, 0.35);
  std::bernoulli_distribution coin(0.5), full(0.1);
  KeptBus bus;
  CommandFrames frames(machine.bus);
  Time now{1s};
  for (int i = 0; i < 20000; ++i) {
    const bool led = coin(random);
    const auto joint = static_cast<int>(random() % kJoints);
    const double asked = led && coin(random) ? value(random) : 0;
    JogState state;
    state.joint = joint;
    state.since = state.oldest_at = now;
    JointVector wanted = JointVector::Zero();
    wanted[joint] = asked;
    bus.full = full(random);
    bus.sent.clear();
    frames.step(led ? jog_gate(wanted, state, {wanted, now}, GateLimits(machine), now).commands : PassedCommands(), led,
                bus, now);
    now += 5ms;
    for (const CanFrame& frame : bus.sent) {
      ASSERT_EQ(frame.id, kOutputs);
      ASSERT_EQ(frame.size, 8);
      const auto volts = [&](std::size_t output) {
        return 1e-3 * static_cast<std::int16_t>(frame.data[2 * output] | frame.data[2 * output + 1] << 8);
      };
      ASSERT_EQ(volts(3), 6);
      for (std::size_t j = 0; j < kJoints; ++j) {
        const double want = static_cast<int>(j) == joint ? asked : 0;
        const double said = (volts(j) - 6) / (j == kBucket ? -3 : 3);
        ASSERT_NEAR(said, want, 0.0005) << i;
        ASSERT_LE(std::abs(said), std::abs(want) + 1e-9) << i << ": rounded beyond what a gate has capped";
        ASSERT_TRUE(want != 0 || volts(j) == 6) << i;
      }
    }
  }
}

}  // namespace
}  // namespace knuckle::slave
