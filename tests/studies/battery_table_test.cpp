// The battery's table from outcomes made by hand: what is not answered is missed, what fails is not left out.
#include "app/studies/battery_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace knuckle::studies {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kFullScale_kg = 150;

MachineOutcome machine_with(const MethodOutcome& method) {
  MachineOutcome machine;
  machine.methods.push_back(method);
  return machine;
}

MethodOutcome good_full() {
  MethodOutcome method;
  method.method = kFull;
  method.identified = method.usable = true;
  method.force.slow_rms_N = 20;
  method.force.digging_rms_N = 30;
  method.force.presses = {{.force_N = 2000, .error_N = 50, .direction_deg = 1, .creeping = true, .covered = true}};
  method.force.detection_s = {0.03, 0.03, 0.03};
  method.force.free_s = 600;
  method.force.payload_error_kg = {0.5, -0.5};
  method.force.payload_sigma_kg = {0.4, 0.4};
  return method;
}

const BatteryRow& row(const std::vector<BatteryRow>& rows, const std::string& start) {
  for (const BatteryRow& r : rows) {
    if (r.quantity.starts_with(start) && r.method == kFull) return r;
  }
  throw std::runtime_error("no row " + start);
}

TEST(BatteryTable, CountsAnUnansweredPressAsMissed) {
  MethodOutcome method = good_full();
  const std::string creeping = "known force 1-5 kN within max(3 %, 60 N) and 3 deg, creeping";
  EXPECT_EQ(row(battery_rows({machine_with(method)}, kFullScale_kg), creeping).value, 1);
  method.force.presses.push_back({.force_N = 2000, .error_N = kNaN, .direction_deg = kNaN, .creeping = true});
  const auto rows = battery_rows({machine_with(method)}, kFullScale_kg);
  EXPECT_EQ(row(rows, creeping).value, 0.5);
  EXPECT_EQ(row(rows, creeping).met, false);
}

TEST(BatteryTable, CountsAPullThatAContactModelRefusesAsMissed) {
  MethodOutcome method = good_full();
  ContactModelScore wrench;
  wrench.model = "tip_wrench";
  wrench.presses = {score_pull({0, 2000}, {30, 2000}, false), score_pull({0, 2000}, {kNaN, kNaN}, false)};
  wrench.torque_Nm = {12};
  method.force.contact_models = {wrench};
  const auto rows = battery_rows({machine_with(method)}, kFullScale_kg);
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

TEST(BatteryTable, SaysThatAMachineWithoutAUsableResultIsATargetMissed) {
  MethodOutcome failed;
  failed.method = kFull;
  const auto rows = battery_rows({machine_with(good_full()), machine_with(failed)}, kFullScale_kg);
  EXPECT_EQ(row(rows, "machines with a usable result").value, 0.5);
  EXPECT_EQ(row(rows, "machines with a usable result").met, false);
}

TEST(BatteryTable, JudgesAResultThatHeldOutMotionSpeaksAgainstButDoesNotCallItUsable) {
  MethodOutcome against = good_full();
  against.usable = false;
  against.force.slow_rms_N = 1000;
  const auto rows =
      battery_rows({machine_with(against), machine_with(against), machine_with(good_full())}, kFullScale_kg);
  EXPECT_NEAR(row(rows, "machines with a usable result").value, 1.0 / 3, 1e-12);
  EXPECT_EQ(row(rows, "no-load tip force, slow, RMS, median").value, 1000);
}

TEST(BatteryTable, CountsAMachineThatFailedAltogether) {
  MachineOutcome failed;
  failed.failure = "did not engage";
  const auto rows = battery_rows({machine_with(good_full()), failed}, kFullScale_kg);
  EXPECT_EQ(row(rows, "machines with a usable result").met, false);
}

TEST(BatteryTable, TakesAStepThatWasNeverSeenAsInfinitelyLate) {
  MethodOutcome method = good_full();
  method.force.detection_s = {0.03, std::numeric_limits<double>::infinity()};
  const auto rows = battery_rows({machine_with(method)}, kFullScale_kg);
  EXPECT_EQ(row(rows, "500 N step seen after, p95").met, false);
}

TEST(BatteryTable, TellsPayloadAsTwoSigmaOfFullScale) {
  const auto rows = battery_rows({machine_with(good_full())}, kFullScale_kg);
  EXPECT_NEAR(row(rows, "payload error").value, 100 * 2 * 0.5 / 150, 1e-9);
}

TEST(BatteryTable, JudgesMediansAndTailsOfMachines) {
  std::vector<MachineOutcome> machines;
  for (int i = 1; i <= 20; ++i) {
    MethodOutcome method = good_full();
    method.force.slow_rms_N = i;
    machines.push_back(machine_with(method));
  }
  const auto rows = battery_rows(machines, kFullScale_kg);
  EXPECT_EQ(row(rows, "no-load tip force, slow, RMS, median").value, 10);
  EXPECT_EQ(row(rows, "no-load tip force, slow, RMS, p95").value, 19);
}

}  // namespace
}  // namespace knuckle::studies
