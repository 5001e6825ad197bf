#include "transport/link_messages.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/fields.h"
#include "tests/support/places.h"
#include "tests/transport/hex.h"
#include "transport/link_header.h"
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
  return m;
}

const std::string kMaster =
    "4B4E 0B 01  0102030405060708 0900000000000000 04030201  40420F0000000000 0200000000000000  "
    "FFFFFFFFFFFFFFFF 03000000 04030201  35  0200 07 0000803F 000000C0 "
    "000000000000F03F 0000000000000040 000000000000F0BF  0000000000000000 000000000000E03F 0000000000000000 "
    "00000000000000C0 000000000000F03F  "
    "0080BB44";

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
  m.contact = m.home_on_two = true;
  m.limits = kLimitPressure | kLimitPumpFlow | kLimitAssistForce;
  m.pressure_Pa = {1, 2, 4, 10, 0.5, 0};
  m.payload_kg = 10;
  m.payload_sigma_kg = 0.5;
  m.tip_torque_Nm = -1;
  m.tip_torque_sigma_Nm = 2;
  m.force_torque_covariance_N2m = {4, -2};
  m.touched_share = {0.5, 0, 0, 0, 0, 0.5};
  m.unknown_torques = 1;
  return m;
}

const std::string kZero = "0000000000000000 ", kHalf = "000000000000E03F ", kOne = "000000000000F03F ",
                  kTwo = "0000000000000040 ", kFour = "0000000000001040 ", kTen = "0000000000002440 ",
                  kMinusOne = "000000000000F0BF ", kMinusTwo = "00000000000000C0 ";
const std::string kSlave =
    "4B4E 0B 02  0900000000000000 0102030405060708 01000000 0100000000000000 0200000000000000  "
    "0300000000000000 "
    "06  0200 00 00000000 00000000  0100 09 0000803F 00000040 " +
    kOne + kZero + kZero + kZero + kOne + kZero + kZero + kZero + kOne + kTwo + kMinusOne + kZero + kMinusTwo + kFour +
    kZero + kTen + kHalf + kOne + "05 5001 " + kOne + kTwo + kFour + kTen + kHalf + kZero + kTen + kHalf + kMinusOne +
    kTwo + kFour + kMinusTwo + kHalf + kZero + kZero + kZero + kZero + kHalf + "01";

HomeMessage some_home() {
  return {{0x0807060504030201, 9, 0x01020304, Time(1ms), Time(2ns)}, 4};
}

const std::string kHome =
    "4B4E 0B 04  0102030405060708 0900000000000000 04030201  40420F0000000000 0200000000000000  "
    "04";

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
  s.buses = {{{0.5, CanState::kPassive}, {0.25, CanState::kBusOff}}};
  s.can_errors = 9;
  s.acted_report_at = Time(-1ns);
  s.acted_ago = 11ns;
  s.force_doubts = 0x285;
  s.machine = MachineName("solar015");
  return s;
}

const std::string kStatus =
    "4B4E 0B 03  0900000000000000 0102030405060708 04030201 40420F0000000000 0200000000000000  "
    "000000000000F03F 000000000000F0BF 000000000000E03F  0000000000000000 0000000000000040 0000000000000000  01 "
    "000000000000E03F 0000000000002440 "
    "0100000000000000 0200000000000000 0300000000000000  0400000000000000 0500000000000000 0600000000000000 "
    "404B4C0000000000  0700000000000000 0800000000000000  50  000000000000E03F 01 000000000000D03F 02  09000000 "
    "FFFFFFFFFFFFFFFF 0B00000000000000  8502 "
    "736F6C6172303135 0000000000000000 0000000000000000 0000000000000000";
constexpr std::size_t kNameAt = 218;

template <typename Message>
std::optional<Message> decoded(std::span<const std::uint8_t> bytes) {
  if constexpr (std::is_same_v<Message, MasterMessage>) return decode_master(bytes);
  if constexpr (std::is_same_v<Message, SlaveMessage>) return decode_slave(bytes);
  if constexpr (std::is_same_v<Message, MachineStatus>) return decode_status(bytes);
  if constexpr (std::is_same_v<Message, HomeMessage>) return decode_home(bytes);
}

/// check(message, its bytes as they are in the design) for one of each kind.
template <typename Check>
void for_each_kind(const Check& check) {
  check(some_master(), test::hex(kMaster));
  check(some_slave(), test::hex(kSlave));
  check(some_status(), test::hex(kStatus));
  check(some_home(), test::hex(kHome));
}

/// take(name, field, how it travels) for each, those of structs within in their place.
template <typename Struct, typename Take>
void for_each_field(Struct& all, const Take& take) {
  visit_fields(all, [&take](const char* name, auto& field, auto... how) {
    if constexpr (requires { visit_fields(field, [](const char*, const auto&, auto...) {}); }) {
      for_each_field(field, take);
    } else {
      take(std::string(name), field, how...);
    }
  });
}

/// Its fields as numbers, to compare.
template <typename Message>
std::vector<double> numbers(const Message& message) {
  std::vector<double> all;
  for_each_field(message, [&all](const std::string&, const auto& field, auto...) {
    using Field = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_same_v<Field, Duration>) {
      all.push_back(static_cast<double>(field.count()));
    } else if constexpr (ScalarField<Field>) {
      all.push_back(static_cast<double>(number_of(field)));
    } else {
      for (const auto element : field) all.push_back(static_cast<double>(element));
    }
  });
  return all;
}

TEST(LinkMessages, HaveTheBytesOfTheDesignBothWays) {
  for_each_kind([](const auto& message, const auto& design) {
    using Message = std::remove_cvref_t<decltype(message)>;
    EXPECT_EQ(bytes(encode(message)), design);
    const auto back = decoded<Message>(design);
    ASSERT_TRUE(back);
    EXPECT_EQ(numbers(*back), numbers(message));
  });
}

TEST(LinkMessages, TruncatedLongerOrForeignDatagramsAreRefused) {
  const auto refused = [](std::span<const std::uint8_t> bytes) {
    return !decode_master(bytes) && !decode_slave(bytes) && !decode_status(bytes);
  };
  const auto kind = [](std::span<const std::uint8_t> bytes) { return link_kind(bytes).has_value(); };
  for_each_kind([&](const auto&, auto good) {
    EXPECT_EQ(link_kind(good), static_cast<LinkKind>(good[3]));
    for (std::size_t size = 0; size < good.size(); ++size) EXPECT_TRUE(refused(std::span(good).first(size))) << size;
    for (std::size_t header = 0; header < 4; ++header) {
      auto foreign = good;
      foreign[header] ^= 0x40;
      EXPECT_TRUE(refused(foreign)) << header;
      EXPECT_TRUE(header == 3 || !kind(foreign)) << header;
    }
    EXPECT_FALSE(kind(std::span(good).first(3)));
    EXPECT_EQ(decode_master(good).has_value() + decode_slave(good).has_value() + decode_status(good).has_value() +
                  decode_home(good).has_value(),
              1);
    good.push_back(0);
    EXPECT_TRUE(refused(good));
  });
}

/// As in the design but for a few bytes.
template <typename T>
std::vector<std::uint8_t> with(const std::string& text, std::size_t at, T value) {
  auto changed = test::hex(text);
  std::memcpy(changed.data() + at, &value, sizeof value);
  return changed;
}

TEST(LinkMessages, UnknownModesReasonsAndFlagsAreRefused) {
  using Byte = std::uint8_t;
  EXPECT_FALSE(decode_master(with(kMaster, 56, Byte{0x55}))) << "unknown flag";
  EXPECT_FALSE(decode_master(with(kMaster, 58, Byte{0x10}))) << "unknown reason";
  EXPECT_FALSE(decode_slave(with(kSlave, 48, Byte{8}))) << "unknown mode";
  EXPECT_FALSE(decode_slave(with(kSlave, 50, Byte{0x10}))) << "unknown reason";
  EXPECT_FALSE(decode_slave(with(kSlave, 215, Byte{8}))) << "contact is neither yes nor no";
  EXPECT_FALSE(decode_slave(with(kSlave, 217, Byte{8}))) << "unknown limit";
  EXPECT_FALSE(decode_home(with(kHome, 40, Byte{8}))) << "unknown cylinder";
  EXPECT_FALSE(decode_status(with(kStatus, 88, Byte{8}))) << "unknown flag";
  EXPECT_FALSE(decode_status(with(kStatus, 186, Byte{4}))) << "unknown state of a bus";
}

/// Values of a field that must cost the message, as its sender would send them.
std::vector<double> refused_numbers(wire::Within bounds) {
  const double beyond = std::numeric_limits<double>::infinity(), step = 1e-6;
  return {std::numeric_limits<double>::quiet_NaN(), beyond, -beyond, bounds.max * (1 + step) + step,
          bounds.min * (1 + step) - step};
}
std::vector<double> refused_numbers(wire::Single bounds) {
  return refused_numbers(wire::Within{bounds.min, bounds.max});
}
std::vector<double> refused_numbers(wire::Cut /*its sender cuts others*/) {
  return {std::numeric_limits<double>::quiet_NaN()};
}

/// Each message in which one field, or one element of it, has such a value.
template <typename Message, typename Check>
void for_each_spoiled(const Message& good, const Check& check) {
  int fields = 0;
  for_each_field(good, [&fields](const auto&...) { ++fields; });
  for (int spoiled = 0; spoiled < fields; ++spoiled) {
    Message message = good;
    int at = 0;
    for_each_field(message, [&](const std::string& name, auto& field, auto... how) {
      using Field = std::remove_cvref_t<decltype(field)>;
      if (at++ != spoiled) return;
      const auto each = [&](auto& place, const auto& values) {
        const auto kept = place;
        for (const auto value : values) {
          place = value;
          check(name, message);
        }
        place = kept;
      };
      if constexpr (std::is_same_v<Field, Time>) {
        each(field, std::array{Time(Duration::max()), Time(Duration::min())});
      } else if constexpr (std::is_same_v<Field, Duration>) {
        each(field, std::array{Duration::max(), Duration(-1)});
      } else if constexpr (std::is_same_v<Field, double>) {
        each(field, refused_numbers(how...));
      } else if constexpr (VectorField<Field> && sizeof...(how) == 1 && !std::is_same_v<Field, std::array<char, 32>>) {
        for (double& element : field) each(element, refused_numbers(how...));
      }
    });
  }
}

TEST(LinkMessages, ANonFiniteNumberOrOneBeyondAnythingHonestAnywhereIsRefused) {
  for_each_kind([](const auto& good, const auto&) {
    using Message = std::remove_cvref_t<decltype(good)>;
    int spoiled = 0;
    for_each_spoiled(good, [&spoiled](const std::string& name, const Message& message) {
      ++spoiled;
      EXPECT_FALSE(decoded<Message>(encode(message).view())) << name;
    });
    EXPECT_GT(spoiled, 3);
  });
  SlaveMessage unmeasured = some_slave();
  unmeasured.sensor_at = kNever;
  EXPECT_TRUE(decode_slave(encode(unmeasured).view())) << "nothing measured yet";
}

TEST(LinkMessages, WhatTheSenderWouldHaveCutIsRefused) {
  for (const double wild : {1e308, -1e308, std::numeric_limits<double>::infinity()}) {
    for (const std::size_t rendered : {116U, 124U}) EXPECT_FALSE(decode_master(with(kMaster, rendered, wild)));
    for (std::size_t at = 143; at <= 191; at += 8)  // force, load and covariance
      EXPECT_FALSE(decode_slave(with(kSlave, at, wild))) << at;
    for (std::size_t opening = 40; opening < 88; opening += 8)
      EXPECT_FALSE(decode_status(with(kStatus, opening, wild))) << opening;
    for (const std::size_t at : {89U, 97U, 178U}) EXPECT_FALSE(decode_status(with(kStatus, at, wild))) << at;
  }
  EXPECT_FALSE(decode_status(with(kStatus, 89, -1.0))) << "nothing flows back into the pump";
  EXPECT_FALSE(decode_status(with(kStatus, 178, -0.1)));
  EXPECT_FALSE(decode_status(with(kStatus, 177, std::uint8_t{100}))) << "no such priority";
}

TEST(LinkMessages, AnEstimateWithoutBoundDoesNotCostTheMessage) {
  SlaveMessage message = some_slave();
  message.tip_force_N = message.load_N = {1e200, -1e200};
  message.covariance_N2 = {1e300, -1e300, 1e300};
  const auto back = decode_slave(encode(message).view());
  ASSERT_TRUE(back);
  EXPECT_GE(back->tip_force_N.x(), 1e7);
  EXPECT_GE(back->covariance_N2[2], 1e14);
  MachineStatus status = some_status();
  status.oil_flow_m3ps = 1e200;
  status.hydraulic_power_W = -1e200;
  status.spool[kArm] = -1e200;
  const auto told = decode_status(encode(status).view());
  ASSERT_TRUE(told);
  EXPECT_GE(told->oil_flow_m3ps, 10);
  EXPECT_EQ(told->hydraulic_power_W, 0);
  EXPECT_LE(told->spool[kArm], -10);
}

TEST(LinkMessages, AReasonAboutNanStillArrives) {
  SlaveMessage message = some_slave();
  message.fault = {ReasonCode::kSensorInvalid, 0x20, std::numeric_limits<float>::quiet_NaN(), 1};
  const auto back = decode_slave(encode(message).view());
  ASSERT_TRUE(back);
  EXPECT_EQ(back->fault.code, ReasonCode::kSensorInvalid);
  EXPECT_TRUE(std::isfinite(back->fault.value));
}

TEST(LinkMessages, AMachinesNameIsCutAndSendsNothingUnprintable) {
  const std::string longest(31, 'm'), longer = longest + "ore";
  MachineStatus status = some_status();
  for (const auto& [name, travels] : {std::pair<std::string, std::string>{"", ""},
                                      {longest, longest},
                                      {longer, longest},
                                      {"b\xC3\xA4r\n", "b??r?"}}) {
    status.machine = MachineName(name);
    const auto back = decoded<MachineStatus>(encode(status).view());
    ASSERT_TRUE(back) << name;
    EXPECT_EQ(back->machine.text(), travels);
    EXPECT_TRUE(back->machine == MachineName(name)) << "both sides cut alike";
  }
}

TEST(LinkMessages, ANameWithoutEndOrNotPrintableIsRefused) {
  EXPECT_FALSE(decoded<MachineStatus>(with(kStatus, kNameAt, std::uint8_t{'\n'})));
  EXPECT_FALSE(decoded<MachineStatus>(with(kStatus, kNameAt, std::uint8_t{0x80})));
  EXPECT_FALSE(decoded<MachineStatus>(with(kStatus, kNameAt + 20, std::uint8_t{'x'}))) << "behind its end";
  std::array<char, MachineName::kSize> endless{};
  endless.fill('x');
  EXPECT_FALSE(decoded<MachineStatus>(with(kStatus, kNameAt, endless)));
}

TEST(LinkMessages, RandomBytesAreRefusedOrReadAsWhatIsSentAsTheSameBytes) {
  std::mt19937_64 random(5);
  for_each_kind([&random](const auto& message, const auto& design) {
    using Message = std::remove_cvref_t<decltype(message)>;
    int accepted = 0;
    for (int i = 0; i < 4000; ++i) {
      auto noise = design;
      for (int n = 0; n < 4; ++n) noise[4 + random() % (noise.size() - 4)] = static_cast<std::uint8_t>(random());
      const auto read = decoded<Message>(noise);
      if (!read) continue;
      ++accepted;
      ASSERT_EQ(bytes(encode(*read)), noise);
    }
    EXPECT_GT(accepted, 100) << "the noise was not refused for its header alone";
  });
}

TEST(LinkMessages, TheFuzzersSeedsAreOfThisVersion) {
  const auto seed = [](const std::string& name) {
    std::ifstream in(test::source_dir() + "/tests/fuzz/corpus/link_messages/" + name, std::ios::binary);
    return std::vector<std::uint8_t>{std::istreambuf_iterator<char>(in), {}};
  };
  EXPECT_TRUE(decode_master(seed("master")));
  EXPECT_TRUE(decode_slave(seed("slave")));
  EXPECT_TRUE(decode_status(seed("status")));
  EXPECT_TRUE(decode_home(seed("home")));
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

}  // namespace
}  // namespace knuckle
