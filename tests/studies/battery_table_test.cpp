// The battery's table from machines made by hand: what is not answered is missed, what fails is not left out.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/identify/commission.h"
#include "app/studies/battery_machine.h"
#include "app/studies/force_scores.h"
#include "tests/support/solar.h"

namespace knuckle::studies {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kFullScale_kg = 150;

Row machine_with(const Row& metrics, bool identified = true, bool usable = true) {
  Row method{{"method", kFull}, {"identified", identified}, {"usable", usable}, {"metrics", metrics}}, machine;
  machine["seed"] = 1U;
  machine["commissioning"] = Row::object();
  machine["methods"] = Row::array({method});
  return machine;
}

Row good() {
  Row metrics{{"slow_rms_N", 20},
              {"digging_rms_N", 30},
              {"detection_s", {0.03, 0.03, 0.03}},
              {"false_alarms", {0, 600}},
              {"payload_error_kg", {0.5, -0.5}}};
  add_presses({{.force_N = 2000, .error_N = 50, .direction_deg = 1, .creeping = true}}, metrics);
  return metrics;
}

const BatteryRow& row(const std::vector<BatteryRow>& rows, const std::string& start) {
  for (const BatteryRow& r : rows) {
    if (r.quantity.starts_with(start) && r.method == kFull) return r;
  }
  throw std::runtime_error("no row " + start);
}

TEST(BatteryTable, CountsAnUnansweredPressAsMissed) {
  const std::string creeping = "known force 1-5 kN within max(3 %, 60 N) and 3 deg, creeping";
  EXPECT_EQ(row(battery_rows({machine_with(good())}, kFullScale_kg), creeping).value, 1);
  Row metrics = good();
  add_presses({{.force_N = 2000, .error_N = 50, .direction_deg = 1, .creeping = true},
               {.force_N = 2000, .error_N = kNaN, .direction_deg = kNaN, .creeping = true}},
              metrics);
  const auto rows = battery_rows({machine_with(metrics)}, kFullScale_kg);
  EXPECT_EQ(row(rows, creeping).value, 0.5);
  EXPECT_EQ(row(rows, creeping).met, false);
}

TEST(BatteryTable, CountsAPullThatAContactModelRefusesAsMissed) {
  Row wrench{{"answered", {1, 0}}, {"torque_Nm", Row::array({12})}}, metrics = good();
  add_presses({score_pull({0, 2000}, {30, 2000}, false), score_pull({0, 2000}, {kNaN, kNaN}, false)}, wrench);
  metrics["contact_models"]["tip_wrench"] = wrench;
  const auto rows = battery_rows({machine_with(metrics)}, kFullScale_kg);
  const auto value = [&](const std::string& quantity) {
    for (const BatteryRow& r : rows) {
      if (r.method == "full, tip_wrench" && r.quantity.starts_with(quantity)) return r.value;
    }
    throw std::runtime_error("no row " + quantity);
  };
  EXPECT_EQ(value("known force 1-5 kN, answered"), 0.5);
  EXPECT_EQ(value("known force 1-5 kN within max(3 %, 60 N) and 3 deg, standing"), 0.5);
  EXPECT_EQ(value("false torque about the tip, p95"), 12);
}

TEST(BatteryTable, SaysThatAMachineWithoutAUsableResultIsATargetMissedAlsoWhereItFailedAltogether) {
  for (const Row& other :
       {machine_with(Row::object(), false, false), Row{{"seed", 2}, {"failure", "did not engage"}}}) {
    const auto rows = battery_rows({machine_with(good()), other}, kFullScale_kg);
    EXPECT_EQ(row(rows, "machines with a usable result").value, 0.5);
    EXPECT_EQ(row(rows, "machines with a usable result").met, false);
  }
}

TEST(BatteryTable, JudgesAResultThatHeldOutMotionSpeaksAgainstButDoesNotCallItUsable) {
  Row metrics = good();
  metrics["slow_rms_N"] = 1000;
  const Row against = machine_with(metrics, true, false);
  const auto rows = battery_rows({against, against, machine_with(good())}, kFullScale_kg);
  EXPECT_NEAR(row(rows, "machines with a usable result").value, 1.0 / 3, 1e-12);
  EXPECT_EQ(row(rows, "no-load tip force, slow, RMS, median").value, 1000);
}

TEST(BatteryTable, JudgesMediansAndTailsOfMachinesAndPayloadAsTwoSigmaOfFullScale) {
  std::vector<Row> machines;
  for (int i = 1; i <= 20; ++i) {
    Row metrics = good();
    metrics["slow_rms_N"] = i;
    machines.push_back(machine_with(metrics));
  }
  const auto rows = battery_rows(machines, kFullScale_kg);
  EXPECT_EQ(row(rows, "no-load tip force, slow, RMS, median").value, 10);
  EXPECT_EQ(row(rows, "no-load tip force, slow, RMS, p95").value, 19);
  EXPECT_NEAR(row(rows, "payload error").value, 100 * 2 * 0.5 / 150, 1e-9);
}

TEST(BatteryTable, LeavesOutWhatWasNotMeasuredMissesATargetAskedForAndTakesAStepNeverSeenAsInfinitelyLate) {
  Row metrics = good();
  metrics.erase("payload_error_kg");
  metrics.erase("slow_rms_N");
  metrics["detection_s"] = metric({0.03, std::numeric_limits<double>::infinity()});
  const auto rows = battery_rows({machine_with(Row::parse(metrics.dump()))}, kFullScale_kg);
  EXPECT_EQ(row(rows, "500 N step seen after, p95").met, false);
  EXPECT_THROW((void)row(rows, "payload error"), std::runtime_error);
  EXPECT_TRUE(std::isnan(row(rows, "no-load tip force, slow, RMS, median").value));
  EXPECT_EQ(row(rows, "no-load tip force, slow, RMS, median").met, false);
}

TEST(BatteryMachine, IsCommissionedAndJudgedByEveryMethod) {
  BatterySetup setup;
  setup.nominal = test::solar();
  identify::set_surveyor(setup.family, setup.commission);
  setup.trials.slow_s = setup.trials.digging_s = 5;
  setup.trials.presses = 2;
  setup.trials.knocks = setup.trials.lifts = 1;
  setup.full.usual_errors = setup.full_nominal_pins.usual_errors = false;  // for the sake of time
  const Row judged = judge_machine(setup, sim::sample_truth(setup.nominal, 1), 1);
  ASSERT_TRUE(is_judged_machine(judged)) << judged;
  ASSERT_FALSE(judged.contains("failure")) << judged;
  std::vector<std::string> methods;
  for (const Row& method : judged["methods"]) methods.push_back(method["method"]);
  for (const char* method : {kFull, kFullNominalPins, kFullFineEncoders, kUncalibrated})
    EXPECT_EQ(std::count(methods.begin(), methods.end(), method), 1) << method;
  const auto rows = battery_rows({judged}, setup.nominal.payload_full_scale_kg);
  EXPECT_EQ(row(rows, "machines with a usable result").value, 1);
  EXPECT_TRUE(std::isfinite(row(rows, "no-load tip force, slow, RMS, median").value));
}

TEST(BatteryMachine, RefusesWhatIsNoJudgedMachine) {
  const Row machine = machine_with(good());
  EXPECT_TRUE(is_judged_machine(machine));
  EXPECT_TRUE(is_judged_machine({{"seed", 2U}, {"failure", "did not engage"}}));
  for (const auto& [where, wrong] :
       std::vector<std::pair<std::string, Row>>{{"/seed", "one"},
                                                {"/commissioning", Row()},
                                                {"/commissioning/flow", "much"},
                                                {"/methods", "full"},
                                                {"/methods/0/usable", 1},
                                                {"/methods/0/metrics/slow_rms_N", "much"},
                                                {"/methods/0/metrics/detection_s", Row::array({true})}}) {
    Row spoilt = machine;
    spoilt[Row::json_pointer(where)] = wrong;
    EXPECT_FALSE(is_judged_machine(spoilt)) << where;
  }
}

}  // namespace
}  // namespace knuckle::studies
