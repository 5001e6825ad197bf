#include "core/fields.h"

#include <gtest/gtest.h>

#include "core/joints.h"

namespace knuckle {
namespace {

struct Part {
  PlanarVector tip_m{1, 2};
  float pull_N = 0.5F;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    [[maybe_unused]] const auto& [tip_m, pull_N] = self;
    visit("tip_m", self.tip_m);
    visit("pull_N", self.pull_N);
  }
};

struct Whole {
  Time at{7ns};
  bool on = true;
  Reason fault{ReasonCode::kNodeSilent, 3, 4, 5};
  JointVector joint_rad{1, 2, 3};
  Part part;
  std::uint32_t count = 9;

  [[nodiscard]] static bool of_device(std::string_view field) { return field == "joint_rad"; }
  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    [[maybe_unused]] const auto& [at, on, fault, joint_rad, part, count] = self;
    visit("time_ns", self.at);
    visit("on", self.on);
    visit("fault", self.fault);
    visit("joint_rad", self.joint_rad);
    visit("part", self.part);
    visit("count", self.count);
  }
};

const Field& field(std::string_view part, std::string_view name) {
  for (const Field& one : fields_of<Whole>())
    if (one.part == part && one.name == name) return one;
  throw std::out_of_range(std::string(name));
}

TEST(Fields, StandInTheOrderOfTheListWithTheirNamesAndParts) {
  std::string names;
  for (const Field& one : fields_of<Whole>()) names += one.part + ":" + one.name + " ";
  EXPECT_EQ(names,
            ":time_ns :on :fault :fault_subject :fault_value :fault_limit :joint_rad part:tip_m part:pull_N :count ");
}

TEST(Fields, GiveTheNumbersOfAnyStruct) {
  Whole whole;
  whole.joint_rad[2] = -4;
  whole.part.tip_m.y() = 6;
  EXPECT_EQ(number_at(&whole, field("", "time_ns")), 7);
  EXPECT_EQ(number_at(&whole, field("", "on")), 1);
  EXPECT_EQ(number_at(&whole, field("", "fault_subject")), 3);
  EXPECT_EQ(number_at(&whole, field("", "fault_limit")), 5);
  EXPECT_EQ(number_at(&whole, field("", "joint_rad"), 2), -4);
  EXPECT_EQ(number_at(&whole, field("part", "tip_m"), 1), 6);
  EXPECT_EQ(number_at(&whole, field("part", "pull_N")), 0.5);
  EXPECT_EQ(number_at(&whole, field("", "count")), 9);
}

TEST(Fields, KnowTimesWordsAndVectors) {
  EXPECT_TRUE(field("", "time_ns").time);
  EXPECT_FALSE(field("", "count").time);
  const Field& fault = field("", "fault");
  ASSERT_NE(fault.word, nullptr);
  EXPECT_STREQ(fault.word(static_cast<unsigned>(ReasonCode::kNodeSilent)), name(ReasonCode::kNodeSilent));
  EXPECT_EQ(fault.words, static_cast<unsigned>(ReasonCode::kCount));
  EXPECT_EQ(field("", "joint_rad").count, 3U);
  EXPECT_TRUE(field("", "joint_rad").of_device);
  EXPECT_FALSE(field("part", "tip_m").of_device);
  EXPECT_FALSE(field("", "on").vector);
}

TEST(Fields, HaveTheUnitThatTheirNameEndsIn) {
  EXPECT_EQ(unit_of("joint_radps"), "rad/s");
  EXPECT_EQ(unit_of("covariance_N2"), "N^2");
  EXPECT_EQ(unit_of("confidence"), "");
  EXPECT_EQ(unit_of("felt_slew_N_per_ms"), "");
}

}  // namespace
}  // namespace knuckle
