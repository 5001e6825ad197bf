#include "transport/link_messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "tests/support/places.h"
#include "tests/transport/hex.h"
#include "transport/link_kind.h"
#include "transport/machine_status.h"

namespace knuckle {
namespace {

std::vector<std::uint8_t> bytes(const Datagram& datagram) {
  return {datagram.view().begin(), datagram.view().end()};
}

MasterMessage some_master() {
  MasterMessage m;
  m.stamp = {0x0807060504030201, 9, 0x01020304, Time(1ms), Time(2ns)};
  m.device_report_at = Time(-1ns);
  m.stops = 3;
  m.releases = 0x01020304;
  m.presence = m.clutch = m.device_ok = true;
  m.device_reason = {ReasonCode::kNoPresence, 7, 1.0F, -2.0F};
  m.position_rad = {1, 2, -1};
  m.velocity_radps = {0, 0.5, 0};
  m.rendered_N = {-2, 1};
  m.assist = {1500, true};
  m.energy_in_J = 4;
  return m;
}

const std::string kMaster =
    "4B4E 08 01  0102030405060708 0900000000000000 04030201  40420F0000000000 0200000000000000  "
    "FFFFFFFFFFFFFFFF 03000000 04030201  35  0200 07 0000803F 000000C0 "
    "000000000000F03F 0000000000000040 000000000000F0BF  0000000000000000 000000000000E03F 0000000000000000 "
    "00000000000000C0 000000000000F03F  "
    "0080BB44  0000000000001040";

SlaveMessage some_slave() {
  SlaveMessage m;
  m.stamp = {9, 0x0807060504030201, 1, Time(1ns), Time(2ns)};
  m.sensor_at = Time(3ns);
  m.mode = Mode::kFault;
  m.blocking = {ReasonCode::kNoPresence, 0, 0, 0};
  m.fault = {ReasonCode::kStartingUp, 9, 1, 2};
  m.position_rad = {1, 0, 0};
  m.velocity_radps = {0, 1, 0};
  m.ahead_rad = {0, 0, 1};
  m.tip_force_N = {2, -1};
  m.load_N = {0, -2};
  m.covariance_N2 = {4, 0, 10};
  m.confidence = 0.5;
  m.contact_compliance = 1;
  m.contact = true;
  m.limits = kLimitPressure | kLimitPumpFlow | kLimitAssistForce;
  m.pressure_Pa = {1, 2, 4, 10, 0.5, 0};
  m.payload_kg = 10;
  m.payload_sigma_kg = 0.5;
  m.energy_in_J = 2;
  return m;
}

const std::string kZero = "0000000000000000 ", kHalf = "000000000000E03F ", kOne = "000000000000F03F ",
                  kTwo = "0000000000000040 ", kFour = "0000000000001040 ", kTen = "0000000000002440 ",
                  kMinusOne = "000000000000F0BF ", kMinusTwo = "00000000000000C0 ";
const std::string kSlave =
    "4B4E 08 02  0900000000000000 0102030405060708 01000000 0100000000000000 0200000000000000  "
    "0300000000000000 "
    "06  0200 00 00000000 00000000  0100 09 0000803F 00000040 " +
    kOne + kZero + kZero + kZero + kOne + kZero + kZero + kZero + kOne + kTwo + kMinusOne + kZero + kMinusTwo + kFour +
    kZero + kTen + kHalf + kOne + "01 5001 " + kOne + kTwo + kFour + kTen + kHalf + kZero + kTen + kHalf + kTwo;

TEST(LinkMessages, HaveTheBytesOfTheDesign) {
  EXPECT_EQ(bytes(encode(some_master())), test::hex(kMaster));
  EXPECT_EQ(bytes(encode(some_slave())), test::hex(kSlave));
}

TEST(LinkMessages, DecodeTheSameBytes) {
  const auto master = decode_master(test::hex(kMaster));
  ASSERT_TRUE(master);
  EXPECT_EQ(bytes(encode(*master)), test::hex(kMaster));
  EXPECT_TRUE(master->presence && master->clutch && master->device_ok);
  EXPECT_FALSE(master->enable || master->stop);
  EXPECT_EQ(master->assist.force_limit_N, 1500);
  EXPECT_EQ(master->rendered_N, PlanarVector(-2, 1));
  EXPECT_TRUE(master->assist.stop_on_object);
  EXPECT_EQ(master->position_rad, JointVector(1, 2, -1));
  EXPECT_EQ(master->device_report_at, Time(-1ns));
  const auto slave = decode_slave(test::hex(kSlave));
  ASSERT_TRUE(slave);
  EXPECT_EQ(bytes(encode(*slave)), test::hex(kSlave));
  EXPECT_EQ(slave->mode, Mode::kFault);
  EXPECT_EQ(slave->fault.code, ReasonCode::kStartingUp);
  EXPECT_EQ(slave->ahead_rad, JointVector(0, 0, 1));
  EXPECT_EQ(slave->tip_force_N, PlanarVector(2, -1));
  EXPECT_EQ(slave->load_N, PlanarVector(0, -2));
  EXPECT_EQ(slave->contact_compliance, 1);
  EXPECT_TRUE(slave->contact);
}

TEST(LinkMessages, TruncatedLongerOrForeignDatagramsAreRefused) {
  for (const std::string& text : {kMaster, kSlave}) {
    auto good = test::hex(text);
    for (std::size_t size = 0; size < good.size(); ++size) {
      EXPECT_FALSE(decode_master(std::span(good).first(size)));
      EXPECT_FALSE(decode_slave(std::span(good).first(size)));
    }
    for (std::size_t header = 0; header < 4; ++header) {
      auto foreign = good;
      foreign[header] ^= 0x40;
      EXPECT_FALSE(decode_master(foreign));
      EXPECT_FALSE(decode_slave(foreign));
    }
    good.push_back(0);
    EXPECT_FALSE(decode_master(good));
    EXPECT_FALSE(decode_slave(good));
  }
  EXPECT_FALSE(decode_slave(test::hex(kMaster)));
  EXPECT_FALSE(decode_master(test::hex(kSlave)));
}

TEST(LinkMessages, TellTheirKindInTheHeader) {
  EXPECT_EQ(link_kind(encode(MasterMessage{}).view()), LinkKind::kMaster);
  EXPECT_EQ(link_kind(encode(SlaveMessage{}).view()), LinkKind::kSlave);
  EXPECT_EQ(link_kind(encode(MachineStatus{}).view()), LinkKind::kStatus);
  for (std::size_t byte = 0; byte < 3; ++byte) {
    Datagram foreign = encode(SlaveMessage{});
    foreign.bytes[byte] ^= 0x40;
    EXPECT_FALSE(link_kind(foreign.view())) << byte;
  }
  EXPECT_FALSE(link_kind(encode(SlaveMessage{}).view().first(3)));
  EXPECT_FALSE(link_kind({}));
}

TEST(LinkMessages, UnknownModesReasonsAndFlagsAreRefused) {
  const auto with = [](const std::string& text, std::size_t byte, std::uint8_t value) {
    auto changed = test::hex(text);
    changed.at(byte) = value;
    return changed;
  };
  EXPECT_FALSE(decode_master(with(kMaster, 56, 0x55))) << "unknown flag";
  EXPECT_FALSE(decode_master(with(kMaster, 58, 0x10))) << "unknown reason";
  EXPECT_FALSE(decode_slave(with(kSlave, 48, 8))) << "unknown mode";
  EXPECT_FALSE(decode_slave(with(kSlave, 50, 0x10))) << "unknown reason";
  EXPECT_FALSE(decode_slave(with(kSlave, 215, 2))) << "contact is neither yes nor no";
  EXPECT_FALSE(decode_slave(with(kSlave, 217, 4))) << "unknown limit";
}

TEST(LinkMessages, ANonFiniteNumberAnywhereIsRefused) {
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  const auto put = [](const std::string& text, std::size_t at, double value) {
    auto changed = test::hex(text);
    std::memcpy(changed.data() + at, &value, sizeof value);
    return changed;
  };
  for (const double value : bad) {
    for (std::size_t at = 68; at + 8 <= 132; at += 8) EXPECT_FALSE(decode_master(put(kMaster, at, value))) << at;
    auto single = test::hex(kMaster);
    const auto narrow = static_cast<float>(value);
    std::memcpy(single.data() + 132, &narrow, sizeof narrow);
    EXPECT_FALSE(decode_master(single)) << "force limit";
    EXPECT_FALSE(decode_master(put(kMaster, 136, value))) << "energy";
    for (std::size_t at = 71; at + 8 <= 215; at += 8) EXPECT_FALSE(decode_slave(put(kSlave, at, value))) << at;
    for (std::size_t at = 218; at + 8 <= test::hex(kSlave).size(); at += 8) {
      EXPECT_FALSE(decode_slave(put(kSlave, at, value))) << at;
    }
  }
}

TEST(LinkMessages, NumbersBeyondAnythingHonestAreRefused) {
  const auto master = [](auto change) {
    MasterMessage m = some_master();
    change(m);
    return decode_master(encode(m).view()).has_value();
  };
  const auto slave = [](auto change) {
    SlaveMessage m = some_slave();
    change(m);
    return decode_slave(encode(m).view()).has_value();
  };
  EXPECT_TRUE(slave([](SlaveMessage& m) { m.sensor_at = kNever; })) << "nothing measured yet";
  for (const Time wild : {Time(Duration::max()), Time(Duration::min())}) {
    EXPECT_FALSE(master([&](MasterMessage& m) { m.stamp.sent_at = wild; }));
    EXPECT_FALSE(master([&](MasterMessage& m) { m.stamp.echoed = wild; }));
    EXPECT_FALSE(master([&](MasterMessage& m) { m.device_report_at = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.stamp.sent_at = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.stamp.echoed = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.sensor_at = wild; }));
  }
  for (const double wild : {1e308, -1e308}) {
    EXPECT_FALSE(master([&](MasterMessage& m) { m.position_rad[kArm] = wild; }));
    EXPECT_FALSE(master([&](MasterMessage& m) { m.velocity_radps[kArm] = wild; }));
    EXPECT_FALSE(master([&](MasterMessage& m) { m.assist.force_limit_N = wild; }));
    EXPECT_FALSE(master([&](MasterMessage& m) { m.energy_in_J = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.position_rad[kBoom] = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.velocity_radps[kBucket] = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.ahead_rad[kBoom] = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.confidence = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.contact_compliance = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.pressure_Pa[5] = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.payload_kg = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.payload_sigma_kg = wild; }));
    EXPECT_FALSE(slave([&](SlaveMessage& m) { m.energy_in_J = wild; }));
  }
  EXPECT_FALSE(slave([](SlaveMessage& m) { m.confidence = 1.01; }));
  EXPECT_FALSE(slave([](SlaveMessage& m) { m.contact_compliance = -0.01; }));
  for (const std::size_t at : {143U, 151U, 159U, 167U, 175U, 183U, 191U}) {  // force, load and covariance
    auto wild = test::hex(kSlave);
    const double value = 1e308;
    std::memcpy(wild.data() + at, &value, sizeof value);
    EXPECT_FALSE(decode_slave(wild)) << at;
  }
}

TEST(LinkMessages, AnEstimateWithoutBoundDoesNotCostTheMessage) {
  SlaveMessage message = some_slave();
  message.tip_force_N = message.load_N = {1e200, -1e200};
  message.covariance_N2 = {1e300, -1e300, 1e300};
  const auto back = decode_slave(encode(message).view());
  ASSERT_TRUE(back);
  EXPECT_GE(back->tip_force_N.x(), 1e7);
  EXPECT_GE(back->covariance_N2[2], 1e14);
}

TEST(LinkMessages, AReasonAboutNanStillArrives) {
  SlaveMessage message = some_slave();
  message.fault = {ReasonCode::kSensorInvalid, 0x20, std::numeric_limits<float>::quiet_NaN(), 1};
  const auto back = decode_slave(encode(message).view());
  ASSERT_TRUE(back);
  EXPECT_EQ(back->fault.code, ReasonCode::kSensorInvalid);
  EXPECT_TRUE(std::isfinite(back->fault.value));
}

TEST(LinkMessages, RandomValuesSurviveTheRoundTripAndRandomBytesNeverBreakTheDecoders) {
  std::mt19937_64 random(5);
  std::normal_distribution<> normal(0, 1);
  for (int i = 0; i < 2000; ++i) {
    MasterMessage master = some_master();
    master.stamp = {random(), random(), static_cast<std::uint32_t>(random()),
                    Time(Duration(static_cast<std::int64_t>(random() >> 8))), Time(2ns)};
    master.stops = static_cast<std::uint32_t>(random());
    master.releases = static_cast<std::uint32_t>(random());
    for (double& value : master.position_rad) value = normal(random);
    const auto back = decode_master(encode(master).view());
    ASSERT_TRUE(back);
    ASSERT_EQ(back->position_rad, master.position_rad);
    ASSERT_EQ(back->stamp.session, master.stamp.session);
    ASSERT_EQ(back->stamp.echoed_session, master.stamp.echoed_session);
    ASSERT_EQ(back->stamp.sent_at, master.stamp.sent_at);
    ASSERT_EQ(back->stamp.sequence, master.stamp.sequence);
    ASSERT_EQ(back->stops, master.stops);
    ASSERT_EQ(back->releases, master.releases);
    auto noise = test::hex(i % 2 == 0 ? kMaster : kSlave);
    for (int n = 0; n < 4; ++n) noise[4 + random() % (noise.size() - 4)] = static_cast<std::uint8_t>(random());
    const auto read = decode_slave(noise);
    ASSERT_TRUE(!read || (read->position_rad.allFinite() && read->mode <= Mode::kEStop));
  }
}

TEST(LinkMessages, EveryModeHasAName) {
  EXPECT_STREQ(name(Mode::kOff), "off");
  EXPECT_STREQ(name(Mode::kSelfTest), "self_test");
  EXPECT_STREQ(name(Mode::kEStop), "e_stop");
}

TEST(LinkMessages, TheFuzzersSeedsAreOfThisVersion) {
  const auto seed = [](const std::string& name) {
    std::ifstream in(test::source_dir() + "/tests/fuzz/corpus/link_messages/" + name, std::ios::binary);
    return std::vector<std::uint8_t>{std::istreambuf_iterator<char>(in), {}};
  };
  EXPECT_TRUE(decode_master(seed("master")));
  EXPECT_TRUE(decode_slave(seed("slave")));
  EXPECT_TRUE(decode_status(seed("status")));
}

}  // namespace
}  // namespace knuckle
