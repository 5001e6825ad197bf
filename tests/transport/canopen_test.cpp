#include "transport/canopen.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "tests/support/sensor_frames.h"
#include "tests/transport/hex.h"

namespace knuckle::canopen {
namespace {

using test::frame;

TEST(Canopen, NetworkFramesHaveTheBytesOfCia301) {
  EXPECT_EQ(nmt_frame(NmtCommand::kStart, 0), frame("000#0100"));
  EXPECT_EQ(nmt_frame(NmtCommand::kStop, 0x10), frame("000#0210"));
  EXPECT_EQ(nmt_frame(NmtCommand::kEnterPreOperational, 0x7F), frame("000#807F"));
  EXPECT_EQ(nmt_frame(NmtCommand::kResetNode, 1), frame("000#8101"));
  EXPECT_EQ(nmt_frame(NmtCommand::kResetCommunication, 1), frame("000#8201"));
  EXPECT_EQ(sync_frame(), frame("080#"));
  EXPECT_EQ(heartbeat_frame(1, NmtState::kOperational), frame("701#05"));
  EXPECT_EQ(heartbeat_frame(0x10, NmtState::kBootUp), frame("710#00"));
  EXPECT_EQ(emergency_frame(0x12, {0x8250, 0x11, {1, 2, 3, 4, 5}}), frame("092#50821101 02030405"));
}

TEST(Canopen, NetworkFramesAreParsedAndStrangeOnesRefused) {
  EXPECT_EQ(parse_nmt(frame("000#8110"))->command, NmtCommand::kResetNode);
  EXPECT_EQ(parse_nmt(frame("000#8110"))->node, 0x10);
  for (const char* bad : {"000#01", "000#0300", "000#0180", "001#0100", "000#010000"}) {
    EXPECT_FALSE(parse_nmt(frame(bad))) << bad;
  }
  EXPECT_EQ(parse_heartbeat(frame("710#7F")), NmtState::kPreOperational);
  EXPECT_EQ(parse_heartbeat(frame("710#04")), NmtState::kStopped);
  for (const char* bad : {"710#", "710#06", "700#05", "690#05", "710#0500"}) {
    EXPECT_FALSE(parse_heartbeat(frame(bad))) << bad;
  }
  EXPECT_EQ(parse_emergency(frame("090#3081010000000000"))->code, 0x8130);
  EXPECT_FALSE(parse_emergency(frame("080#3081010000000000")));
  EXPECT_FALSE(parse_emergency(frame("090#30810100000000")));
}

TEST(Canopen, ExpeditedSdoFramesHaveTheBytesOfCia301) {
  EXPECT_EQ(sdo_upload(0x20, kVendorId), frame("620#4018100100000000"));
  EXPECT_EQ(sdo_download(0x10, kProducerHeartbeat, 100, 2), frame("610#2B17100064000000"));
  EXPECT_EQ(sdo_download(0x10, kTpdo1Type, 2, 1), frame("610#2F00180202000000"));
  EXPECT_EQ(sdo_download(0x10, kConsumerHeartbeat, 1U << 16 | 150, 4), frame("610#2316100196000100"));
  EXPECT_EQ(sdo_download(0x10, kTpdo1Type, 0xFFFFFF02, 1), frame("610#2F00180202000000"));
  EXPECT_EQ(sdo_downloaded(0x10, kTpdo1Type), frame("590#6000180200000000"));
  EXPECT_EQ(sdo_uploaded(0x20, kVendorId, 0x12345678, 4), frame("5A0#4318100178563412"));
  EXPECT_EQ(sdo_uploaded(0x20, kErrorRegister, 1, 1), frame("5A0#4F01100001000000"));
  EXPECT_EQ(sdo_aborted(0x20, {0x5000, 0}, SdoAbort::kNoObject), frame("5A0#8000500000000206"));
}

TEST(Canopen, SdoResponsesAreParsed) {
  const auto uploaded = parse_sdo_response(frame("5A0#4B171000 64001234"));
  ASSERT_TRUE(uploaded);
  EXPECT_EQ(uploaded->kind, SdoResponse::Kind::kUploaded);
  EXPECT_EQ(uploaded->object, kProducerHeartbeat);
  EXPECT_EQ(uploaded->size, 2);
  EXPECT_EQ(uploaded->value, 100U) << "bytes beyond the size do not count";
  const auto unsized = parse_sdo_response(frame("5A0#42000010 98010200"));
  EXPECT_EQ(unsized->size, 4);
  EXPECT_EQ(unsized->value, 0x00020198U);
  EXPECT_EQ(parse_sdo_response(frame("590#6000180200000000"))->kind, SdoResponse::Kind::kDownloaded);
  const auto aborted = parse_sdo_response(frame("590#8000180211000906"));
  EXPECT_EQ(aborted->kind, SdoResponse::Kind::kAborted);
  EXPECT_EQ(aborted->abort, SdoAbort::kNoSubindex);
  EXPECT_EQ(parse_sdo_response(frame("590#4108100010000000"))->kind, SdoResponse::Kind::kNotExpedited);
  EXPECT_FALSE(parse_sdo_response(frame("590#60001802")));
  EXPECT_FALSE(parse_sdo_response(frame("610#6000180200000000")));
}

TEST(Canopen, SdoRequestsAreParsed) {
  const auto download = parse_sdo_request(frame("610#2B17100064000000"));
  EXPECT_EQ(download->kind, SdoRequest::Kind::kDownload);
  EXPECT_EQ(download->size, 2);
  EXPECT_EQ(download->value, 100U);
  EXPECT_EQ(parse_sdo_request(frame("610#4018100100000000"))->kind, SdoRequest::Kind::kUpload);
  EXPECT_EQ(parse_sdo_request(frame("610#2108100008000000"))->kind, SdoRequest::Kind::kOther);
  EXPECT_EQ(parse_sdo_request(frame("610#8018100100000405"))->kind, SdoRequest::Kind::kAbort);
  EXPECT_FALSE(parse_sdo_request(frame("610#401810")));
}

TEST(Canopen, ProcessDataHaveTheBytesOfTheDesign) {
  EXPECT_EQ(valve_status_frame(0x190, {0xF, -0.25}), frame("190#0F0000F0"));
  EXPECT_EQ(valve_command_frame(0x210, {kControlActive, 1}), frame("210#07000040"));
  EXPECT_EQ(valve_command_frame(0x210, {kControlActive, -1}), frame("210#070000C0"));
  EXPECT_EQ(pressure_frame(0x1A0, {123.4e5, 0}), frame("1A0#3430000000"));
  EXPECT_EQ(pressure_frame(0x1A0, {-1e5, kPressureInvalid}), frame("1A0#9CFFFFFF01"));
  EXPECT_EQ(encoder_frame(0x1B0, {0.9, -0.1}), frame("1B0#2823000018FC"));
  EXPECT_EQ(encoder_frame(0x1B0, {0.9, 0.1}, 1e-5, 1e-3), frame("1B0#905F01006400"));
  EXPECT_EQ(tilt_frame(0x1B8, -2.5 * std::numbers::pi / 180), frame("1B8#E7FF"));
  EXPECT_EQ(enable_inputs_frame(0x1C0, kInputEStopClosed | kInputPilotOn), frame("1C0#03"));
  EXPECT_EQ(enable_output_frame(0x240, kOutputEnable), frame("240#01"));
  EXPECT_EQ(kEncoderTpdo.entries[0], 0x60040020U);
  EXPECT_EQ(kValveRpdo.entries[1], 0x63000110U);
  EXPECT_EQ(kPressureTpdo.entries[1], 0x61500108U);
}

TEST(Canopen, ProcessDataSurviveTheRoundTripWithinHalfAStep) {
  std::mt19937 random(3);
  std::uniform_real_distribution<> unit(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const double u = unit(random);
    ASSERT_NEAR(parse_valve_command(valve_command_frame(0x210, {7, u}))->set_point, u, 0.5 / 16384);
    ASSERT_NEAR(parse_valve_status(valve_status_frame(0x190, {7, u}))->spool, u, 0.5 / 16384);
    ASSERT_NEAR(parse_pressure(pressure_frame(0x1A0, {400e5 * u, 0}))->pressure_Pa, 400e5 * u, 501);
    const auto encoder = parse_encoder(encoder_frame(0x1B0, {2 * u, 3 * u}));
    ASSERT_NEAR(encoder->position_m, 2 * u, 0.501e-4);
    ASSERT_NEAR(encoder->speed_mps, 3 * u, 0.501e-4);
    ASSERT_NEAR(*parse_tilt(tilt_frame(0x1B8, u)), u, 0.501 * kTiltStep_rad);
  }
}

TEST(Canopen, OfProcessDataLongerThanMappedTheFirstBytesCount) {
  for (const char* more : {"", "FF", "EEFF"}) {
    const auto longer = [more](const char* text) { return frame(std::string(text) + more); };
    EXPECT_EQ(parse_valve_status(longer("190#0F0000F0"))->spool, -0.25);
    EXPECT_EQ(parse_valve_command(longer("210#07000040"))->set_point, 1);
    EXPECT_NEAR(parse_pressure(longer("1A0#3430000001"))->pressure_Pa, 123.4e5, 1);
    EXPECT_EQ(parse_pressure(longer("1A0#3430000001"))->status, kPressureInvalid);
    EXPECT_NEAR(parse_encoder(longer("1B0#2823000018FC"))->position_m, 0.9, 1e-9);
    EXPECT_NEAR(parse_encoder(longer("1B0#2823000018FC"))->speed_mps, -0.1, 1e-9);
    EXPECT_NEAR(*parse_tilt(longer("1B8#E7FF")), -2.5 * std::numbers::pi / 180, 1e-9);
    EXPECT_EQ(parse_enable(longer("1C0#03")), kInputEStopClosed | kInputPilotOn);
  }
}

TEST(Canopen, ProcessDataShorterThanMappedAreRefused) {
  EXPECT_FALSE(parse_valve_status(frame("190#0F0000")));
  EXPECT_FALSE(parse_valve_command(frame("210#0F0000")));
  EXPECT_FALSE(parse_pressure(frame("1A0#34300000")));
  EXPECT_FALSE(parse_encoder(frame("1B0#28230000")));
  EXPECT_FALSE(parse_tilt(frame("1B8#E7")));
  EXPECT_FALSE(parse_enable(frame("1C0#")));
}

TEST(Canopen, ValuesBeyondTheWireSaturateAndNanIsNeutral) {
  EXPECT_EQ(valve_command_frame(0x210, {7, 5}), frame("210#0700FF7F"));
  EXPECT_EQ(valve_command_frame(0x210, {7, -5}), frame("210#07000080"));
  EXPECT_EQ(valve_command_frame(0x210, {7, std::nan("")}), frame("210#07000000"));
  EXPECT_EQ(pressure_frame(0x1A0, {1e30, 0}), frame("1A0#FFFFFF7F00"));
}

TEST(Canopen, ValveStatesAreThoseOfCia408) {
  EXPECT_EQ(valve_state(0x8), ValveState::kInit);
  EXPECT_EQ(valve_state(0x9), ValveState::kDisabled);
  EXPECT_EQ(valve_state(0xB), ValveState::kHold);
  EXPECT_EQ(valve_state(0x1F), ValveState::kActive) << "local bit is not part of the state";
  EXPECT_FALSE(valve_state(0xD));
  EXPECT_TRUE(valve_fault(0x7));
  EXPECT_FALSE(valve_fault(0xF));
}

TEST(Canopen, EmergencyAndAbortCodesAreReadable) {
  EXPECT_STREQ(emergency_text(0x8130), "heartbeat of a watched node missing");
  EXPECT_STREQ(emergency_text(0x4242), "device temperature");
  EXPECT_STREQ(emergency_text(0xFF12), "device specific");
  EXPECT_STREQ(emergency_text(0xABCD), "unknown error code");
  EXPECT_STREQ(abort_text(SdoAbort::kNoObject), "object does not exist");
  EXPECT_STREQ(abort_text(static_cast<SdoAbort>(0x08000022)), "data cannot be stored: device state");
  EXPECT_STREQ(abort_text(static_cast<SdoAbort>(1)), "unknown abort code");
}

}  // namespace
}  // namespace knuckle::canopen
