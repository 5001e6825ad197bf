#include "transport/machine_status.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/transport/hex.h"
#include "transport/link_messages.h"

namespace knuckle {
namespace {

std::vector<std::uint8_t> bytes(const Datagram& datagram) {
  return {datagram.view().begin(), datagram.view().end()};
}

MachineStatus some_status() {
  MachineStatus s;
  s.stamp = {9, 0x0807060504030201, 0x01020304, Time(1ms), Time(2ns)};
  s.valve_command = {1, -1, 0.5};
  s.spool = {0, 2, 0};
  s.pilot_on = true;
  s.oil_flow_m3ps = 0.5;
  s.hydraulic_power_W = 10;
  s.wake_lateness = {1ns, 2ns, 3ns};
  s.execution = {4ns, 5ns, 6ns};
  s.period = 5ms;
  s.steps = 7;
  s.overruns = 8;
  s.fifo_priority = 80;
  s.bus_load = 0.5;
  s.can_errors = 9;
  s.acted_report_at = Time(-1ns);
  s.acted_ago = 11ns;
  s.force_doubts = 0x85;
  s.machine = MachineName("solar015");
  return s;
}

const std::string kStatus =
    "4B4E 08 03  0900000000000000 0102030405060708 04030201 40420F0000000000 0200000000000000  "
    "000000000000F03F 000000000000F0BF 000000000000E03F  0000000000000000 0000000000000040 0000000000000000  01 "
    "000000000000E03F 0000000000002440 "
    "0100000000000000 0200000000000000 0300000000000000  0400000000000000 0500000000000000 0600000000000000 "
    "404B4C0000000000  0700000000000000 0800000000000000  50  000000000000E03F  09000000 "
    "FFFFFFFFFFFFFFFF 0B00000000000000  85 "
    "736F6C6172303135 0000000000000000 0000000000000000 0000000000000000";
// Where in it what is.
constexpr std::size_t kSentAt = 24, kEchoed = 32, kCommand = 40, kFlags = 88, kFlow = 89, kWake = 105, kPeriod = 153,
                      kPriority = 177, kLoad = 178, kReport = 190, kAgo = 198, kName = 207;

template <typename T>
std::vector<std::uint8_t> with(std::size_t at, T value) {
  auto changed = test::hex(kStatus);
  std::memcpy(changed.data() + at, &value, sizeof value);
  return changed;
}

TEST(MachineStatus, HasTheBytesOfTheDesign) {
  EXPECT_EQ(bytes(encode(some_status())), test::hex(kStatus));
}

TEST(MachineStatus, DecodesTheSameBytes) {
  const auto status = decode_status(test::hex(kStatus));
  ASSERT_TRUE(status);
  EXPECT_EQ(bytes(encode(*status)), test::hex(kStatus));
  EXPECT_EQ(status->stamp.sequence, 0x01020304U);
  EXPECT_EQ(status->stamp.sent_at, Time(1ms));
  EXPECT_EQ(status->valve_command, JointVector(1, -1, 0.5));
  EXPECT_EQ(status->spool, JointVector(0, 2, 0));
  EXPECT_TRUE(status->pilot_on);
  EXPECT_EQ(status->oil_flow_m3ps, 0.5);
  EXPECT_EQ(status->hydraulic_power_W, 10);
  EXPECT_EQ(status->wake_lateness.p99, 2ns);
  EXPECT_EQ(status->execution.max, 6ns);
  EXPECT_EQ(status->period, 5ms);
  EXPECT_EQ(status->steps, 7U);
  EXPECT_EQ(status->overruns, 8U);
  EXPECT_EQ(status->fifo_priority, 80);
  EXPECT_EQ(status->bus_load, 0.5);
  EXPECT_EQ(status->can_errors, 9U);
  EXPECT_EQ(status->acted_report_at, Time(-1ns));
  EXPECT_EQ(status->acted_ago, 11ns);
  EXPECT_EQ(status->force_doubts, 0x85);
  EXPECT_EQ(status->machine.text(), "solar015");
}

TEST(MachineStatus, CutsALongNameAndSendsNothingUnprintable) {
  const std::string longest(31, 'm'), longer = longest + "ore";
  MachineStatus status = some_status();
  for (const auto& [name, travels] : {std::pair<std::string, std::string>{"", ""},
                                      {longest, longest},
                                      {longer, longest},
                                      {"b\xC3\xA4r\n", "b??r?"}}) {
    status.machine = MachineName(name);
    const auto back = decode_status(encode(status).view());
    ASSERT_TRUE(back) << name;
    EXPECT_EQ(back->machine.text(), travels);
    EXPECT_TRUE(back->machine == MachineName(name)) << "both sides cut alike";
  }
}

TEST(MachineStatus, ANameWithoutEndOrNotPrintableIsRefused) {
  EXPECT_FALSE(decode_status(with(kName, std::uint8_t{'\n'})));
  EXPECT_FALSE(decode_status(with(kName, std::uint8_t{0x80})));
  EXPECT_FALSE(decode_status(with(kName + 20, std::uint8_t{'x'}))) << "behind its end";
  std::array<char, MachineName::kSize> endless{};
  endless.fill('x');
  EXPECT_FALSE(decode_status(with(kName, endless)));
}

TEST(MachineStatus, TruncatedLongerOrForeignDatagramsAreRefused) {
  auto good = test::hex(kStatus);
  for (std::size_t size = 0; size < good.size(); ++size) EXPECT_FALSE(decode_status(std::span(good).first(size)));
  for (std::size_t header = 0; header < 4; ++header) {
    auto foreign = good;
    foreign[header] ^= 0x40;
    EXPECT_FALSE(decode_status(foreign));
  }
  EXPECT_FALSE(decode_master(good));
  EXPECT_FALSE(decode_slave(good));
  EXPECT_FALSE(decode_status(encode(MasterMessage{}).view()));
  EXPECT_FALSE(decode_status(encode(SlaveMessage{}).view()));
  good.push_back(0);
  EXPECT_FALSE(decode_status(good));
}

TEST(MachineStatus, ANonFiniteOrImpossibleNumberAnywhereIsRefused) {
  std::vector<std::size_t> numbers{kFlow, kFlow + 8, kLoad};
  for (std::size_t n = 0; n < 6; ++n) numbers.push_back(kCommand + 8 * n);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity(), 1e300, -1e300}) {
    for (const std::size_t at : numbers) EXPECT_FALSE(decode_status(with(at, bad))) << at << " " << bad;
  }
  EXPECT_FALSE(decode_status(with(kFlow, -1.0))) << "nothing flows back into the pump";
  EXPECT_FALSE(decode_status(with(kLoad, -0.1)));
  EXPECT_FALSE(decode_status(with(kFlags, std::uint8_t{8})));
  EXPECT_FALSE(decode_status(with(kPriority, std::uint8_t{100})));
  std::vector<std::size_t> spans{kPeriod, kAgo};
  for (std::size_t n = 0; n < 6; ++n) spans.push_back(kWake + 8 * n);
  for (const std::size_t at : spans) {
    EXPECT_FALSE(decode_status(with(at, std::int64_t{-1}))) << at;
    EXPECT_FALSE(decode_status(with(at, std::numeric_limits<std::int64_t>::max()))) << at;
  }
  for (const std::size_t at : {kSentAt, kEchoed, kReport}) {
    EXPECT_FALSE(decode_status(with(at, std::numeric_limits<std::int64_t>::min()))) << at;
    EXPECT_FALSE(decode_status(with(at, std::numeric_limits<std::int64_t>::max()))) << at;
  }
}

TEST(MachineStatus, AnEstimateWithoutBoundDoesNotCostTheMessage) {
  MachineStatus status = some_status();
  status.oil_flow_m3ps = 1e200;
  status.hydraulic_power_W = -1e200;
  status.spool[kArm] = -1e200;
  const auto back = decode_status(encode(status).view());
  ASSERT_TRUE(back);
  EXPECT_GE(back->oil_flow_m3ps, 10);
  EXPECT_EQ(back->hydraulic_power_W, 0);
  EXPECT_LE(back->spool[kArm], -10);
}

TEST(MachineStatus, RandomValuesSurviveTheRoundTripAndRandomBytesNeverBreakTheDecoder) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<> unit(-1, 1);
  const auto span = [&random] { return Duration(static_cast<std::int64_t>(random() >> 8)); };
  int accepted = 0;
  for (int i = 0; i < 2000; ++i) {
    MachineStatus s;
    s.stamp = {random(), random(), static_cast<std::uint32_t>(random()), Time(span()), Time(span())};
    for (double& value : s.valve_command) value = unit(random);
    for (double& value : s.spool) value = unit(random);
    s.pilot_on = i % 2 == 0;
    s.simulated = i % 3 == 0;
    s.calibrated = i % 5 == 0;
    s.oil_flow_m3ps = std::abs(unit(random));
    s.hydraulic_power_W = 1e5 * std::abs(unit(random));
    s.wake_lateness = {span(), span(), span()};
    s.execution = {span(), span(), span()};
    s.period = span();
    s.steps = random();
    s.overruns = random();
    s.fifo_priority = static_cast<std::uint8_t>(random() % 100);
    s.bus_load = std::abs(unit(random));
    s.can_errors = static_cast<std::uint32_t>(random());
    s.acted_report_at = i % 3 == 0 ? kNever : Time(span());
    s.acted_ago = span();
    s.force_doubts = static_cast<std::uint8_t>(random());
    s.machine = MachineName(std::to_string(random()));
    const Datagram sent = encode(s);
    const auto back = decode_status(sent.view());
    ASSERT_TRUE(back);
    ASSERT_EQ(bytes(encode(*back)), bytes(sent));
    ASSERT_EQ(back->spool, s.spool);
    ASSERT_EQ(back->steps, s.steps);
    ASSERT_EQ(back->acted_report_at, s.acted_report_at);
    ASSERT_EQ(back->acted_ago, s.acted_ago);
    ASSERT_EQ(back->force_doubts, s.force_doubts);
    auto noise = test::hex(kStatus);
    for (int n = 0; n < 4; ++n) noise[4 + random() % (kName - 4)] = static_cast<std::uint8_t>(random());
    const auto read = decode_status(noise);
    accepted += read ? 1 : 0;
    ASSERT_TRUE(!read || (read->spool.allFinite() && std::isfinite(read->bus_load) && read->period >= 0ns));
  }
  EXPECT_GT(accepted, 100) << "the noise was not refused for its header alone";
}

}  // namespace
}  // namespace knuckle
