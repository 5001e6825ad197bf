// Known pulls while the machine's side runs: what it reports is held against the simulator's truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "app/studies/battery_machine.h"
#include "machine/description.h"
#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"

namespace knuckle::studies {
namespace {

using battery::Row;

Row score(const sim::MachineTruth& truth, ContactModel model, const PullPlan& plan) {
  return score_running(test::solar(), truth, model, plan, 5);
}
std::vector<double> list(const Row& row, const std::string& name) {
  return row.at(name).get<std::vector<double>>();
}
double largest(const Row& row, const std::string& name) {
  const std::vector<double> values = list(row, name);
  return *std::max_element(values.begin(), values.end());
}

TEST(RunningPulls, OfAMachineThatIsAsDrawnAreReportedWithTheirPlace) {
  const Row row = score(sim::nominal_truth(test::solar()), ContactModel::kBucketForce, {4, 1, 4, 1});
  EXPECT_EQ(list(row, "answered"), std::vector<double>(8, 1));
  EXPECT_EQ(list(row, "press_good.standing"), std::vector<double>(4, 1));
  EXPECT_EQ(list(row, "press_good.creeping"), std::vector<double>(4, 1));
  EXPECT_EQ(list(row, "press_covered"), std::vector<double>(8, 1));
  EXPECT_LT(largest(row, "free_torque_Nm"), 40);
  EXPECT_LT(largest(row, "tip_torque_error_Nm"), 60);
  EXPECT_LT(largest(row, "tip_offset_m"), 0.06);
  EXPECT_EQ(row["false_alarms"][0], 0);

  // Twice on each of five sides, by up to half a metre times some kN.
  EXPECT_EQ(list(row, "beside_torque_error_Nm").size(), 10U);
  EXPECT_EQ(list(row, "beside_torque_good"), std::vector<double>(10, 1));
  EXPECT_LT(largest(row, "beside_offset_m"), 0.06);
  EXPECT_FALSE(row.contains("side_right.linkage")) << "rods and pins lie before it";
  const std::vector<double> right = list(row, "side_right");
  EXPECT_GE(std::count(right.begin(), right.end(), 1), 8);
}

TEST(RunningPulls, AForceThatIsReportedWrongIsFound) {
  sim::MachineTruth truth = sim::nominal_truth(test::solar());
  for (sim::PressureSensorError& transmitter : truth.pressure) transmitter.gain = 1.15;
  const Row row = score(truth, ContactModel::kTipWrench, {4, 1, 2, 0});
  const std::vector<double> good = list(row, "press_good.standing");
  EXPECT_LT(std::count(good.begin(), good.end(), 1), 2) << row;
  EXPECT_FALSE(row.contains("beside_error_N"));
}

TEST(RunningPulls, AForceOfAGivenDirectionIsPulledAlongItOnly) {
  const Row row = score(sim::nominal_truth(test::solar()), ContactModel::kForceAndPosition, {4, 1, 2, 1});
  EXPECT_EQ(list(row, "answered").size(), 4U);
  EXPECT_FALSE(row.contains("beside_error_N"));
  for (const double error_N : list(row, "press_error_N.standing")) EXPECT_LT(error_N, 150);
}

}  // namespace
}  // namespace knuckle::studies
