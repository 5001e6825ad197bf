// A budget for the step of each loop: a multiple of one step of MuJoCo's arm, which has the same three joints. Both are
// timed in turns in one run, so that neither the computer nor what else runs on it counts.
#pragma once

#include <benchmark/benchmark.h>

#include <chrono>
#include <string>
#include <vector>

#include "core/quantile.h"
#include "tests/sim/mujoco_arm.h"

namespace knuckle::test {

/// So many that a median says something.
inline constexpr benchmark::IterationCount kBudgetSteps = 20000;

/// Counters: medians, and their ratio. An error where that is above `most`.
/// @param prepare is not timed.
template <typename Prepare, typename Step>
void step_within(benchmark::State& bench, double most, const Prepare& prepare, const Step& step) {
  sim::mujoco::MujocoArm peer;
  peer.set({0.3, -1.5, -1.2}, JointVector::Zero());
  std::vector<double> steps_us, peers_us;
  const auto timed = [](std::vector<double>& all_us, const auto& call) {
    const auto start = std::chrono::steady_clock::now();
    call();
    all_us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
  };
  for (auto _ : bench) {
    prepare();
    timed(steps_us, step);
    timed(peers_us, [&] { peer.step(); });
    bench.SetIterationTime(1e-6 * steps_us.back());
  }
  const double ratio = median(steps_us) / median(peers_us);
  bench.counters["p50_us"] = median(steps_us);
  bench.counters["p99_us"] = quantile(steps_us, 0.99);
  bench.counters["x_mujoco"] = ratio;
  if (ratio > most) bench.SkipWithError(("takes " + std::to_string(ratio) + " steps of MuJoCo's arm").c_str());
}

}  // namespace knuckle::test
