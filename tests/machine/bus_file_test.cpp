// Identifiers, scalings and patience of the machine bus: what a machine file may say of them, and what is refused.
#include <gtest/gtest.h>

#include "tests/support/few_nodes.h"
#include "tests/support/keyed_nodes.h"
#include "tests/support/patterns.h"
#include "tests/support/refused_changes.h"
#include "tests/support/replaced.h"
#include "tests/support/shipped.h"

namespace knuckle {
namespace {

MachineDescription read(const std::string& from, const std::string& to,
                        const std::string& text = test::shipped_text()) {
  return parse_machine(test::replaced(text, from, to), "m.toml");
}
/// What is said of such a file, without file and line.
std::string refusal(const std::string& from, const std::string& to, const std::string& text = test::shipped_text()) {
  return test::with_match_replaced(test::machine_refusal(test::replaced(text, from, to)), "^m.toml:[0-9]+: ", "");
}

const std::string kTilt = "id = 0x38\n", kArmValve = "id = 0x11\n", kBus = "controller_id = 1\n";

TEST(BusFile, WithoutThemIdentifiersFollowTheNodeIdsAndValuesTheDefaultProfiles) {
  const BusDescription bus = read("", "").bus;
  EXPECT_EQ(bus.valve(1).tpdo_id(), 0x191U);
  EXPECT_EQ(bus.valve(1).rpdo_id(), 0x211U);
  EXPECT_EQ(bus.tilt().tpdo_id(), 0x1B8U);
  EXPECT_EQ(bus.wire.valve_full_stroke, 16384);
  EXPECT_EQ(bus.wire.pressure, WireDescription::Pressure::kInteger);
  EXPECT_EQ(bus.wire.pressure_digits, 2);
  EXPECT_EQ(bus.wire.encoder_speed_step_mps, 1e-4);
  EXPECT_EQ(bus.sdo_timeout_s, 0.25);
}

TEST(BusFile, IdentifiersOfFramesAreTakenPerNode) {
  const BusDescription bus = read(kArmValve, kArmValve + "tpdo = 0x2A1\nrpdo = 0x321\n").bus;
  EXPECT_EQ(bus.valve(1).tpdo_id(), 0x2A1U);
  EXPECT_EQ(bus.valve(1).rpdo_id(), 0x321U);
  EXPECT_EQ(bus.valve(0).tpdo_id(), 0x190U);
}

TEST(BusFile, AValveMayBeOfAProfileThatIsLedInItsOwnWay) {
  const std::string arm_valve = "name = \"arm_valve\"\nprofile = \"cia408";
  const BusDescription bus = read(arm_valve, arm_valve + "/pved").bus;
  EXPECT_EQ(bus.valve(1).profile, ValveProfile::kPved);
  EXPECT_EQ(bus.valve(0).profile, ValveProfile::kCia408);
  EXPECT_TRUE(test::says(refusal(arm_valve, arm_valve + "/plus"), "cia408/pved"));
  const auto stroke = [&](int most) {
    const std::string wire = "[bus.wire]\nvalve_full_stroke = " + std::to_string(most) + "\n";
    return test::machine_refusal(
        test::replaced(test::replaced(test::shipped_text(), kBus, kBus + wire), arm_valve, arm_valve + "/pved"));
  };
  EXPECT_TRUE(test::says(stroke(32767), "must be at most 32766"));
  EXPECT_EQ(stroke(32766), "accepted");
}

TEST(BusFile, OlderWordsForNodesSayTheSame) {
  const std::string older = test::with_keyed_nodes(test::shipped_text()), tilt = "id = 0x38, ",
                    arm_valve = "id = 0x11, ";
  const BusDescription bus =
      read(arm_valve, arm_valve + "tpdo = 0x2A1, rpdo = 0x321, profile = \"cia408/pved\", ", older).bus;
  EXPECT_EQ(bus.valve(1).tpdo_id(), 0x2A1U);
  EXPECT_EQ(bus.valve(1).rpdo_id(), 0x321U);
  EXPECT_EQ(bus.valve(1).profile, ValveProfile::kPved);
  EXPECT_EQ(bus.valve(0), read("", "").bus.valve(0));
  const auto starts = [&](const std::string& from, const std::string& more, const std::string& said) {
    const std::string told = refusal(from, from + more, older);
    EXPECT_TRUE(test::begins(told, said));
  };
  starts(tilt, "tpdo = 0x1A0, ",
         "key 'bus.nodes.tilt.tpdo' = 0x1A0: its frames' identifier 0x1A0 is taken by 'boom_head_pressure.tpdo'");
  starts(tilt, "rpdo = 0x238, ", "key 'bus.nodes.tilt.rpdo' = 0x238: unknown key,");
  starts(tilt, "profile = \"cia408\", ", "key 'bus.nodes.tilt.profile' = 'cia408': unknown key,");
  starts(arm_valve, "profile = \"cia409\", ", "key 'bus.nodes.arm_valve.profile' = 'cia409': must be one of");
}

TEST(BusFile, ScalingsAndPatienceAreTaken) {
  const BusDescription bus = read(kBus, kBus +
                                            "sdo_timeout_ms = 100\nboot_timeout_ms = 4000\nstart_timeout_ms = 2000\n"
                                            "activate_timeout_ms = 900\n[bus.wire]\nvalve_full_stroke = 1000\n"
                                            "pressure_digits = 1\nencoder_speed_step_mmps = 1\n")
                                 .bus;
  EXPECT_DOUBLE_EQ(bus.sdo_timeout_s, 0.1);
  EXPECT_DOUBLE_EQ(bus.boot_timeout_s, 4);
  EXPECT_DOUBLE_EQ(bus.start_timeout_s, 2);
  EXPECT_DOUBLE_EQ(bus.activate_timeout_s, 0.9);
  EXPECT_EQ(bus.wire.valve_full_stroke, 1000);
  EXPECT_EQ(bus.wire.pressure_digits, 1);
  EXPECT_DOUBLE_EQ(bus.wire.encoder_speed_step_mps, 1e-3);
  EXPECT_EQ(read(kBus, kBus + "[bus.wire]\npressure_value = \"float\"\n").bus.wire.pressure,
            WireDescription::Pressure::kFloat);
}

TEST(BusFile, IdentifiersThatClashOrBelongToOtherServicesAreRefused) {
  EXPECT_EQ(refusal(kTilt, kTilt + "tpdo = 0x1A0\n"),
            "key 'bus.node[12].tpdo' = 0x1A0: its frames' identifier 0x1A0 is taken by 'boom_head_pressure.tpdo'");
  EXPECT_EQ(refusal(kArmValve, kArmValve + "rpdo = 0x190\n"),
            "key 'bus.node[1].rpdo' = 0x190: its frames' identifier 0x190 is taken by 'boom_valve.tpdo'");
  EXPECT_EQ(refusal(kTilt, kTilt + "tpdo = 0x180\n"), "key 'bus.node[12].tpdo' = 0x180: must be within [0x181, 0x57F]");
  EXPECT_EQ(refusal(kTilt, kTilt + "tpdo = 0x601\n"), "key 'bus.node[12].tpdo' = 0x601: must be within [0x181, 0x57F]");
  // A sensor is told nothing.
  EXPECT_EQ(refusal(kTilt, kTilt + "rpdo = 0x238\n").substr(0, 45), "key 'bus.node[12].rpdo' = 0x238: unknown key,");
}

TEST(BusFile, ScalingsOutOfBoundsAreRefused) {
  const auto wire = [](const std::string& line) { return refusal(kBus, kBus + "[bus.wire]\n" + line + "\n"); };
  EXPECT_EQ(wire("valve_full_stroke = 40000"), "key 'bus.wire.valve_full_stroke' = 40000: must be within [100, 32767]");
  EXPECT_EQ(wire("pressure_digits = 5"), "key 'bus.wire.pressure_digits' = 5: must be a whole number within [0, 4]");
  EXPECT_EQ(wire("pressure_value = \"float\"\npressure_digits = 2"),
            "key 'bus.wire.pressure_digits' = 2: only goes with pressure_value = \"integer\" or \"integer16\"");
  EXPECT_EQ(wire("pressure_value = \"double\""),
            "key 'bus.wire.pressure_value' = 'double': must be one of \"integer\", \"float\", \"integer16\"");
  EXPECT_EQ(refusal(kBus, kBus + "sdo_timeout_ms = 1\n"), "key 'bus.sdo_timeout_ms' = 1: must be within [10, 5000]");
}

/// Of a machine with few nodes.
std::string few_refusal(const std::string& from, const std::string& to) {
  return test::machine_refusal(test::replaced(test::few_nodes_text(), from, to));
}

TEST(BusFile, TheLineOfARefusalSaysTheBoundsThatHold) {
  const std::vector<test::RefusedChange> changes{
      {"name = \"tilt\"", "name = \"tilt\"\ntpdo = 0x1FFFFFFFF", ".tpdo' = 0x1FFFFFFFF: must be within [0x181, 0x57F]"},
      {"name = \"tilt\"", "name = \"tilt\"\ntpdo = -1", ".tpdo' = -1: must be within [0x181, 0x57F]"},
      {"name = \"tilt\"", "name = \"tilt\"\ntpdo = \"x\"", ".tpdo' = 'x': must be a whole number"},
      {"name = \"tilt\"", "name = \"tilt\"\ntpdo_map = [0x1FFFFFFFF]", "must be 1 to 8 numbers within [0, 4294967295]"},
      {"bit_rate_kbps = 250", "bit_rate_kbps = nan", "bus.bit_rate_kbps' = nan: must be a whole number"},
      {"bit_rate_kbps = 250", "bit_rate_kbps = 9223372036854775807", "must be one of CANopen's: 10, 20, 50"},
      {"device_type = 0x0198", "device_type = 0xFFFFFFFF", "has 65535"},
  };
  test::expect_refused(changes, [](const auto& from, const auto& to) {
    (void)parse_machine(test::replaced(test::few_nodes_text(), from, to), "m.toml");
  });
  for (const test::RefusedChange& change : changes)
    EXPECT_FALSE(test::says(few_refusal(change.from, change.to), "65535]")) << "no bound but that of the key";
}

TEST(BusFile, ANodeThatWouldEndADbcFilesListOfNodesIsRefused) {
  for (const char* name : {"BO_", "BU_", "VAL_TABLE_", "Vector__XXX", "VECTOR__INDEPENDENT", "VERSION"}) {
    EXPECT_TRUE(
        test::says(few_refusal("name = \"arm_valve\"", "name = \"" + std::string(name) + "\""), "a word of DBC files"))
        << name;
  }
  for (const char* name : {"boom_", "Bo_", "ARM", "vector"})
    EXPECT_EQ(few_refusal("name = \"arm_valve\"", "name = \"" + std::string(name) + "\""), "accepted") << name;
}

}  // namespace
}  // namespace knuckle
