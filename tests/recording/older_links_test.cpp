// Recordings from before the link's messages lost energies and wave variables, and before the laws "wave" and "tdpa"
// went.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "recording/replay.h"
#include "recording/wire_events.h"
#include "tests/recording/divergence.h"
#include "tests/recording/rewrite.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/temporary_folder.h"
#include "tests/transport/hex.h"
#include "transport/link_messages.h"
#include "transport/machine_status.h"

namespace knuckle::recording {
namespace {

constexpr std::size_t kSinceVersion9 = 81;  // bytes of a report: ten numbers and a byte
constexpr std::size_t kMasterSize = 172, kImpedanceAt = kMasterSize - 28;

/// As version 7 sent them, up to the waves.
const std::string kMaster =
    "4B4E 07 01  0102030405060708 0900000000000000 04030201  40420F0000000000 0200000000000000  "
    "FFFFFFFFFFFFFFFF 03000000 04030201  35  0200 07 0000803F 000000C0 "
    "000000000000F03F 0000000000000040 000000000000F0BF  0000000000000000 000000000000E03F 0000000000000000 "
    "00000000000000C0 000000000000F03F  0080BB44 ";
const std::string kEnergy = "0000000000001040 ", kNoImpedance = "00000000 ", kImpedance = "0000FA44 ",
                  kNoWave = std::string(48, '0'), kWave = "000000000000F03F 000000000000F0BF 0000000000000040";

std::vector<std::uint8_t> bytes(const Datagram& datagram) {
  return {datagram.view().begin(), datagram.view().end()};
}
/// As a version before 11 sent it: the first bus' load alone. @param doubts bytes of them: one up to version 8.
std::vector<std::uint8_t> older_status(const MachineStatus& told, std::uint8_t version, std::ptrdiff_t doubts = 2) {
  std::vector<std::uint8_t> status = bytes(encode(told));
  status[2] = version;
  if (doubts == 1) status.erase(status.end() - std::ptrdiff_t{MachineName::kSize} - 1);
  const auto errors = status.end() - std::ptrdiff_t{MachineName::kSize} - doubts - 20;
  status.erase(errors - 10, errors);
  return status;
}

TEST(OlderLinks, ASetPointOfVersion7LosesItsEnergyAndWaveAndNothingElse) {
  for (const bool waves : {false, true}) {
    const auto old = test::hex(kMaster + kEnergy + (waves ? kImpedance + kWave : kNoImpedance + kNoWave));
    ASSERT_EQ(old.size(), kMasterSize);
    const auto translated = from_older_link(old);
    ASSERT_TRUE(translated);
    EXPECT_EQ(translated->led_by_waves, waves);
    auto expected = test::hex(kMaster);
    expected[2] = kLinkVersion;
    EXPECT_EQ(translated->bytes, expected);
    EXPECT_TRUE(decode_master(translated->bytes));
  }
}

TEST(OlderLinks, ReportsLoseTheirEnergyAndWaveAndTellNoTorqueThatTheyDidNotHave) {
  SlaveMessage message;
  message.mode = Mode::kEngaged;
  message.payload_kg = 12;
  struct Version {
    std::uint8_t number;
    std::size_t lacks;  // bytes at its end
    std::string besides;
  };
  for (const Version& version : {Version{7, kSinceVersion9, kEnergy + kWave}, {8, kSinceVersion9, ""}, {9, 0, ""}}) {
    auto old = bytes(encode(message));
    old.resize(old.size() - version.lacks);
    old[2] = version.number;
    for (const std::uint8_t byte : test::hex(version.besides)) old.push_back(byte);
    const auto report = from_older_link(old);
    ASSERT_TRUE(report) << int{version.number};
    EXPECT_EQ(report->bytes, bytes(encode(message))) << int{version.number};
    EXPECT_EQ(report->made_up, version.lacks) << int{version.number};
    EXPECT_TRUE(decode_slave(report->bytes)) << int{version.number};
  }
  auto set_point = test::hex(kMaster);
  set_point[2] = 8;
  ASSERT_TRUE(from_older_link(set_point));
  EXPECT_FALSE(from_older_link(set_point)->led_by_waves);
  EXPECT_EQ(from_older_link(set_point)->made_up, 0u);
}

TEST(OlderLinks, AStatusTellsTheLoadOfOneBus) {
  MachineStatus told;
  told.force_doubts = 0x85;
  told.buses[0].load = 0.4;
  told.can_errors = 3;
  told.machine = MachineName("solar015");
  for (const int version : {7, 9, 10}) {
    const auto status = older_status(told, static_cast<std::uint8_t>(version), version == 7 ? 1 : 2);
    ASSERT_EQ(status.size(), version == 7 ? 239u : 240u);
    ASSERT_TRUE(from_older_link(status));
    EXPECT_EQ(from_older_link(status)->bytes, bytes(encode(told))) << version;
  }
}

TEST(OlderLinks, WhatVersion7DidNotTakeIsNotTakenNow) {
  const auto good = test::hex(kMaster + kEnergy + kImpedance + kWave);
  for (const int version : {6, int{kLinkVersion}, kLinkVersion + 1}) {
    auto other = good;
    other[2] = static_cast<std::uint8_t>(version);
    EXPECT_FALSE(from_older_link(other)) << version;
  }
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_FALSE(from_older_link(std::span(good).first(size))) << size;
  const auto with = [&good](std::size_t at, auto value) {
    auto wild = good;
    std::memcpy(wild.data() + at, &value, sizeof value);
    return wild;
  };
  for (const double wild : {1e308, -1e308, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(from_older_link(with(kImpedanceAt - 8, wild))) << "energy";
    for (std::size_t at = kImpedanceAt + 4; at < good.size(); at += 8)
      EXPECT_FALSE(from_older_link(with(at, wild))) << at;
  }
  EXPECT_FALSE(from_older_link(with(good.size() - 8, -1.0))) << "an energy below zero";
  for (const float wild : {-1.0F, 2e9F, std::numeric_limits<float>::infinity()})
    EXPECT_FALSE(from_older_link(with(kImpedanceAt, wild))) << wild;
}

std::string recorded(const std::string& name) {
  return test::source_dir() + "/tests/recordings_replayed/" + name + ".mcap";
}

/// What a replay says.
std::string refusal(const std::string& file) {
  return test::refusal([&] {
    Recording recording({file});
    (void)replay(recording, setup_of(recording));
  });
}

TEST(OlderRecordings, OfALawThatIsNoMoreAreReadButNotRunAgain) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("tdpa.mcap");
  Head head = Recording({recorded("press")}).head();
  head.law = "tdpa";
  const std::string law = "law = \"echo\"";
  head.device_file.replace(head.device_file.find(law), law.size(), "law = \"tdpa\"");
  test::rewrite(recorded("press"), file, head, {1}, [](const auto&, auto&) { return true; });
  EXPECT_EQ(refusal(file), file + ": law = tdpa: cannot be run again by this version: must be echo, cues or direct");
  // With another law in its place, as asked for by --control, it is.
  Recording recording({file});
  ReplaySetup setup = setup_of(recording);
  EXPECT_EQ(setup.device.feel.law, ControlLaw::kEchoSpring);
  setup.head.law = "echo";
  const ReplayResult result = replay(recording, setup);
  EXPECT_EQ(result.sides[0].unreadable + result.sides[1].unreadable, 0u) << test::words(result);
  EXPECT_GT(result.sides[0].steps, 1000u);
}

TEST(OlderRecordings, OfAMachineThatWavesLedAreNotRunAgain) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("waves.mcap");
  const std::string older = test::source_dir() + "/tests/recording/load_of_link_7.mcap";
  const Head head = Recording({older}).head();
  ASSERT_EQ(head.link_version, 7) << "made anew by this version, it has no waves";
  std::vector<std::vector<std::uint8_t>> changed;
  test::rewrite(older, file, head, {1}, [&changed](const std::string& topic, auto& message) {
    if (topic != kTopicNames[static_cast<std::size_t>(Topic::kMachineWires)]) return true;
    auto wires = decode_wires(message, kLinkVersion);
    for (WireEvent& event : wires->events) {
      if (event.kind != WireEventKind::kLinkReceived || event.data.size() != kMasterSize) continue;
      const float impedance_Ns_per_m = 2000;
      changed.emplace_back(event.data.begin(), event.data.end());
      std::memcpy(changed.back().data() + kImpedanceAt, &impedance_Ns_per_m, sizeof impedance_Ns_per_m);
      event.data = changed.back();
    }
    message = test::encode_wires(*wires, true);
    return true;
  });
  ASSERT_FALSE(changed.empty());
  EXPECT_EQ(refusal(file), file + ": law = wave: cannot be run again by this version: must be echo, cues or direct");
}

}  // namespace
}  // namespace knuckle::recording
