#include "sim/can_nodes.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/can_rig.h"
#include "tests/support/sensor_frames.h"

namespace knuckle::sim::rig {
namespace {

using canopen::NmtCommand;
using canopen::SdoAbort;
using canopen::SdoResponse;

SdoAbort refusal(CanRig& rig, const CanFrame& request) {
  const auto response = rig.ask(request);
  EXPECT_TRUE(response && response->kind == SdoResponse::Kind::kAborted);
  return response ? response->abort : SdoAbort::kNone;
}

bool accepted(CanRig& rig, std::uint8_t id, canopen::Object object, std::uint32_t value, std::uint8_t size) {
  const auto response = rig.ask(canopen::sdo_download(id, object, value, size));
  return response && response->kind == SdoResponse::Kind::kDownloaded && response->object == object;
}

/// Time from `since` until every spool demand is zero or pilot pressure is gone.
Duration time_to_neutral(CanRig& rig, Duration at_most) {
  const Time since = rig.now;
  while (rig.now - since < at_most) {
    const NodeOutputs outputs = rig.nodes.outputs();
    if (!outputs.pilot || outputs.spool_demand.isZero()) break;
    rig.tick();
  }
  return rig.now - since;
}

TEST(CanNodes, AnnounceThemselvesOnceAndThenWaitToBeStarted) {
  CanRig rig;
  rig.run(20ms);
  ASSERT_EQ(rig.heard.size(), CanRig::ids.size());
  for (const Heard& h : rig.heard) {
    EXPECT_EQ(canopen::function_of(h.frame.id), 0x700U);
    EXPECT_EQ(bytes(h.frame), std::vector<int>{0});
  }
  rig.syncing = true;
  rig.run(50ms);
  EXPECT_FALSE(rig.newest(0x1A0)) << "a PDO before NMT start";
}

TEST(CanNodes, ShowTheIdentityOfTheMachineFileAndAWrongOneWhenAsked) {
  CanRig rig;
  rig.tick();
  EXPECT_EQ(rig.ask(canopen::sdo_upload(0x20, canopen::kDeviceType))->value, 404U);
  EXPECT_EQ(rig.ask(canopen::sdo_upload(0x20, canopen::kProductCode))->value, 0x5620U);
  ASSERT_TRUE(rig.nodes.set_product(0x20, 7));
  rig.send(canopen::nmt_frame(NmtCommand::kResetNode, 0x20));
  rig.run(5ms);
  EXPECT_EQ(rig.ask(canopen::sdo_upload(0x20, canopen::kProductCode))->value, 7U);
  EXPECT_FALSE(rig.nodes.set_product(0x77, 7));
}

TEST(CanNodes, RefuseWrongSdoRequestsWithTheCodeThatSaysWhy) {
  CanRig rig;
  rig.tick();
  EXPECT_EQ(refusal(rig, canopen::sdo_upload(0x10, {0x5000, 0})), SdoAbort::kNoObject);
  EXPECT_EQ(refusal(rig, canopen::sdo_upload(0x10, {0x1018, 9})), SdoAbort::kNoSubindex);
  EXPECT_EQ(refusal(rig, canopen::sdo_download(0x10, canopen::kVendorId, 1, 4)), SdoAbort::kReadOnly);
  EXPECT_EQ(refusal(rig, canopen::sdo_download(0x10, canopen::kRpdo1Timer, 1, 4)), SdoAbort::kTooLong);
  EXPECT_EQ(refusal(rig, canopen::sdo_download(0x10, canopen::kRpdo1Timer, 1, 1)), SdoAbort::kTooShort);
  EXPECT_EQ(refusal(rig, canopen::sdo_download(0x10, canopen::kTpdo1Type, 250, 1)), SdoAbort::kInvalidValue);
  EXPECT_EQ(refusal(rig, canopen::sdo_download(0x10, canopen::kTpdo1CobId, 0x123, 4)), SdoAbort::kInvalidValue);
  CanFrame segmented = canopen::sdo_upload(0x10, canopen::kDeviceType);
  segmented.data[0] = 0x60;
  EXPECT_EQ(refusal(rig, segmented), SdoAbort::kUnknownCommand);
}

TEST(CanNodes, RemapAPdoOnlyInTheOrderCia301Prescribes) {
  CanRig rig;
  rig.tick();
  constexpr std::uint8_t kNode = 0x20;
  const canopen::Object entry{0x1A00, 1};
  const std::uint32_t status8 = canopen::mapping(canopen::kPressureStatus, 8);
  EXPECT_EQ(refusal(rig, canopen::sdo_download(kNode, canopen::kTpdo1MapCount, 0, 1)), SdoAbort::kUnsupportedAccess);
  ASSERT_TRUE(accepted(rig, kNode, canopen::kTpdo1CobId, canopen::kPdoDisabled | 0x1A0, 4));
  EXPECT_EQ(refusal(rig, canopen::sdo_download(kNode, entry, status8, 4)), SdoAbort::kUnsupportedAccess);
  ASSERT_TRUE(accepted(rig, kNode, canopen::kTpdo1MapCount, 0, 1));
  EXPECT_EQ(refusal(rig, canopen::sdo_download(kNode, entry, canopen::mapping(canopen::kDeviceType, 32), 4)),
            SdoAbort::kNotMappable);
  ASSERT_TRUE(accepted(rig, kNode, entry, status8, 4));
  EXPECT_EQ(refusal(rig, canopen::sdo_download(kNode, canopen::kTpdo1MapCount, 9, 1)), SdoAbort::kPdoTooLong);
  ASSERT_TRUE(accepted(rig, kNode, canopen::kTpdo1MapCount, 1, 1));
  ASSERT_TRUE(accepted(rig, kNode, canopen::kTpdo1CobId, 0x2A5, 4));
  rig.send(canopen::nmt_frame(NmtCommand::kStart, kNode));
  rig.syncing = true;
  rig.run(20ms);
  ASSERT_TRUE(rig.newest(0x2A5));
  EXPECT_EQ(bytes(rig.newest(0x2A5)->frame), std::vector<int>{0});
  EXPECT_FALSE(rig.newest(0x1A0));
}

TEST(CanNodes, SendSensorValuesInTheStepsOfTheDesign) {
  SensorErrors errors;
  errors.pressure_offset_Pa[0] = 1e5;  // + 1 bar
  errors.encoder_offset_m[1] = 0.001;
  CanRig rig(errors);
  rig.signals.pressure_Pa[0] = 122.4e5;
  rig.signals.cylinder_m[1] = 0.899;
  rig.signals.cylinder_mps[1] = -0.1;
  rig.signals.slope_rad = -2.5 * std::numbers::pi / 180;
  rig.start();
  rig.run(20ms);
  EXPECT_EQ(bytes(rig.newest(0x1A0)->frame), (std::vector<int>{0x34, 0x30, 0, 0, 0}));           // 12340 = 0x3034
  EXPECT_EQ(bytes(rig.newest(0x1B1)->frame), (std::vector<int>{0x28, 0x23, 0, 0, 0x18, 0xFC}));  // 9000, -1000
  EXPECT_EQ(bytes(rig.newest(0x1B8)->frame), (std::vector<int>{0xE7, 0xFF}));                    // -25
  EXPECT_EQ(bytes(rig.newest(0x190)->frame), (std::vector<int>{0x0F, 0, 0, 0}));                 // ACTIVE at rest
  EXPECT_EQ(bytes(rig.newest(0x1C0)->frame), std::vector<int>{3});  // chain closed, pilot on
}

TEST(CanNodes, SensorNoiseHasTheDeviationOfTheTruth) {
  SensorErrors errors;
  errors.pressure_noise_Pa[0] = 0.3e5;
  CanRig rig(errors);
  rig.start();
  rig.run(4s);
  double sum = 0, squares = 0, n = 0;
  for (const Heard& h : rig.heard) {
    if (h.frame.id != 0x1A0) continue;
    const double v = canopen::parse_pressure(h.frame)->pressure_Pa;
    sum += v;
    squares += v * v;
    ++n;
  }
  ASSERT_GT(n, 700);
  EXPECT_NEAR(sum / n, 0, 4e3);
  EXPECT_NEAR(std::sqrt(squares / n), 0.3e5, 3e3);
}

TEST(CanNodes, DefaultMapKeepsTheBusBelowSixtyPercentEvenIfEveryBitIsStuffed) {
  CanRig rig;
  rig.start();
  const Duration before = rig.bus.busy();
  rig.run(2s);
  const double load = to_seconds(rig.bus.busy() - before) / 2;
  EXPECT_LE(load, 0.60);
  EXPECT_GE(load, 0.55) << "something of the default map is missing";
  EXPECT_EQ(rig.bus.dropped(0) + rig.bus.dropped(1), 0U);
}

TEST(ValveNode, ClimbsFromInitToActiveOneStateAtATimeAndFallsAtOnce) {
  CanRig rig;
  rig.tick();
  rig.send(canopen::nmt_frame(NmtCommand::kStart, 0));
  rig.syncing = true;
  rig.run(20ms);
  EXPECT_EQ(rig.status_word(0x10), 0x8);
  const auto command = [&](std::uint16_t word) {
    rig.send(canopen::valve_command_frame(0x210, {word, 0.5}));
    rig.run(10ms);
    return rig.status_word(0x10);
  };
  EXPECT_EQ(command(0x7), 0x9) << "INIT to DISABLED only";
  EXPECT_EQ(command(0x3), 0xB);
  EXPECT_EQ(rig.nodes.outputs().spool_demand[0], 0);
  EXPECT_EQ(command(0x7), 0xF);
  EXPECT_DOUBLE_EQ(rig.nodes.outputs().spool_demand[0], 0.5);
  EXPECT_EQ(command(0x3), 0xB);
  EXPECT_EQ(rig.nodes.outputs().spool_demand[0], 0);
  EXPECT_EQ(command(0x7), 0xF);
  EXPECT_EQ(command(0x1), 0x9) << "straight down to DISABLED";
  EXPECT_EQ(rig.nodes.outputs().spool_demand[0], 0);
}

TEST(ValveNode, IgnoresTheBusInLocalModeAndSaysSo) {
  CanRig rig;
  rig.start();
  rig.command[0].set_point = 0.3;
  rig.run(20ms);
  EXPECT_NEAR(rig.nodes.outputs().spool_demand[0], 0.3, 1e-4);
  ASSERT_TRUE(accepted(rig, 0x10, canopen::kValveControlMode, 2, 1));
  rig.run(20ms);
  EXPECT_EQ(rig.nodes.outputs().spool_demand[0], 0);
  EXPECT_NE(rig.status_word(0x10) & canopen::kStatusLocal, 0);
}

TEST(ValveNode, GoesToNeutralByItselfWhenSetPointsStopAndStaysThereUntilReset) {
  CanRig rig;
  rig.start();
  for (auto& c : rig.command) c.set_point = 0.4;
  rig.run(200ms);
  ASSERT_NEAR(rig.nodes.outputs().spool_demand[2], 0.4, 1e-4);
  rig.commanding = false;
  const Time stopped = rig.now;
  EXPECT_LE(time_to_neutral(rig, 500ms), 52ms);
  rig.run(10ms);
  const auto emergency = rig.newest(canopen::emcy_id(0x12), stopped);
  ASSERT_TRUE(emergency);
  EXPECT_EQ(bytes(emergency->frame), (std::vector<int>{0x50, 0x82, 1, 0, 0, 0, 0, 0}));
  EXPECT_EQ(rig.status_word(0x12), 0x1) << "ready bit cleared";

  rig.commanding = true;
  rig.run(100ms);
  EXPECT_TRUE(rig.nodes.outputs().spool_demand.isZero()) << "resumed by itself";
  for (auto& c : rig.command) c = {canopen::kControlReset | canopen::kControlActive, 0};
  rig.run(50ms);
  EXPECT_EQ(rig.status_word(0x12), 0x1) << "no reset while bit 2 is set";
  for (auto& c : rig.command) c = {0, 0};
  rig.run(20ms);
  for (auto& c : rig.command) c = {canopen::kControlReset | canopen::kControlDisabled, 0};
  rig.run(30ms);
  EXPECT_EQ(rig.status_word(0x12), 0x9);
}

TEST(ValveNode, GoesToNeutralByItselfWhenTheControllersHeartbeatStops) {
  CanRig rig;
  rig.start();
  for (auto& c : rig.command) c.set_point = -0.4;
  rig.run(100ms);
  rig.beating = false;
  const Time stopped = rig.now;
  EXPECT_LE(time_to_neutral(rig, 500ms), 152ms);
  rig.run(10ms);
  EXPECT_TRUE(rig.nodes.outputs().spool_demand.isZero());
  EXPECT_EQ(canopen::parse_emergency(rig.newest(canopen::emcy_id(0x10), stopped)->frame)->code, 0x8130);
}

TEST(ValveNode, IsNeutralInEveryNetworkStateButOperational) {
  for (const auto command : {NmtCommand::kStop, NmtCommand::kEnterPreOperational, NmtCommand::kResetNode}) {
    CanRig rig;
    rig.start();
    for (auto& c : rig.command) c.set_point = 0.4;
    rig.run(100ms);
    rig.send(canopen::nmt_frame(command, 0x11));
    rig.run(5ms);
    EXPECT_EQ(rig.nodes.outputs().spool_demand[1], 0);
    EXPECT_NEAR(rig.nodes.outputs().spool_demand[0], 0.4, 1e-4);
  }
}

TEST(EnableNode, DropsPilotPressureWhenASpoolStaysOutsideItsDemandsForAHundredMilliseconds) {
  CanRig rig;
  rig.start();
  ASSERT_TRUE(rig.nodes.outputs().pilot);
  rig.command[0].set_point = 0.5;
  rig.run(300ms);
  ASSERT_TRUE(rig.nodes.outputs().pilot) << "a healthy spool lags for less than that";
  ASSERT_TRUE(rig.nodes.inject(0x10, NodeFault::kStuck));
  rig.command[0].set_point = 0;
  const Time asked = rig.now;
  while (rig.nodes.outputs().pilot && rig.now - asked < 1s) rig.tick();
  EXPECT_GE(rig.now - asked, 140ms) << "demands of 60 ms, then 100 ms apart";
  EXPECT_LE(rig.now - asked, 185ms);

  rig.run(100ms);
  EXPECT_LT(std::abs(rig.signals.spool[0]), 0.1);
  EXPECT_EQ(bytes(rig.newest(0x1C0)->frame), std::vector<int>{canopen::kInputEStopClosed});
}

TEST(EnableNode, DropsPilotPressureAtTheEStopAndWantsTheOutputToBeOffOnceBeforeItReturns) {
  CanRig rig;
  rig.start();
  rig.nodes.set_estop(true);
  rig.run(1ms);
  EXPECT_FALSE(rig.nodes.outputs().pilot);
  rig.run(4ms);
  EXPECT_EQ(bytes(rig.newest(0x1C0)->frame), std::vector<int>{0}) << "told within one SYNC";
  rig.nodes.set_estop(false);
  rig.run(200ms);
  EXPECT_FALSE(rig.nodes.outputs().pilot) << "resumed by itself";
  rig.output = 0;
  rig.run(60ms);
  rig.output = 1;
  rig.run(60ms);
  EXPECT_TRUE(rig.nodes.outputs().pilot);
}

TEST(EnableNode, DropsPilotPressureOnOutputZeroOnLostHeartbeatAndOnAValveInFaultThatDoesNotClose) {
  CanRig zero;
  zero.start();
  zero.send(canopen::enable_output_frame(0x240, 0));
  zero.run(2ms);
  EXPECT_FALSE(zero.nodes.outputs().pilot);

  CanRig lost;
  lost.start();
  lost.beating = false;
  lost.run(202ms);
  EXPECT_FALSE(lost.nodes.outputs().pilot);

  for (const bool stuck : {false, true}) {
    CanRig fault;
    fault.start();
    fault.command[kArm].set_point = 0.5;
    fault.run(300ms);
    ASSERT_TRUE(fault.nodes.inject(0x11, stuck ? NodeFault::kStuck : NodeFault::kNone));
    fault.commanding = false;  // the valves' watchdogs
    fault.run(140ms);
    EXPECT_TRUE(fault.nodes.outputs().pilot) << "time to close by itself";
    fault.run(60ms);
    EXPECT_EQ(fault.nodes.outputs().pilot, !stuck);
  }
}

TEST(CanNodes, InjectedSensorFaultsAreWhatTheyClaim) {
  CanRig rig;
  rig.signals.pressure_Pa.fill(100e5);
  rig.signals.cylinder_m.setConstant(1.0);
  rig.start();
  const auto pressure = [&] { return *canopen::parse_pressure(rig.newest(0x1A2)->frame); };
  const auto length = [&] { return canopen::parse_encoder(rig.newest(0x1B0)->frame)->position_m; };

  ASSERT_TRUE(rig.nodes.inject(0x22, NodeFault::kFrozen));
  rig.signals.pressure_Pa.fill(120e5);
  rig.run(20ms);
  EXPECT_DOUBLE_EQ(pressure().pressure_Pa, 100e5);
  ASSERT_TRUE(rig.nodes.inject(0x22, NodeFault::kInvalid));
  rig.run(20ms);
  EXPECT_EQ(bytes(rig.newest(0x1A2)->frame), (std::vector<int>{0xFF, 0xFF, 0xFF, 0x7F, canopen::kPressureInvalid}));
  const Time spike = rig.now;
  ASSERT_TRUE(rig.nodes.inject(0x22, NodeFault::kSpike));
  rig.run(30ms);
  const auto far_off = std::count_if(rig.heard.begin(), rig.heard.end(), [&](const Heard& h) {
    return h.frame.id == 0x1A2 && h.at > spike + 1ms && canopen::parse_pressure(h.frame)->pressure_Pa > 200e5;
  });
  EXPECT_EQ(far_off, 1);
  EXPECT_DOUBLE_EQ(pressure().pressure_Pa, 120e5);

  ASSERT_TRUE(rig.nodes.inject(0x30, NodeFault::kBrokenWire));
  rig.run(200ms);
  EXPECT_NEAR(length(), 0.7, 0.02);
  rig.run(1s);
  EXPECT_EQ(length(), 0);

  EXPECT_FALSE(rig.nodes.inject(0x20, NodeFault::kStuck));
  EXPECT_FALSE(rig.nodes.inject(0x10, NodeFault::kBrokenWire));
  EXPECT_FALSE(rig.nodes.inject(0x7F, NodeFault::kSilent));
  ASSERT_TRUE(rig.nodes.send_emcy(0x25, 0x5030));
  rig.run(2ms);
  EXPECT_EQ(bytes(rig.newest(0xA5)->frame), (std::vector<int>{0x30, 0x50, 1, 0, 0, 0, 0, 0}));
}

}  // namespace
}  // namespace knuckle::sim::rig
