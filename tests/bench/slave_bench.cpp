// Cost of one step of the slave's loop, engaged and moving; the bench around it is not timed.
#include <benchmark/benchmark.h>

#include <chrono>

#include "tests/slave/bench_machine.h"

namespace knuckle {
namespace {

void BM_SlaveStep(benchmark::State& bench) {
  test::BenchMachine machine;
  machine.recording = false;
  machine.engage();
  machine.hung = true;  // its own step is made here
  for (auto _ : bench) {
    for (int i = 0; i < 5; ++i) machine.tick();
    const auto start = std::chrono::steady_clock::now();
    machine.loop.step(machine.now);
    bench.SetIterationTime(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  bench.counters["engaged"] = machine.loop.mode() == Mode::kEngaged;
}
BENCHMARK(BM_SlaveStep)->UseManualTime();

}  // namespace
}  // namespace knuckle
