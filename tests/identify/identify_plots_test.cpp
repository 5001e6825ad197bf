// The figures of an identification: every axis has its label inside the picture, and no key lies on anything.
#include <gtest/gtest.h>

#include <string>

#include "app/identify/identify_output.h"
#include "tests/identify/recorded_motion.h"

namespace knuckle::identify {
namespace {

TEST(IdentifyPlots, TheFrictionOfEachCylinderHasItsLabelNoTitleThatIsCutAndOneKey) {
  Identified result;
  result.machine = test::solar();
  result.machine.dynamics_calibration.emplace();
  result.machine.dynamics_calibration->stribeck_mps.setConstant(0.01);
  result.summary.parameters.resize(1);
  const auto figures = friction_figures(result);
  ASSERT_EQ(figures.size(), 1u);
  const std::string& script = figures[0].figure.script;
  for (const std::string label : {"'boom friction, kN'", "'arm friction, kN'", "'bucket friction, kN'"})
    EXPECT_NE(script.find("set ylabel " + label), std::string::npos) << label;
  EXPECT_EQ(script.find("set title"), std::string::npos);
  EXPECT_LT(script.find("$boom using"), script.find("unset key"));
  EXPECT_LT(script.find("unset key"), script.find("$arm using"));
}

}  // namespace
}  // namespace knuckle::identify
