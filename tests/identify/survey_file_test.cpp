// A survey on paper and back; a table that is not one is refused with file, row and column.
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <sstream>

#include "app/identify/identify_data.h"
#include "core/error.h"

namespace knuckle::identify {
namespace {

std::string file(const std::string& text) {
  const std::string test = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  std::string path = ::testing::TempDir() + "knuckle_survey_" + test + ".csv";
  std::ofstream(path, std::ios::binary) << text;
  return path;
}

/// The refusal, without the folder of the file; "accepted" where there is none.
std::string refusal(const std::string& text) {
  try {
    (void)read_survey(file(text), 1e-3);
  } catch (const InputError& error) {
    const std::string line = error.what();
    return line.substr(line.find(".csv: ") + 6);
  }
  return "accepted";
}

const std::string kHeader = "boom_encoder_m,arm_encoder_m,bucket_encoder_m,tip_x_m,tip_z_m\n";

TEST(SurveyFile, IsReadAsItWasWritten) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  estimation::Survey survey;
  survey.poses.push_back({{0.9, 1.1, 1.0}, {1.5, 0.8}, {2.25, 0.125}, {2.6, -0.3}});
  survey.poses.push_back({{0.95, 1.2, 0.9}, {none, none}, {2.0, 0.1}, {none, none}});
  std::ostringstream text;
  write_survey(survey, text);
  const estimation::Survey read = read_survey(file(text.str()), 2e-3);
  ASSERT_EQ(read.poses.size(), 2u);
  EXPECT_EQ(read.point_sigma_m, 2e-3);
  EXPECT_TRUE(read.poses[0].cylinder_m.isApprox(survey.poses[0].cylinder_m));
  EXPECT_TRUE(read.poses[0].arm_pin_m.isApprox(survey.poses[0].arm_pin_m));
  EXPECT_TRUE(read.poses[0].bucket_pin_m.isApprox(survey.poses[0].bucket_pin_m));
  EXPECT_TRUE(read.poses[0].tip_m.isApprox(survey.poses[0].tip_m));
  EXPECT_TRUE(read.poses[1].bucket_pin_m.isApprox(survey.poses[1].bucket_pin_m));
  EXPECT_FALSE(read.poses[1].arm_pin_m.allFinite());
  EXPECT_FALSE(read.poses[1].tip_m.allFinite());
}

TEST(SurveyFile, TakesMillimetresAnyOrderAndBlankLines) {
  const auto survey = read_survey(
      file("tip_z_mm,tip_x_m,bucket_encoder_m,arm_encoder_mm,boom_encoder_m\r\n\r\n-300,2.6,1.0,1100,0.9\r\n"), 1e-3);
  ASSERT_EQ(survey.poses.size(), 1u);
  EXPECT_TRUE(survey.poses[0].cylinder_m.isApprox(JointVector(0.9, 1.1, 1.0)));
  EXPECT_TRUE(survey.poses[0].tip_m.isApprox(PlanarVector(2.6, -0.3)));
}

TEST(SurveyFile, RefusesWhatIsNoSurveyWithRowAndColumn) {
  EXPECT_EQ(refusal(""), "is empty");
  EXPECT_EQ(refusal(kHeader), "no pose below the header");
  EXPECT_EQ(refusal(kHeader + "0.9,1.1,1,2.6,-0.3\n0.9,1.1,one,2.6,-0.3\n"),
            "row 3: bucket_encoder_m = 'one': must be a number");
  EXPECT_EQ(refusal(kHeader + "0.9,,1,2.6,-0.3\n"), "row 2: arm_encoder_m = '': must be a number");
  EXPECT_EQ(refusal(kHeader + "0.9,1.1,1,2.6\n"), "row 2: 4 cells, but 5 columns");
  EXPECT_EQ(refusal(kHeader + "0.9,1.1,1,2.6,\n"), "row 2: tip_x and tip_z: give both or none");
  EXPECT_EQ(refusal("boom_encoder_m,arm_encoder_m,tip_x_m,tip_z_m\n1,1,1,1\n"), "row 1: no column 'bucket_encoder_m'");
  EXPECT_EQ(refusal("boom_encoder_m,arm_encoder_m,bucket_encoder_m,tip_x_m\n1,1,1,1\n"),
            "row 1: column 'tip_z_m' is missing beside 'tip_x'");
  EXPECT_EQ(refusal("boom_encoder_m,arm_encoder_m,bucket_encoder_m\n1,1,1\n"),
            "row 1: no surveyed point: arm_pin, bucket_pin or tip, each with _x_m and _z_m");
  EXPECT_EQ(refusal("boom_encoder_m,boom_encoder_mm,bucket_encoder_m\n1,1,1\n"),
            "row 1: column 'boom_encoder_mm' appears twice");
  EXPECT_EQ(refusal("boom_encoder,x\n1,1\n").substr(0, 37), "row 1: unknown column 'boom_encoder';");
}

}  // namespace
}  // namespace knuckle::identify
