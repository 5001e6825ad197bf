// `knuckle bus add` with device files that have slips, and outputs that nobody can read.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "tests/eds/made_device.h"

namespace knuckle::eds {
namespace {

using test::says;

using Lines = std::vector<std::string>;

Lines obstacles_with(const std::string& node, std::uint32_t key, const std::function<void(Entry&)>& spoil) {
  DeviceFile device = test::made_for(node);
  spoil(device.entries.at(key));
  return fit_of(device, test::machine(), node).obstacles;
}

TEST(DeviceFit, WhatNoneCanReadOrWriteOrMapIsTold) {
  struct Case {
    const char* node;
    std::uint32_t key;
    std::function<void(Entry&)> spoil;
    const char* said;
  };
  const auto is = [](Access access) { return [access](Entry& entry) { entry.access = access; }; };
  for (const Case& c : std::initializer_list<Case>{
           {"boom_valve", 0x630001, is(Access::kReadOnly), "AccessType of 0x6300:01 is that of what can only be read"},
           {"boom_valve", 0x630001, is(Access::kWriteOnly), "start-up reads 0x6300:01, which can only be written"},
           {"boom_valve", 0x604100, is(Access::kWriteOnly), "AccessType of 0x6041:00 is that of what can only be wri"},
       }) {
    EXPECT_TRUE(says(obstacles_with(c.node, c.key, c.spoil), c.said));
  }
}

TEST(DeviceFit, WhatCannotBeMappedMustBeMappedAsDelivered) {
  struct Case {
    const char* node;
    std::uint32_t object, place;
    const char* said;
  };
  for (const Case& c : {Case{"boom_valve", 0x630001, 0x160002, "PDOMapping of 0x6300:01 is 0"},
                        Case{"tilt", 0x601000, 0x1A0001, "PDOMapping of 0x6010:00 is 0"}}) {
    DeviceFile device = test::made_for(c.node);
    device.entries.at(c.object).mappable = false;
    EXPECT_EQ(fit_of(device, test::machine(), c.node).obstacles, Lines());
    device.entries.at(c.place).value = Value{0, false};
    const Lines told = fit_of(device, test::machine(), c.node).obstacles;
    EXPECT_TRUE(says(told, c.said));
  }
}

TEST(DeviceFit, LimitsThatExcludeWhatStartUpWritesAreTold) {
  const auto with = [](std::uint32_t key, std::optional<std::int64_t> least, std::optional<std::int64_t> most) {
    return obstacles_with("boom_valve", key, [&](Entry& entry) {
      entry.value = Value{7, false};
      entry.lowest = least;
      entry.most = most;
    });
  };
  EXPECT_TRUE(
      says(with(0x101700, 500, 1000), "start-up writes 100 to 0x1017:00, which takes 500 (LowLimit) to 1000 (HighL"));
  EXPECT_TRUE(says(with(0x101700, {}, 99), "which takes 99 (HighLimit)"));
  EXPECT_EQ(with(0x101700, 100, 1000), Lines());
  EXPECT_EQ(with(0x101700, 0, 0), Lines()) << "as tools write it that know no limits";
  EXPECT_EQ(with(0x630001, -100, 100), Lines());
  EXPECT_EQ(with(0x180001, 0x181, 0x57F), Lines()) << "what switches a PDO off lies beyond";
  DeviceFile device = test::made_for("boom_valve");
  for (const std::uint32_t key : {0x140005U, 0x101601U}) device.entries.at(key).value = Value{7, false};
  device.entries.at(0x140005).lowest = 100;
  const Fit fit = fit_of(device, test::machine(), "boom_valve");
  EXPECT_EQ(fit.obstacles, Lines()) << "the heartbeat guards it";
  EXPECT_TRUE(says(fit.notes, "one of its two guards is not used: start-up writes 50 to 0x1400:05"));
  device.entries.erase(0x101601);
  EXPECT_TRUE(
      says(fit_of(device, test::machine(), "boom_valve").obstacles, "it would not stop (start-up writes 50 to 0x14"));
}

TEST(DeviceFit, WhatIsToBeSetOfTheDeviceOrInTheFileIsToldWithItsKey) {
  DeviceFile device = test::made_for("tilt");
  device.entries.at(0x600000).value = Value{10, false};
  device.entries.at(0x600000).access = Access::kReadWrite;
  EXPECT_TRUE(says(fit_of(device, test::machine(), "tilt").to_set,
                   "it is delivered with 10; or in [sensors] of the machine file tilt_step_deg = 0.01"));
  device.entries.at(0x600000).value = Value{1, false};  // 16 bits would not reach far enough
  EXPECT_FALSE(says(fit_of(device, test::machine(), "tilt").to_set, "machine file"));
}

TEST(BusAdd, TakesAMachineFileWithRecordsOfGuards) {
  const std::string text = test::shipped_text() +
                           "\n[commissioning]\nmachine_sha256 = \"\"\n[[commissioning.guards]]\nnode = \"boom_valve\"\n"
                           "vendor = 0x4B4E\nproduct = 0x0408\nproved = true\ndate = \"2026-01-02\"\nseen = \"it\"\n";
  const MachineDescription after =
      parse_machine(with_device(text, "my.toml", "boom_valve", 0x50, test::made_for("boom_valve")), "my.toml");
  EXPECT_EQ(after.bus.valve(kBoom).id, 0x50);
  EXPECT_EQ(after.bus.valve(kBoom).guard.changed, GuardProof::Changed::kDevice);
}

TEST(BusAdd, WhatTheFileWouldBeRefusedForIsToldWithoutLinesItDoesNotHave) {
  DeviceFile device = test::made_for("tilt");
  device.entries.at(0x180001).access = Access::kReadOnly;
  device.entries.at(0x180001).value = Value{0x1A0, false};  // boom_head_pressure's
  const std::string line = test::refused("tilt", 0x38, device);
  EXPECT_EQ(line.find("my.toml: is as it was: with tilt of a.eds it would be refused: key 'bus.n"), 0U) << line;
}

TEST(DeviceFile, AnIdentityBelowZeroIsRefusedAndAVendorOfNobodyIsTold) {
  DeviceFile device = test::made_for("tilt");
  std::string text = test::eds_text(device);
  const std::string type = "[1000sub0]\nDataType=7\nAccessType=ro\nDefaultValue=0x";
  const auto at = text.find(type);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, text.find('\n', at + type.size()) - at, type.substr(0, type.size() - 2) + "-1");
  const std::string line = test::refusal([&] { return parse_device_file(text, "a.eds"); });
  EXPECT_TRUE(says(line, "DefaultValue of 0x1000:00: must be a whole number from 0 to 0xFFFFFFFF"));
  device.vendor = 0;
  EXPECT_TRUE(says(parse_device_file(test::eds_text(device), "a.eds").slips, "vendor id 0"));
}

TEST(DeviceFile, LimitsOfSignedObjectsMayBeGivenByTheirBits) {
  const std::string text = test::eds_text(test::made_for("boom_valve")) +
                           "[7000]\nDataType=3\nAccessType=rw\nLowLimit=0x8000\nHighLimit=0x7FFF\nPDOMapping=0\n";
  const DeviceFile file = parse_device_file(text, "a.eds");
  const Entry* entry = file.find({0x7000, 0});
  ASSERT_NE(entry, nullptr);
  EXPECT_EQ(entry->lowest, -32768);
  EXPECT_EQ(entry->most, 32767);
  EXPECT_EQ(entry->mappable, false);
}

}  // namespace
}  // namespace knuckle::eds
