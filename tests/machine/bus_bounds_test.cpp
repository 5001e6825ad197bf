// Values of [bus] that are refused: the line says what would be right, and no more than that.
#include <gtest/gtest.h>

#include "machine/load.h"
#include "tests/support/few_nodes.h"
#include "tests/support/refusal.h"

namespace knuckle {
namespace {

std::string bounds_refusal(const std::string& from, const std::string& to) {
  std::string text = test::few_nodes_text();
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return test::refusal([&] { (void)parse_machine(text, "test.toml"); });
}

TEST(BusBounds, AreThoseThatHold) {
  struct Case {
    const char *from, *to, *said;
  };
  for (const Case& c : std::initializer_list<Case>{
           {"name = \"tilt\"", "name = \"tilt\"\ntpdo = 0x1FFFFFFFF",
            ".tpdo' = 0x1FFFFFFFF: must be within [0x181, 0x57F]"},
           {"name = \"tilt\"", "name = \"tilt\"\ntpdo = -1", ".tpdo' = -1: must be within [0x181, 0x57F]"},
           {"name = \"tilt\"", "name = \"tilt\"\ntpdo = \"x\"", ".tpdo' = 'x': must be a whole number"},
           {"name = \"tilt\"", "name = \"tilt\"\ntpdo_map = [0x1FFFFFFFF]",
            "must be 1 to 8 numbers within [0, 4294967295]"},
           {"bit_rate_kbps = 250", "bit_rate_kbps = nan", "bus.bit_rate_kbps' = nan: must be a whole number"},
           {"bit_rate_kbps = 250", "bit_rate_kbps = 9223372036854775807", "must be one of CANopen's: 10, 20, 50"},
           {"device_type = 0x0198", "device_type = 0xFFFFFFFF", "has 65535"},
       }) {
    const std::string said = bounds_refusal(c.from, c.to);
    EXPECT_NE(said.find(c.said), std::string::npos) << c.to << ": " << said;
    EXPECT_EQ(said.find("65535]"), std::string::npos) << said;
  }
}

TEST(BusBounds, ANodeThatWouldEndADbcFilesListOfNodesIsRefused) {
  for (const char* name : {"BO_", "BU_", "VAL_TABLE_", "Vector__XXX", "VECTOR__INDEPENDENT", "VERSION"}) {
    EXPECT_NE(
        bounds_refusal("name = \"arm_valve\"", "name = \"" + std::string(name) + "\"").find("a word of DBC files"),
        std::string::npos)
        << name;
  }
  for (const char* name : {"boom_", "Bo_", "ARM", "vector"})
    EXPECT_EQ(bounds_refusal("name = \"arm_valve\"", "name = \"" + std::string(name) + "\""), "accepted") << name;
}

}  // namespace
}  // namespace knuckle
