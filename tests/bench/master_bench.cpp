// One step of the master's loop, and of the simulated hand and device it works with.
#include "tests/bench/step_budget.h"
#include "tests/master/master_rig.h"

namespace knuckle {
namespace {

constexpr double kMasterBudget = 0.25;  // of a step of the peer; takes 0.14

/// The rig's own tick around the loop is not counted.
void master_step(benchmark::State& bench) {
  test::MasterRig rig;
  rig.engage();
  rig.follow = false;
  rig.machine.position_rad = rig.heard.position_rad + JointVector(0.01, 0, 0);
  rig.machine.tip_force_N = PlanarVector(0, 2000);
  rig.run(2);
  int tick = 0;
  const auto around_it = [&] {
    rig.now += 1ms;
    rig.cable.advance();
    rig.network.advance(rig.now);
    rig.hand.step(rig.now, rig.intent);
    if (++tick % 5 == 0) rig.tell();
    while (rig.network.b().receive(rig.datagram)) {
    }
  };
  test::step_within(bench, kMasterBudget, around_it, [&] { rig.loop.step(rig.now); });
}
BENCHMARK(master_step)->UseManualTime()->Iterations(test::kBudgetSteps);

void master_tick_with_hand_and_links(benchmark::State& state) {
  test::MasterRig rig;
  rig.engage();
  for (auto _ : state) rig.tick();
}
BENCHMARK(master_tick_with_hand_and_links);

void hand_and_device_step(benchmark::State& state) {
  HidPair cable;
  sim::HandAndDevice hand(test::desk_device(), test::steady_limb(), cable.device(), 1, test::kMidPosture);
  sim::OperatorIntent intent;
  intent.joint_rad = test::kMidPosture + JointVector(0.01, 0, 0);
  intent.presence = true;
  HidReport report;
  Time now{};
  for (auto _ : state) {
    now += 1ms;
    cable.advance();
    hand.step(now, intent);
    while (cable.host().read(report)) {
    }
  }
}
BENCHMARK(hand_and_device_step);

}  // namespace
}  // namespace knuckle
