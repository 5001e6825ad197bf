// How much faster than real time the simulated machine runs: one tick of 1 ms, free and pressing on a wall.
#include <benchmark/benchmark.h>

#include <cmath>

#include "machine/load.h"
#include "sim/plant.h"

namespace {

using namespace knuckle;
using namespace std::chrono_literals;

void plant_tick(benchmark::State& bench, bool wall) {
  const MachineDescription machine = load_machine(KNUCKLE_SOURCE_DIR "/config/machines/solar015.toml");
  sim::WorldDescription world;
  const JointVector start(0.3, -1.5, -1.2);
  if (wall) {
    const sim::Plant probe(sim::sample_truth(machine, 1), world, start);
    world.walls.push_back({.point_m = probe.state().tip_world_m + PlanarVector(0.001, 0)});
    world.soil.push_back({.surface_point_m = PlanarVector(0, -3)});
  }
  sim::Plant plant(sim::sample_truth(machine, 1), world, start);
  plant.set_pilot(true);
  double t = 0;
  for (auto _ : bench) {
    for (int i = 0; i < 3; ++i) plant.set_valve_demand(i, 0.4 * std::sin((1.0 + 0.3 * i) * t));
    plant.step(1ms);
    t += 1e-3;
    benchmark::DoNotOptimize(plant.state());
  }
  bench.counters["real_time_factor"] =
      benchmark::Counter(1e-3 * static_cast<double>(bench.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK_CAPTURE(plant_tick, free, false);
BENCHMARK_CAPTURE(plant_tick, at_wall, true);

}  // namespace
