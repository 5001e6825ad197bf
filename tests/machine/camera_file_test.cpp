// [[camera]] of a machine file.
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "tests/support/refused_changes.h"
#include "tests/support/replaced.h"
#include "tests/support/shipped.h"

namespace knuckle {
namespace {

const std::string kFront =
    "[[camera]]\nname = \"front\"\nposition_m = [1.0, -0.5, 2.0]\npan_deg = 90\ntilt_deg = -30\n"
    "field_of_view_deg = 60\n";

/// The default machine with these cameras besides its own.
MachineDescription with(const std::string& cameras) {
  return parse_machine(test::shipped_text() + cameras, "m.toml");
}

TEST(MachineCamera, HasPlaceDirectionAndLens) {
  const MachineDescription machine = with(kFront);
  ASSERT_EQ(machine.cameras.size(), 2u);
  EXPECT_EQ(machine.cameras[0].name, "mast");
  const CameraDescription& front = machine.cameras[1];
  EXPECT_EQ(front.name, "front");
  EXPECT_EQ(front.position_m, Eigen::Vector3d(1.0, -0.5, 2.0));
  EXPECT_DOUBLE_EQ(front.pan_rad, std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(front.tilt_rad, -std::numbers::pi / 6);
  EXPECT_DOUBLE_EQ(front.field_of_view_rad, std::numbers::pi / 3);
}

TEST(MachineCamera, IsOptional) {
  const std::string text = test::shipped_text();
  EXPECT_TRUE(parse_machine(text.substr(0, text.find("[[camera]]")), "m.toml").cameras.empty());
}

TEST(MachineCamera, IsRefusedWithKeyValueAndBound) {
  test::expect_refused(
      {
          {"\"front\"", "\"mast\"", "key 'camera[1].name' = 'mast': is taken by another camera"},
          {"\"front\"", "\"front view\"", "key 'camera[1].name' = 'front view': must be made of letters"},
          {"= 90", "= 181", "key 'camera[1].pan_deg' = 181: must be within [-180, 180]"},
          {"-30", "-90", "key 'camera[1].tilt_deg' = -90: must be within [-89, 89]"},
          {"= 60", "= 4", "key 'camera[1].field_of_view_deg' = 4: must be within [5, 150]"},
          {"1.0,", "31,", "key 'camera[1].position_m"},
          {"1.0, ", "", "key 'camera[1].position_m"},
          {"tilt_deg = -30\n", "", "key 'camera[1].tilt_deg' is missing"},
          {kFront, kFront + "roll_deg = 1\n", "key 'camera[1].roll_deg' = 1: unknown key"},
      },
      [](const auto& from, const auto& to) { (void)with(test::replaced(kFront, from, to)); });
}

}  // namespace
}  // namespace knuckle
