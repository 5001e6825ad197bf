// The one order in which a simulated machine, its bus and whoever controls it are stepped.
#include "sim/machine_on_bus.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/error.h"
#include "machine/load.h"
#include "tests/support/places.h"
#include "tests/support/solar.h"
#include "transport/canopen.h"

namespace knuckle::sim {
namespace {

const JointVector kStart(0.3, -1.4, -0.8);

/// With pressures that are not yet those of its weight: it moves from the first millisecond on.
struct Loaded : MachineOnBus {
  explicit Loaded(CanBus* wire = nullptr) : MachineOnBus(nominal_truth(test::solar()), {}, kStart, 1, wire) {
    machine().plant().set_pull({0, -20e3});
  }
};

std::vector<std::uint32_t> received(CanBus& bus) {
  std::vector<std::uint32_t> ids;
  for (CanFrame frame; bus.receive(frame);) ids.push_back(frame.id);
  return ids;
}

TEST(MachineOnBus, TheControllerHearsWhatTheNodesSentAndTheMachineMovesAfterIt) {
  Loaded far;
  far.step(Time(1ms));
  const JointVector before = far.plant().joint_rad;
  bool heard = false, moved = true;
  far.step(Time(5ms), [&] {
    heard = !received(far.controllers_end()).empty();
    moved = far.plant().joint_rad != before;
  });
  EXPECT_TRUE(heard) << "the nodes' boot-up";
  EXPECT_FALSE(moved) << "before the controller was asked";
  EXPECT_NE(far.plant().joint_rad, before);
}

TEST(MachineOnBus, MovesInWholeMillisecondsAndMakesUpForPeriodsThatWereSkipped) {
  Loaded punctual, late;
  for (int ms = 1; ms <= 9; ++ms) punctual.step(Time(ms * 1ms));
  late.step(Time(1ms));
  late.step(Time(3700us));
  late.step(Time(9001us));
  EXPECT_EQ(late.plant().joint_rad, punctual.plant().joint_rad);
  EXPECT_EQ(late.now(), Time(9001us));
}

TEST(MachineOnBus, IsSwitchedOnAtZeroAndGoesOnTickByTickWhenSomebodyWaits) {
  const auto far = std::make_shared<Loaded>();
  std::vector<Time> ticks;
  far->each_tick = [&ticks](MachineOnBus& machine) { ticks.push_back(machine.now()); };
  BusAccess access = access_to(far);
  EXPECT_EQ(access.now(), Time{});
  EXPECT_EQ(far->now(), Time{});
  access.wait_until(Time(3ms));
  EXPECT_EQ(access.now(), Time(3ms));
  EXPECT_EQ(ticks, (std::vector<Time>{Time(1ms), Time(2ms), Time(3ms)}));
  EXPECT_FALSE(received(access.bus()).empty());
}

TEST(MachineOnBus, TakesTheBusThatItIsGiven) {
  VirtualCanBus wire(2, test::solar().bus.bit_rate);
  Loaded far(&wire.port(1));
  far.step(Time(1ms));
  far.nodes_end().cut(true);
  far.step(Time(2ms));
  wire.advance(Time(10ms));
  EXPECT_EQ(received(wire.port(0)).size(), 14U) << "one boot-up a node";
}

/// What is sent between two ticks is carried from the next one on: as if sent a millisecond later.
TEST(MachineOnBus, InAThreadOfItsOwnItTellsTheControllerTheSame) {
  ThreadedMachine threaded(nominal_truth(test::solar()), {}, kStart, 1);
  Loaded lockstep;
  const CanFrame start = canopen::nmt_frame(canopen::NmtCommand::kStart, 0), sync = canopen::sync_frame();
  const auto send = [&](CanBus& bus, int ms) {
    if (ms == 10) (void)bus.send(start);
    if (ms % 5 == 4) (void)bus.send(sync);
  };
  std::vector<std::uint32_t> here, there;
  for (int ms = 1; ms <= 60; ++ms) {
    send(threaded.controller(), ms);
    send(lockstep.controllers_end(), ms - 1);
    threaded.step(Time(ms * 1ms));
    lockstep.step(Time(ms * 1ms));
    for (const std::uint32_t id : received(threaded.controller())) there.push_back(id);
    for (const std::uint32_t id : received(lockstep.controllers_end())) here.push_back(id);
  }
  EXPECT_EQ(there, here);
  EXPECT_GT(here.size(), 100U);
}

TEST(MachineOnBus, InAThreadOfItsOwnItCarriesNoFrameBeforeItWasSent) {
  ThreadedMachine threaded(nominal_truth(test::solar()), {}, kStart, 1);
  Time carried_at = kNever;
  threaded.set_tap({[](void* at, Time now, const CanFrame& frame) {
                      if (frame.id == canopen::sync_frame().id) *static_cast<Time*>(at) = now;
                    },
                    &carried_at});
  threaded.step(Time(1ms));
  (void)threaded.controller().send(canopen::sync_frame());  // at any time until the next step
  threaded.step(Time(2ms));
  threaded.step(Time(3ms));
  EXPECT_GE(carried_at, Time(2ms));
}

TEST(MachineOnBus, RefusesAControllerWhosePeriodIsNoMultipleOfATick) {
  MachineDescription machine = test::solar();
  EXPECT_EQ(period_in_ticks(machine), 5ms);
  machine.bus.sync_Hz = 150;
  EXPECT_THROW((void)period_in_ticks(machine), InputError);
}

}  // namespace
}  // namespace knuckle::sim
