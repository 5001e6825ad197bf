// How much faster than real time the simulated machine and whole sessions run: a tick of 1 ms. Beside them MuJoCo's
// arm, which has the same links and neither oil nor friction: the peer of the rigid body alone.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>

#include "app/session/session.h"
#include "app/session/session_setup.h"
#include "machine/load.h"
#include "sim/plant.h"
#include "tests/sim/mujoco_arm.h"

namespace {

using namespace knuckle;
using namespace std::chrono_literals;

void count_ticks(benchmark::State& bench) {
  bench.counters["real_time_factor"] =
      benchmark::Counter(1e-3 * static_cast<double>(bench.iterations()), benchmark::Counter::kIsRate);
}

void plant_tick(benchmark::State& bench, sim::Family family, bool wall) {
  const MachineDescription machine = load_machine(KNUCKLE_SOURCE_DIR "/config/machines/solar015.toml");
  sim::WorldDescription world;
  const JointVector start(0.3, -1.5, -1.2);
  if (wall) {
    const sim::Plant probe(sim::sample_truth(machine, family, 1), world, start);
    world.walls.push_back({.point_m = probe.state().tip_world_m - PlanarVector(0, 0.001), .normal = {0, 1}});
    world.soil.push_back({.surface_point_m = PlanarVector(0, -3)});
  }
  sim::Plant plant(sim::sample_truth(machine, family, 1), world, start);
  plant.set_pilot(true);
  double t = 0;
  for (auto _ : bench) {
    for (int i = 0; i < 3; ++i) plant.set_valve_demand(i, 0.4 * std::sin((1.0 + 0.3 * i) * t));
    plant.step(1ms);
    t += 1e-3;
    benchmark::DoNotOptimize(plant.state());
  }
  count_ticks(bench);
}
BENCHMARK_CAPTURE(plant_tick, free, sim::Family::kSmooth, false);
BENCHMARK_CAPTURE(plant_tick, at_wall, sim::Family::kSmooth, true);
BENCHMARK_CAPTURE(plant_tick, worn_free, sim::Family::kWorn, false);
BENCHMARK_CAPTURE(plant_tick, worn_at_wall, sim::Family::kWorn, true);

/// A millisecond of MuJoCo's RK4 with the step that its accuracy is compared at.
void mujoco_tick(benchmark::State& bench) {
  sim::mujoco::MujocoArm arm;
  arm.set({0.3, -1.5, -1.2}, JointVector::Zero());
  for (auto _ : bench) {
    for (double t = 0; t < 1e-3 - 1e-9; t += sim::mujoco::kStep_s) arm.step();
    benchmark::DoNotOptimize(arm.angle());
  }
  count_ticks(bench);
}
BENCHMARK(mujoco_tick);

/// Begun anew whenever it is over.
void session_tick(benchmark::State& bench, const char* scenario, const char* family) {
  session::SimulateOptions options;
  options.scenario = scenario;
  options.family = family;
  const session::SessionSetup setup = session::load_session(options).setup;
  auto session = std::make_unique<session::Session>(setup);
  for (auto _ : bench) {
    if (session->done()) {
      bench.PauseTiming();
      session = std::make_unique<session::Session>(setup);
      bench.ResumeTiming();
    }
    session->step();
  }
  count_ticks(bench);
}
BENCHMARK_CAPTURE(session_tick, free_motion, "free_motion", "smooth");
BENCHMARK_CAPTURE(session_tick, wall_contact, "wall_contact", "smooth");
BENCHMARK_CAPTURE(session_tick, worn_wall_contact, "wall_contact", "worn");

}  // namespace
