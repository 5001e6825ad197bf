// Cost of one estimator step in the slave's loop.
#include <benchmark/benchmark.h>

#include <chrono>
#include <vector>

#include "core/quantile.h"
#include "estimation/payload.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

std::vector<JointState> moving_states() {
  SyntheticMachine machine(test_machine(), real_sensors());
  JointStateFilter filter(test_machine(), SyntheticMachine::kStep_s, kSlowVelocity_Hz);
  const SineMotion motion;
  std::vector<JointState> states;
  for (int n = 0; n < 4000; ++n)
    states.push_back(*filter.step(machine.measure(motion.at(n * SyntheticMachine::kStep_s), JointVector::Zero())));
  return states;
}

void BM_ForceEstimator(benchmark::State& bench) {
  const std::vector<JointState> states = moving_states();
  ForceEstimator estimator(test_machine(), SyntheticMachine::kStep_s);
  std::size_t n = 0;
  for (auto _ : bench) benchmark::DoNotOptimize(estimator.step(states[n++ % states.size()]).tip_N.data());
}
BENCHMARK(BM_ForceEstimator);

/// Each step by itself, as the loop meets it: with the payload estimator, timed one by one (the clock's own 20-50 ns
/// included), quantiles as counters.
void BM_ForceAndPayloadQuantiles(benchmark::State& bench) {
  const std::vector<JointState> states = moving_states();
  ForceEstimator estimator(test_machine(), SyntheticMachine::kStep_s);
  PayloadEstimator payload(test_machine(), SyntheticMachine::kStep_s);
  std::vector<double> step_us;
  step_us.reserve(2'000'000);
  std::size_t n = 0;
  for (auto _ : bench) {
    const JointState& state = states[n++ % states.size()];
    const auto start = std::chrono::steady_clock::now();
    payload.step(state, estimator.step(state));
    const auto end = std::chrono::steady_clock::now();
    step_us.push_back(std::chrono::duration<double, std::micro>(end - start).count());
  }
  bench.counters["p50_us"] = quantile(step_us, 0.5);
  bench.counters["p99_us"] = quantile(step_us, 0.99);
  bench.counters["p99.9_us"] = quantile(step_us, 0.999);
}
BENCHMARK(BM_ForceAndPayloadQuantiles);

void BM_Payload(benchmark::State& bench) {
  const std::vector<JointState> states = moving_states();
  PayloadEstimator payload(test_machine(), SyntheticMachine::kStep_s);
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
  JointStateFilter filter(test_machine(), SyntheticMachine::kStep_s, kSlowVelocity_Hz);
  const Measurement measurement = machine.measure(SineMotion{}.at(1), JointVector::Zero());
  for (auto _ : bench) benchmark::DoNotOptimize(filter.step(measurement));
}
BENCHMARK(BM_JointState);

}  // namespace
}  // namespace knuckle::estimation
