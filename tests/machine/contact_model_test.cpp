// What a machine file says of the force's model, and of a cylinder without pressure transmitters.
#include <gtest/gtest.h>

#include <algorithm>

#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/two_cylinders.h"

namespace knuckle {
namespace {
using test::solar015_text;
using test::without_transmitters;

std::string refusal(const std::string& text) {
  return test::refusal([&] { (void)parse_machine(text, "m.toml"); });
}
std::string force(const std::string& keys) {
  return solar015_text() + "\n[force]\n" + keys + "\n";
}
TEST(ContactModelKey, NamesAModelAndNothingIsTheBucketForce) {
  EXPECT_EQ(parse_machine(solar015_text(), "m.toml").force.contact_model, ContactModel::kBucketForce);
  for (std::size_t i = 0; i < kContactModelNames.size(); ++i) {
    const MachineDescription machine =
        parse_machine(force(std::string("contact_model = \"") + kContactModelNames[i] + "\""), "m.toml");
    EXPECT_EQ(machine.force.contact_model, static_cast<ContactModel>(i));
  }
}

TEST(ContactModelKey, WhatIsNoModelOrNoDirectionIsOneLine) {
  for (const auto& [keys, said] : {std::pair{"contact_model = \"tip\"", "force.contact_model"},
                                   {"contact_model = [\"bucket_force\", \"tip_wrench\"]", "force.contact_model"},
                                   {"direction = \"up\"", "force.direction"},
                                   {"direction = \"fixed\"", "force.fixed_direction"},
                                   {"direction = \"fixed\"\nfixed_direction = [0, 0]", "must be longer than 0.1"},
                                   {"fixed_direction = [1, 0]", "goes with direction = \"fixed\" alone"},
                                   {"direction = \"plumb\"\nfixed_direction = [1, 0]", "goes with direction"},
                                   {"contact_models = \"tip_wrench\"", "force.contact_models"}}) {
    EXPECT_NE(refusal(force(keys)).find(said), std::string::npos) << keys << ": " << refusal(force(keys));
    EXPECT_EQ(refusal(force(keys)).find('\n'), std::string::npos);
  }
}

TEST(ContactModelKey, IsReplacedInTheTextThatARecordingKeeps) {
  for (const std::string& text : {solar015_text(), force("# mine\ncontact_model = \"tip_wrench\"  # of Kim"), force(""),
                                  solar015_text() + "\n [ force ]  # mine\n"}) {
    const MachineDescription changed = with_contact_model(parse_machine(text, "m.toml"), "tip_force_of_two");
    EXPECT_EQ(changed.force.contact_model, ContactModel::kTipForceOfTwo);
    EXPECT_EQ(parse_machine(changed.text, "m.toml").force.contact_model, ContactModel::kTipForceOfTwo);
    EXPECT_EQ(changed.bus, parse_machine(text, "m.toml").bus);
  }
}

TEST(ContactModelKey, OneThatTheSensorsDoNotAllowIsRefusedByTheOptionThatAsksForIt) {
  const MachineDescription two = parse_machine(without_transmitters("boom"), "m.toml");
  EXPECT_EQ(test::refusal([&] {
              (void)with_contact_model(two, "tip_wrench");
            }).find("--contact-model tip_wrench: needs the pressures of the boom cylinder"),
            0U);
  EXPECT_EQ(with_contact_model(two, "tip_force_of_two").force.contact_model, ContactModel::kTipForceOfTwo);
}

TEST(WithoutPressures, OneCylinderMayHaveNoneWhereTheFileSaysSo) {
  for (const int joint : {kBoom, kArm, kBucket}) {
    const MachineDescription machine =
        parse_machine(without_transmitters(kJointNames[static_cast<std::size_t>(joint)]), "m.toml");
    EXPECT_EQ(machine.sensors.without_pressures, joint);
    EXPECT_EQ(machine.bus.nodes.size(), parse_machine(solar015_text(), "m.toml").bus.nodes.size() - 2);
  }
}

TEST(WithoutPressures, WhatIsNoJointIsOneLineAndNothingOfNodes) {
  for (const std::string value : {"\"bom\"", "\"\"", "[\"boom\"]"}) {
    std::string text = without_transmitters("boom");
    text.replace(text.find("without_pressures = \"boom\""), 26, "without_pressures = " + value);
    const std::string told = refusal(text);
    EXPECT_NE(told.find("sensors.without_pressures"), std::string::npos) << told;
    EXPECT_EQ(told.find('\n'), std::string::npos) << told;
  }
}

TEST(WithoutPressures, MissingNodesAloneAreAFault) {
  std::string text = without_transmitters("boom");
  text.erase(text.find("without_pressures"), std::string("without_pressures = \"boom\"\n").size());
  EXPECT_NE(refusal(text).find("no node has boom_head_pressure, boom_rod_pressure"), std::string::npos)
      << refusal(text);
}

TEST(WithoutPressures, ATransmitterThatIsThereAllTheSameIsAFault) {
  std::string text = solar015_text();
  text.replace(text.find("[sensors]\n"), 10, "[sensors]\nwithout_pressures = \"boom\"\n");
  EXPECT_NE(refusal(text).find("there is boom_head_pressure, although"), std::string::npos) << refusal(text);
}

TEST(WithoutPressures, AModelThatNeedsThemAndAPressureLimitBelowTheReliefAreRefused) {
  const auto with = [](const char* joint, const char* model) {
    return refusal(without_transmitters(joint) + "\n[force]\ncontact_model = \"" + model + "\"\n");
  };
  for (const auto& [joint, model, ok] : {std::tuple{"boom", "tip_wrench", false},
                                         {"boom", "tip_force_of_two", true},
                                         {"boom", "bucket_force", true},
                                         {"arm", "tip_force_of_two", false},
                                         {"bucket", "force_and_position", false},
                                         {"arm", "bucket_force", true}}) {
    const std::string told = with(joint, model);
    EXPECT_EQ(told.find("needs the pressures of the") == std::string::npos, ok) << joint << ' ' << model << told;
  }
  std::string low = without_transmitters("boom");
  const std::size_t at = low.find("chamber_pressure_bar = 240");
  low.replace(at, std::string("chamber_pressure_bar = 240").size(), "chamber_pressure_bar = 200");
  EXPECT_NE(refusal(low).find("nothing lower is kept on a cylinder without transmitters"), std::string::npos)
      << refusal(low);
}

}  // namespace
}  // namespace knuckle
