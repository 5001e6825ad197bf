// What a machine file says of the force's model, and of a cylinder without pressure transmitters.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/refused_changes.h"
#include "tests/support/replaced.h"
#include "tests/support/two_cylinders.h"

namespace knuckle {
namespace {
using test::machine_refusal;
using test::shipped_text;
using test::without_transmitters;

std::string force(const std::string& keys) {
  return shipped_text() + "\n[force]\n" + keys + "\n";
}
TEST(ContactModelKey, NamesAModelAndNothingIsTheBucketForce) {
  EXPECT_EQ(parse_machine(shipped_text(), "m.toml").force.contact_model, ContactModel::kBucketForce);
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
    EXPECT_TRUE(test::says(machine_refusal(force(keys)), said)) << keys;
    EXPECT_FALSE(test::says(machine_refusal(force(keys)), "\n")) << keys;
  }
}

TEST(ContactModelKey, IsReplacedInTheTextThatARecordingKeeps) {
  for (const std::string& text : {shipped_text(), force("# mine\ncontact_model = \"tip_wrench\"  # of Kim"), force(""),
                                  shipped_text() + "\n [ force ]  # mine\n"}) {
    const MachineDescription changed = with_contact_model(parse_machine(text, "m.toml"), "tip_force_of_two");
    EXPECT_EQ(changed.force.contact_model, ContactModel::kTipForceOfTwo);
    EXPECT_EQ(parse_machine(changed.text, "m.toml").force.contact_model, ContactModel::kTipForceOfTwo);
    EXPECT_EQ(changed.bus, parse_machine(text, "m.toml").bus);
  }
}

TEST(ContactModelKey, OneThatTheSensorsDoNotAllowIsRefusedByTheOptionThatAsksForIt) {
  const MachineDescription two = parse_machine(without_transmitters("boom"), "m.toml");
  EXPECT_TRUE(test::begins(test::refusal([&] { (void)with_contact_model(two, "tip_wrench"); }),
                           "--contact-model tip_wrench: needs the pressures of the boom cylinder"));
  EXPECT_EQ(with_contact_model(two, "tip_force_of_two").force.contact_model, ContactModel::kTipForceOfTwo);
}

TEST(WithoutPressures, OneCylinderMayHaveNoneWhereTheFileSaysSo) {
  for (const int joint : {kBoom, kArm, kBucket}) {
    const MachineDescription machine =
        parse_machine(without_transmitters(kJointNames[static_cast<std::size_t>(joint)]), "m.toml");
    EXPECT_EQ(machine.sensors.without_pressures, joint);
    EXPECT_EQ(machine.bus.nodes.size(), parse_machine(shipped_text(), "m.toml").bus.nodes.size() - 2);
  }
}

TEST(WithoutPressures, AFileThatContradictsItselfIsOneLine) {
  const std::string none = without_transmitters("boom"), key = "without_pressures = \"boom\"\n";
  for (const auto& [text, said] :
       {std::pair{test::replaced(none, "= \"boom\"", "= \"bom\""), "sensors.without_pressures"},
        {test::replaced(none, "= \"boom\"", "= [\"boom\"]"), "sensors.without_pressures"},
        {test::replaced(none, key, ""), "no node has boom_head_pressure, boom_rod_pressure"},
        {test::replaced(shipped_text(), "[sensors]\n", "[sensors]\n" + key),
         "there is boom_head_pressure, although"}}) {
    EXPECT_TRUE(test::says(machine_refusal(text), said));
    EXPECT_FALSE(test::says(machine_refusal(text), "\n"));
  }
}

TEST(WithoutPressures, AModelThatNeedsThemAndAPressureLimitBelowTheReliefAreRefused) {
  const auto with = [](const char* joint, const char* model) {
    return machine_refusal(without_transmitters(joint) + "\n[force]\ncontact_model = \"" + model + "\"\n");
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
  const std::string low =
      test::replaced(without_transmitters("boom"), "chamber_pressure_bar = 240", "chamber_pressure_bar = 200");
  EXPECT_TRUE(test::says(machine_refusal(low), "nothing lower is kept on a cylinder without transmitters"));
}

}  // namespace
}  // namespace knuckle
