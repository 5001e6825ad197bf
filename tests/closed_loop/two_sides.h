// Both sides of a session with the person between plan and device, where a side may end and another run of it begin.
#pragma once

#include <functional>
#include <optional>

#include "app/session/loop_views.h"
#include "app/session/session_sides.h"
#include "sim/operator.h"
#include "tests/closed_loop/session_rig.h"
#include "transport/impaired_link.h"

namespace knuckle::test {

/// The person engages and sweeps, with nothing planned to fail.
inline session::SessionSetup endless_motion(std::uint64_t seed, double sweep_s) {
  session::SessionSetup setup = session_setup("link_faults", seed);
  sim::Phase engage, sweep = phase_named(setup.scenario, "cut");
  engage.kind = sim::PhaseKind::kEngage;
  sweep.until_fault = false;
  sweep.duration_s = sweep_s;
  setup.scenario.phases = {engage, sweep};
  setup.scenario.phase_names = {"engage", "moving"};
  setup.scenario.faults.clear();
  return setup;
}

struct TwoSides {
  explicit TwoSides(const session::SessionSetup& s)
      : setup(s), machine(s.truth, s.scenario.world, s.scenario.start_rad, s.seed) {
    start_master();
    start_slave();
  }

  // Another run of a side, with a session of its own; what it leads, or is led by, goes on.
  void start_master() {
    master.emplace(setup.device, setup.machine, hand.cable.host(), network.a(), another_start(), setup.law,
                   master::FarEnd::kIsThisMachine);
  }
  void start_slave() { slave.emplace(setup.machine, machine.controllers_end(), network.b(), another_start()); }

  /// One millisecond.
  void step() {
    now += 1ms;
    network.advance(now);
    if (by_plan) {
      const session::MasterView shown = session::view_of(now, *master);
      intent = person.step(now, session::person_view(shown, setup.scenario.start_rad, hand.device.truth(), 0));
    }
    hand.step(now, intent);
    if (master) master->step(now);
    machine.step(now, [this] {
      if (now.time_since_epoch() % period == 0ms && slave) slave->step(now);
    });
  }
  void run(Duration time) {
    for (const Time end = now + time; now < end;) step();
  }
  /// @return false where it is not so within that time.
  bool until(const std::function<bool()>& so, Duration patience = 30s) {
    for (const Time end = now + patience; now < end && !so();) step();
    return so();
  }
  [[nodiscard]] Mode mode() const { return slave->mode(); }
  [[nodiscard]] bool moving() const {
    return mode() == Mode::kEngaged && slave->commands().cwiseAbs().maxCoeff() > 0.1;
  }
  /// From now on the hand does what the test says, from where it is.
  void take_the_hand() {
    by_plan = false;
    intent.joint_rad = hand.device.truth().joint_rad;
    intent.rate_radps.setZero();
    intent.push_N.setZero();
  }

  session::SessionSetup setup;
  Time now{};
  bool by_plan = true;
  sim::OperatorIntent intent;
  sim::Operator person = session::operator_of(setup);
  session::HandSide hand{setup.device, setup.limb, setup.seed, setup.scenario.hand_rad};
  ImpairedLink network{setup.to_machine, setup.to_operator, setup.seed};
  Duration period = sim::period_in_ticks(setup.machine);
  sim::MachineOnBus machine;
  std::optional<master::MasterLoop> master;
  std::optional<slave::SlaveLoop> slave;

 private:
  LinkStart another_start() { return start_from(++starts_, LinkEnd::kOperator); }
  std::uint64_t starts_ = 100;
};

}  // namespace knuckle::test
