// Identifiers, scalings and patience of the machine bus: what a machine file may say of them, and what is refused.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "machine/load.h"
#include "tests/support/patterns.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"

namespace knuckle {
namespace {

/// The shipped file with one text replaced.
std::string changed(const std::string& from, const std::string& to) {
  std::ifstream file(test::source_dir() + "/config/machines/solar015.toml");
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
MachineDescription read(const std::string& from, const std::string& to) {
  return parse_machine(changed(from, to), "test.toml");
}
/// What is said of such a file, without file and line.
std::string refusal(const std::string& from, const std::string& to) {
  return test::with_match_replaced(test::refusal([&] { (void)read(from, to); }), "^test.toml:[0-9]+: ", "");
}

const std::string kTilt = "id = 0x38, ", kArmValve = "id = 0x11, ", kBus = "controller_id = 1\n";

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
  const BusDescription bus = read(kArmValve, kArmValve + "tpdo = 0x2A1, rpdo = 0x321, ").bus;
  EXPECT_EQ(bus.valve(1).tpdo_id(), 0x2A1U);
  EXPECT_EQ(bus.valve(1).rpdo_id(), 0x321U);
  EXPECT_EQ(bus.valve(0).tpdo_id(), 0x190U);
}

TEST(BusFile, AValveMayBeOfAProfileThatIsLedInItsOwnWay) {
  const std::string pved = kArmValve + "profile = \"cia408/pved\", ";
  const BusDescription bus = read(kArmValve, pved).bus;
  EXPECT_EQ(bus.valve(1).profile, ValveProfile::kPved);
  EXPECT_EQ(bus.valve(0).profile, ValveProfile::kCia408);
  EXPECT_NE(refusal(kArmValve, kArmValve + "profile = \"cia409\", ").find("cia408/pved"), std::string::npos);
  EXPECT_NE(refusal(kTilt, kTilt + "profile = \"cia408\", ").find("profile"), std::string::npos) << "no valve";
  const auto stroke = [&](int most) {
    return refusal("[bus.nodes]\nboom_valve           = {",
                   "[bus.wire]\nvalve_full_stroke = " + std::to_string(most) +
                       "\n[bus.nodes]\nboom_valve = { profile = \"cia408/pved\",");
  };
  EXPECT_NE(stroke(32767).find("must be at most 32766"), std::string::npos) << stroke(32767);
  EXPECT_NO_THROW(
      (void)read("[bus.nodes]\nboom_valve           = {",
                 "[bus.wire]\nvalve_full_stroke = 32766\n[bus.nodes]\nboom_valve = { profile = \"cia408/pved\","));
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
  EXPECT_EQ(refusal(kTilt, kTilt + "tpdo = 0x1A0, "),
            "key 'bus.nodes.tilt.tpdo' = 0x1A0: its frames' identifier 0x1A0 is taken by 'boom_head_pressure.tpdo'");
  EXPECT_EQ(refusal(kArmValve, kArmValve + "rpdo = 0x190, "),
            "key 'bus.nodes.arm_valve.rpdo' = 0x190: its frames' identifier 0x190 is taken by 'boom_valve.tpdo'");
  EXPECT_EQ(refusal(kTilt, kTilt + "tpdo = 0x180, "),
            "key 'bus.nodes.tilt.tpdo' = 0x180: must be within [0x181, 0x57F]");
  EXPECT_EQ(refusal(kTilt, kTilt + "tpdo = 0x601, "),
            "key 'bus.nodes.tilt.tpdo' = 0x601: must be within [0x181, 0x57F]");
  // A sensor is told nothing.
  EXPECT_EQ(refusal(kTilt, kTilt + "rpdo = 0x238, ").substr(0, 47), "key 'bus.nodes.tilt.rpdo' = 0x238: unknown key,");
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

}  // namespace
}  // namespace knuckle
