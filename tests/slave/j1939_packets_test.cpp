// Messages of several packets on the machine's bus: whose they are, what is lost of them, and what people read by them.
#include "transport/j1939_packets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "slave/bus_map.h"
#include "slave/j1939_bus.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/no_alloc.h"
#include "tests/support/two_buses.h"
#include "transport/machine_readings.h"

namespace knuckle::slave {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::uint32_t kGroup = 0x1FF60, kForeignGroup = 0xFEEC;

std::vector<CanFrame> parts(std::uint8_t source, const Bytes& message, std::uint32_t group = kGroup) {
  std::vector<CanFrame> all{j1939::announcement_frame(group, source, message.size())};
  for (unsigned i = 1; i <= j1939::packets_of(static_cast<unsigned>(message.size())); ++i)
    all.push_back(j1939::packet_frame(source, static_cast<std::uint8_t>(i), message));
  return all;
}

struct HeardPackets {
  explicit HeardPackets(const std::string& from = "", const std::string& to = "")
      : machine(parse_machine(test::packets_text(from, to), "m.toml")) {}
  /// @return the message that is complete by it
  Bytes hears(const CanFrame& frame, std::uint32_t bus = 0) {
    CanFrame copy = frame;
    copy.id |= bus;
    EXPECT_FALSE(j1939.receive(copy, now)) << "a part has no values";
    const auto whole = j1939.message();
    if (!whole) return {};
    id = whole->id;
    return {whole->data.begin(), whole->data.end()};
  }
  Bytes hears(const std::vector<CanFrame>& frames) {
    Bytes last;
    for (const CanFrame& frame : frames) {
      last = hears(frame);
      now += 50ms;
    }
    return last;
  }
  MachineDescription machine;
  J1939Bus j1939{machine.bus};
  Time now{100s};
  std::uint32_t id = 0;
};

TEST(J1939PacketsOfABus, AreOfTheBusTheyCameFrom) {
  HeardPackets bus;
  const std::vector<CanFrame> frames = parts(0x21, Bytes(20, 7));
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) (void)bus.hears(frames[i]);
  EXPECT_TRUE(bus.hears(frames.back(), kSecondBus).empty());
  EXPECT_EQ(bus.hears(frames.back()), Bytes(20, 7));
}

/// Keeps all packets, and looks whether they are all there once the last one is.
struct Reference {
  std::uint32_t group = 0;
  std::size_t bytes = 0;
  Bytes all;
  unsigned packets = 0;
  Time newest{};
  /// @return the message that is complete by this frame
  Bytes hear(const CanFrame& heard, Time now) {
    if ((heard.id & 0xFF0000U) == 0xEC0000U) {
      group = heard.data[5] + 256U * heard.data[6] + 65536U * heard.data[7];
      bytes = heard.data[1] + 256U * heard.data[2];
      all.clear();
      packets = 0;
      newest = now;
      return {};
    }
    if (heard.data[0] != packets + 1 || now - newest > 750ms) bytes = 0;
    if (bytes == 0) return {};
    ++packets;
    newest = now;
    all.insert(all.end(), heard.data.begin() + 1, heard.data.end());
    if (all.size() < bytes) return {};
    all.resize(bytes);
    bytes = 0;
    return group == kGroup ? all : Bytes();
  }
};

/// Seeded: two devices send at will, and other groups between; some packets are lost, come twice or too late.
TEST(J1939PacketsOfABus, OfTwoSendersDoNotMixInAnyOrder) {
  std::mt19937 random(1939);
  const auto drawn = [&](unsigned most) { return static_cast<unsigned>(random() % (most + 1)); };
  // The second sender is a frame of its own.
  HeardPackets bus("name = \"coolant\"\npgn = 0x1FF60", "name = \"coolant\"\npgn = 0x1FF60\nsource = 0x21");
  bus.machine.bus.broadcasts.push_back(*bus.machine.bus.broadcast(NodeRole::kReading, 3).frame);
  bus.machine.bus.broadcasts.back().source = 0x22;
  bus.machine.bus.broadcasts.back().id += 1;
  bus.j1939 = J1939Bus(bus.machine.bus);
  std::map<std::uint8_t, std::deque<CanFrame>> waiting;
  std::map<std::uint8_t, Reference> references;
  int whole = 0;
  for (int i = 0; i < 60000; ++i) {
    const auto source = static_cast<std::uint8_t>(0x21 + drawn(1));
    auto& queue = waiting[source];
    if (queue.empty()) {
      Bytes message(9 + drawn(drawn(9) == 0 ? 246 : 40));
      for (std::uint8_t& byte : message) byte = static_cast<std::uint8_t>(random());
      for (const CanFrame& part : parts(source, message, drawn(4) == 0 ? kForeignGroup : kGroup)) {
        if (part.data[0] != 32 && drawn(40) == 0) continue;
        queue.push_back(part);
        if (drawn(60) == 0) queue.push_back(part);
        if (drawn(60) == 0) break;
      }
    }
    bus.now += std::chrono::milliseconds(drawn(200) == 0 ? 740 + drawn(20) : drawn(100));
    const CanFrame heard = queue.front();
    queue.pop_front();
    const Bytes want = references[source].hear(heard, bus.now);
    ASSERT_EQ(bus.hears(heard), want) << i;
    if (want.empty()) continue;
    ++whole;
    ASSERT_EQ(j1939::source_of(bus.id), source);
  }
  EXPECT_GT(whole, 2000) << "else nothing was tried";
}

TEST(J1939PacketsOfABus, OfAnyBytesTakeNoMemoryAndDoNoHarm) {
  std::mt19937 random(21);
  HeardPackets bus;
  const test::NoAllocScope scope;
  for (int i = 0; i < 200000; ++i) {
    const std::uint32_t group = random() % 2 == 0 ? j1939::kConnection : j1939::kTransfer;
    CanFrame frame{.id = j1939::identifier(group, static_cast<std::uint8_t>(0x21 + random() % 2)),
                   .size = static_cast<std::uint8_t>(random() % 20 == 0 ? random() % 256 : 8),
                   .data = {}};
    for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random());
    if (random() % 2 == 0) frame.data[0] = group == j1939::kConnection ? 32 : static_cast<std::uint8_t>(random() % 4);
    if (random() % 2 == 0) frame.data = {32, 20, 0, 3, 0xFF, 0x60, 0xFF, 1};
    (void)bus.j1939.receive(frame, bus.now);
    const auto message = bus.j1939.message();
    EXPECT_TRUE(!message || (message->data.size() >= 9 && message->data.size() <= 255));
    bus.now += 10ms;
  }
  EXPECT_EQ(scope.allocations(), 0U);
}

TEST(J1939PacketsOfABus, PassTheFiltersAndCountForTheLoad) {
  const BusDescription bus = parse_machine(test::packets_text(), "m.toml").bus;
  const std::vector<CanFilter> filters = heard_by_controller(bus);
  for (const std::uint32_t id : {0x1CECFF00U, 0x1CEBFF21U, 0x18EBFF21U})
    EXPECT_TRUE(hears(filters, id | kExtendedId)) << std::hex << id;
  EXPECT_FALSE(hears(filters, 0x1CEBF921U | kExtendedId)) << "for one alone";
  EXPECT_FALSE(hears(heard_by_controller(test::j1939_machine().bus), 0x1CEBFF21U | kExtendedId));
  double packets_Hz = 0;
  for (const PeriodicFrame& frame : bus_map(bus))
    if (frame.id == (0x18EBFF00U | kExtendedId) || frame.id == (0x18EBFFFEU | kExtendedId)) packets_Hz += frame.rate_Hz;
  EXPECT_NEAR(packets_Hz, 3 + 0.2, 1e-9) << "three a second, and two each ten seconds";
}

struct PacketMachine : test::BenchMachine {
  explicit PacketMachine(const std::string& text) : BenchMachine(parse_machine(text, "m.toml")) {}
  [[nodiscard]] MachineReadings readings() const { return loop.sensors().readings(now); }
};

TEST(J1939PacketsOfABus, AreReadFromWireToWire) {
  for (const bool two : {false, true}) {
    PacketMachine m(two ? test::on_two_buses(test::packets_text()) : test::packets_text());
    ASSERT_TRUE(m.engage());
    m.run(2s);
    EXPECT_EQ(m.readings().coolant_temperature_degC, 84) << two;
    EXPECT_NEAR(m.readings().fuel_level, 0.62, 0.003) << two;
    EXPECT_NEAR(m.readings().engine_time_s, 4321 * 3600, 90) << "asked for, from everybody";
    EXPECT_EQ(m.readings().oil_temperature_degC, 48) << "single frames, too";
    EXPECT_EQ(m.loop.j1939().news_count(), 0U);
    EXPECT_EQ(m.loop.mode(), Mode::kEngaged);
    const std::uint32_t bus = two ? kSecondBus : 0;
    EXPECT_EQ(m.frames(0x18EAFFF9U | kExtendedId | bus).size(), 2U) << "for addresses, and for the hours";
    EXPECT_TRUE(m.frames(0x18EA00F9U | kExtendedId | bus).empty());
  }
}

TEST(J1939PacketsOfABus, ThatAreLostMakeTheReadingUnknownByItsAgeUntilTheyComeAgain) {
  PacketMachine m(test::packets_text());
  ASSERT_TRUE(m.engage());
  m.run(2s);
  ASSERT_EQ(m.readings().coolant_temperature_degC, 84);
  m.nodes.lose_packet(2);
  m.run(2s);
  EXPECT_EQ(m.loop.j1939().news_count(), 1U);
  EXPECT_EQ(m.loop.j1939().news(0).what, J1939News::What::kPacketLost);
  EXPECT_EQ(m.loop.j1939().news(0).packet, 2);
  EXPECT_EQ(m.readings().coolant_temperature_degC, 84) << "two seconds old";
  m.run(3s);
  EXPECT_TRUE(std::isnan(m.readings().coolant_temperature_degC));
  EXPECT_EQ(m.loop.j1939().news_count(), 1U) << "once";
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << "people are told";
  m.nodes.lose_packet(0);
  m.run(2s);
  EXPECT_EQ(m.readings().coolant_temperature_degC, 84);
}

}  // namespace
}  // namespace knuckle::slave
