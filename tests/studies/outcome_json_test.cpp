// A judged machine goes to JSON and back to the bit, numbers that JSON does not have included.
#include "app/studies/outcome_json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"

namespace knuckle::studies {
namespace {

MachineOutcome outcome() {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  MachineOutcome machine;
  machine.seed = 1'000'000'007'000'000'003U;
  machine.commissioning.lever = {0.1, 1.0 / 3, -2e-17};
  MethodOutcome method;
  method.method = kFull;
  method.identified = true;
  method.reason = "\"quoted\"";
  method.force.detection_s = {0.03, kInfinity};
  method.force.slow_rms_N = std::nan("");
  method.force.presses = {{500, 12.5, 1.5, true, false, 3}};
  method.force.contact_models = {{"tip_wrench", {{1, 2, 3, false, true, 4}}, {-kInfinity}, {}}};
  method.torque_raw.nrmse = {0.1, std::nan(""), 0.3};
  machine.methods = {method, method};
  machine.methods[1].parameters.emplace().inertia = {0.01, 0.02, 0.03};
  return machine;
}

TEST(OutcomeJson, ComesBackAsItWas) {
  const std::string text = to_json(outcome()).dump();
  const MachineOutcome back = outcome_of(nlohmann::ordered_json::parse(text));
  EXPECT_EQ(to_json(back).dump(), text);
  EXPECT_EQ(back.seed, outcome().seed);
  EXPECT_EQ(back.commissioning.lever, outcome().commissioning.lever);
  EXPECT_TRUE(std::isinf(back.methods[0].force.detection_s[1]));
  EXPECT_TRUE(std::isnan(back.methods[0].force.slow_rms_N));
  EXPECT_TRUE(back.methods[0].force.presses[0].creeping);
  EXPECT_FALSE(back.methods[0].parameters);
  EXPECT_EQ(back.methods[1].parameters->inertia[2], 0.03);
}

TEST(OutcomeJson, RefusesWhatIsNoOutcome) {
  nlohmann::ordered_json json = to_json(outcome());
  json["methods"][0]["force"]["nis"] = "much";
  EXPECT_THROW((void)outcome_of(json), InputError);
  json["methods"][0]["force"].erase("nis");
  EXPECT_THROW((void)outcome_of(json), InputError);
  EXPECT_THROW((void)outcome_of("nothing"), InputError);
}

}  // namespace
}  // namespace knuckle::studies
