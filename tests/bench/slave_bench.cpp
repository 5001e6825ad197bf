// One step of the slave's loop, engaged; the bench around it is not timed.
#include "tests/bench/step_budget.h"
#include "tests/slave/bench_machine.h"

namespace knuckle {
namespace {

constexpr double kSlaveBudget = 1.5;  // of a step of the peer; takes 0.9

void BM_SlaveStep(benchmark::State& bench) {
  test::BenchMachine machine;
  machine.recording = false;
  machine.engage();
  machine.hung = true;  // its own step is made here
  const auto five_milliseconds = [&] {
    for (int i = 0; i < 5; ++i) machine.tick();
  };
  test::step_within(bench, kSlaveBudget, five_milliseconds, [&] { machine.loop.step(machine.now); });
  bench.counters["engaged"] = machine.loop.mode() == Mode::kEngaged;
}
BENCHMARK(BM_SlaveStep)->UseManualTime()->Iterations(test::kBudgetSteps);

}  // namespace
}  // namespace knuckle
