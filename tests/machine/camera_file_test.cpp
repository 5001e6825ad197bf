// [[camera]] of a machine file.
#include <gtest/gtest.h>

#include <numbers>
#include <string>

#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/temporary_folder.h"

namespace knuckle {
namespace {

const std::string kFront =
    "[[camera]]\nname = \"front\"\nposition_m = [1.0, -0.5, 2.0]\npan_deg = 90\ntilt_deg = -30\n"
    "field_of_view_deg = 60\n";

/// The default machine with these cameras besides its own.
MachineDescription with(const std::string& cameras) {
  return parse_machine(test::content(test::source_dir() + "/config/machines/solar015.toml") + cameras, "machine.toml");
}
std::string camera_refusal(const std::string& cameras) {
  return test::refusal([&] { (void)with(cameras); });
}
std::string front_with(const std::string& from, const std::string& to) {
  std::string text = kFront;
  return text.replace(text.find(from), from.size(), to);
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
  std::string text = test::content(test::source_dir() + "/config/machines/solar015.toml");
  text.erase(text.find("[[camera]]"));
  EXPECT_TRUE(parse_machine(text, "machine.toml").cameras.empty());
}

TEST(MachineCamera, IsRefusedWithKeyValueAndBound) {
  const std::pair<std::string, std::string> cases[] = {
      {front_with("\"front\"", "\"mast\""), "key 'camera[1].name' = 'mast': is taken by another camera"},
      {front_with("\"front\"", "\"front view\""), "key 'camera[1].name' = 'front view': must be made of letters"},
      {front_with("= 90", "= 181"), "key 'camera[1].pan_deg' = 181: must be within [-180, 180]"},
      {front_with("-30", "-90"), "key 'camera[1].tilt_deg' = -90: must be within [-89, 89]"},
      {front_with("= 60", "= 4"), "key 'camera[1].field_of_view_deg' = 4: must be within [5, 150]"},
      {front_with("1.0,", "31,"), "key 'camera[1].position_m"},
      {front_with("1.0, ", ""), "key 'camera[1].position_m"},
      {front_with("tilt_deg = -30\n", ""), "key 'camera[1].tilt_deg' is missing"},
      {kFront + "roll_deg = 1\n", "key 'camera[1].roll_deg' = 1: unknown key"},
  };
  for (const auto& [cameras, words] : cases)
    EXPECT_NE(camera_refusal(cameras).find(words), std::string::npos) << camera_refusal(cameras);
}

}  // namespace
}  // namespace knuckle
