#include "transport/hid_reports.h"

#include <gtest/gtest.h>

#include "tests/transport/hex.h"
#include "transport/hid_pair.h"

namespace knuckle {
namespace {

/// The bytes from the front, zeros, and the checksum (little-endian) at the end.
HidReport report_of(const std::string& front, std::uint16_t crc) {
  HidReport report{};
  const auto bytes = test::hex(front);
  std::copy(bytes.begin(), bytes.end(), report.begin());
  report[62] = static_cast<std::uint8_t>(crc);
  report[63] = static_cast<std::uint8_t>(crc >> 8);
  return report;
}

HidReport sealed(HidReport report) {
  const std::uint16_t crc = crc16_ccitt_false(report.data(), 62);
  report[62] = static_cast<std::uint8_t>(crc);
  report[63] = static_cast<std::uint8_t>(crc >> 8);
  return report;
}

// Checksums below come from an independent implementation (Python's binascii.crc_hqx).
const HidReport kState = report_of(
    "01 01 0201 04030201 01000000 FEFFFFFF 04030201 FFFFFFFF 00010000 00000000 E803 18FC 0000 1300 2100 CDAB C05D C9FF",
    0xC63E);
const HidReport kCommand = report_of("02 01 0500 02 00 F401 0CFE 0000 E803 F401 6400 1400 3412", 0x418E);
const HidReport kIdentity = report_of(
    "03 01 00100000 00200000 00400000 0000A040 00008040 00000040 0000803E 0000003E 0000803D E803 D007 B80B 02 "
    "01000000 FFFFFFFF 00010000 EFBEADDE",
    0xE19E);

DeviceState some_state() {
  DeviceState state;
  state.sequence = 0x0102;
  state.device_time_us = 0x01020304;
  state.counts = {1, -2, 0x01020304};
  state.counts_per_s = {-1, 256, 0};
  state.current_mA = {1000, -1000, 0};
  state.status = kDevicePresence | kDeviceEnable | kDeviceTorqueOn;
  state.fault = kDeviceFaultWatchdog | kDeviceFaultEncoder;
  state.last_command_sequence = 0xABCD;
  state.bus_mV = 24000;
  state.temperature_dC = -55;
  return state;
}

DeviceIdentity some_identity() {
  return {{4096, 8192, 16384}, {5, 4, 2}, {0.25F, 0.125F, 0.0625F}, {1000, 2000, 3000}, {1, -1, 1},
          {1, -1, 256},        0xDEADBEEF};
}

TEST(HidReports, ChecksumIsCrc16CcittFalse) {
  const std::string check = "123456789";
  EXPECT_EQ(crc16_ccitt_false(reinterpret_cast<const std::uint8_t*>(check.data()), check.size()), 0x29B1);
}

TEST(HidReports, EveryKindHasTheBytesOfTheDesignBothWays) {
  const DeviceCommand command{5, TorqueMode::kTorque, 0, {500, -500, 0}, {1000, 500, 100}, 20, 0x1234};
  EXPECT_EQ(encode(some_state()), kState);
  EXPECT_EQ(encode(command), kCommand);
  EXPECT_EQ(encode(some_identity()), kIdentity);
  EXPECT_EQ(encode_describe_request(), report_of("04 01", 0x6F3A));
  EXPECT_EQ(encode(decode_state(kState).value()), kState);
  EXPECT_EQ(encode(decode_command(kCommand).value()), kCommand);
  EXPECT_EQ(encode(decode_identity(kIdentity).value()), kIdentity);
  EXPECT_EQ(decode_state(kState)->counts, some_state().counts);
  EXPECT_EQ(decode_state(kState)->temperature_dC, -55);
  EXPECT_EQ(decode_command(kCommand)->torque_permille[1], -500);
  EXPECT_EQ(decode_identity(kIdentity)->gear_ratio, some_identity().gear_ratio);
  EXPECT_TRUE(is_describe_request(report_of("04 01", 0x6F3A)));
}

TEST(HidReports, AnyDamagedByteIsRefused) {
  const auto refused = [](const HidReport& report) {
    return !decode_state(report) && !decode_command(report) && !decode_identity(report) && !is_describe_request(report);
  };
  for (const HidReport& good : {kState, kCommand, kIdentity, encode_describe_request()}) {
    ASSERT_FALSE(refused(good));
    for (std::size_t byte = 0; byte < good.size(); ++byte) {
      for (unsigned bit = 0; bit < 8; ++bit) {
        HidReport damaged = good;
        damaged[byte] = static_cast<std::uint8_t>(damaged[byte] ^ (1U << bit));
        EXPECT_TRUE(refused(damaged)) << "byte " << byte << " bit " << bit;
      }
    }
  }
}

TEST(HidReports, WrongVersionModeFlagsOrValuesAreRefusedThoughTheChecksumFits) {
  const auto with = [](HidReport report, std::size_t byte, std::uint8_t value) {
    report[byte] = value;
    return sealed(report);
  };
  EXPECT_FALSE(decode_state(with(kState, 1, 2)));
  EXPECT_FALSE(decode_state(with(kState, 38, 0x40))) << "unknown status bit";
  EXPECT_FALSE(decode_state(with(kState, 41, 0x01))) << "unknown fault bit";
  EXPECT_FALSE(decode_command(with(kCommand, 4, 3))) << "unknown mode";
  EXPECT_FALSE(decode_command(with(kCommand, 5, 1))) << "unknown flag";
  EXPECT_FALSE(decode_identity(with(kIdentity, 44, 0x08))) << "sign of a fourth joint";
  HidReport nan = kIdentity;
  nan[16] = 0xC0;
  nan[17] = 0x7F;  // first gear ratio becomes NaN
  EXPECT_FALSE(decode_identity(sealed(nan)));
  DeviceIdentity zero = some_identity();
  zero.counts_per_turn[2] = 0;
  EXPECT_FALSE(decode_identity(encode(zero)));
}

TEST(HidPair, DeliversInOrderOneTickLater) {
  HidPair cable;
  HidReport report{};
  for (std::uint8_t i = 1; i <= 3; ++i) {
    report[0] = i;
    ASSERT_TRUE(cable.device().write(report));
  }
  EXPECT_FALSE(cable.host().read(report)) << "before the tick";
  cable.advance();
  for (std::uint8_t i = 1; i <= 3; ++i) {
    ASSERT_TRUE(cable.host().read(report));
    EXPECT_EQ(report[0], i);
  }
  EXPECT_FALSE(cable.host().read(report));
  EXPECT_FALSE(cable.device().read(report)) << "nothing comes back";
}

TEST(HidPair, KeepsTheOldest64ReportsAndCountsWhatItRefused) {
  HidPair cable;
  HidReport report{};
  for (std::uint8_t i = 0; i < 70; ++i) {
    report[0] = i;
    EXPECT_EQ(cable.host().write(report), i < 64);
  }
  EXPECT_EQ(cable.dropped(), 6U);
  cable.advance();
  ASSERT_TRUE(cable.device().read(report));
  EXPECT_EQ(report[0], 0);
}

TEST(HidPair, UnpluggedLosesWhatWasOnItsWayAndRefusesMore) {
  HidPair cable;
  HidReport report{};
  cable.device().write(report);
  cable.advance();
  cable.unplug();
  EXPECT_FALSE(cable.host().connected());
  EXPECT_FALSE(cable.device().connected());
  EXPECT_FALSE(cable.host().read(report));
  EXPECT_FALSE(cable.host().write(report));
  cable.plug();
  cable.advance();
  EXPECT_TRUE(cable.host().connected());
  EXPECT_FALSE(cable.host().read(report)) << "an old report came back";
  EXPECT_TRUE(cable.host().write(report));
}

}  // namespace
}  // namespace knuckle
