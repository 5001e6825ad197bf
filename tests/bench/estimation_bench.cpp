// Cost of one estimator step in the slave's loop.
#include <vector>

#include "estimation/payload.h"
#include "tests/bench/step_budget.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

constexpr double kEstimationBudget = 0.75;  // of a step of the peer; takes 0.44

std::vector<JointState> moving_states() {
  SyntheticMachine machine(test_machine(), real_sensors());
  JointStateFilter filter(test_machine(), kStep_s, kSlowVelocity_Hz);
  const SineMotion motion;
  std::vector<JointState> states;
  for (int n = 0; n < 4000; ++n)
    states.push_back(*filter.step(machine.measure(motion.at(n * kStep_s), JointVector::Zero())));
  return states;
}

/// As the loop has them: force and payload of each state.
void BM_ForceAndPayload(benchmark::State& bench) {
  const std::vector<JointState> states = moving_states();
  ForceEstimator estimator(test_machine(), kStep_s);
  PayloadEstimator payload(test_machine(), kStep_s);
  std::size_t n = 0;
  const auto step = [&] { payload.step(states[n], estimator.step(states[n])); };
  test::step_within(
      bench, kEstimationBudget, [&] { n = (n + 1) % states.size(); }, step);
}
BENCHMARK(BM_ForceAndPayload)->UseManualTime()->Iterations(test::kBudgetSteps);

void BM_Payload(benchmark::State& bench) {
  const std::vector<JointState> states = moving_states();
  PayloadEstimator payload(test_machine(), kStep_s);
  ForceEstimate force;
  std::size_t n = 0;
  for (auto _ : bench) {
    payload.step(states[n++ % states.size()], force);
    benchmark::DoNotOptimize(payload.kg());
  }
}
BENCHMARK(BM_Payload);

void BM_JointState(benchmark::State& bench) {
  SyntheticMachine machine(test_machine(), real_sensors());
  JointStateFilter filter(test_machine(), kStep_s, kSlowVelocity_Hz);
  const Measurement measurement = machine.measure(SineMotion{}.at(1), JointVector::Zero());
  for (auto _ : bench) benchmark::DoNotOptimize(filter.step(measurement));
}
BENCHMARK(BM_JointState);

}  // namespace
}  // namespace knuckle::estimation
