// Who is about to command listens first, and leaves a machine that somebody leads as it is.
#include "slave/bus_listen.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/slave/bench_machine.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;

/// On the third port of the machine's bus.
BusAccess stranger_on(BenchMachine& m) {
  return {"can0", {std::shared_ptr<void>(), &m.bus.port(2)}, [&m](Time due) {
            while (m.now < due) m.tick();
            return m.now;
          }};
}

TEST(ListensFirst, AMachineThatIsLedIsLeftAloneInOneLineThatSaysWhatWasHeard) {
  BenchMachine m;
  ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
  BusAccess access = stranger_on(m);
  for (CanFrame before; m.bus.port(2).receive(before);) {
  }
  const std::string said = test::refusal([&] { refuse_other_controller(m.description.bus, access); });
  EXPECT_EQ(said,
            "can0: another controller is on the bus: heard SYNC 0x080, set-point 0x210, set-point 0x211, set-point "
            "0x212, set-point 0x240, heartbeat 0x701; stop it, then start again");
  m.run(1s);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.fault());
}

TEST(ListensFirst, NodesAndWhoeverReadsThemAreNoController) {
  BenchMachine m;
  m.hung = true;
  BusAccess access = stranger_on(m);
  m.bus.port(0).send(canopen::sdo_upload(0x10, canopen::kDeviceType));
  ASSERT_TRUE(m.nodes.send_emcy(0x25, 0x5030));
  EXPECT_EQ(heard_of_other_controller(m.description.bus, access), "");
  EXPECT_NO_THROW(refuse_other_controller(m.description.bus, access));
  EXPECT_EQ(m.frames(0x590).size(), 1U) << "the bus was alive";
}

TEST(ListensFirst, EachFrameThatOnlyAControllerSendsIsEnoughAndTwoPeriodsAreHeard) {
  const std::pair<CanFrame, const char*> frames[] = {
      {canopen::nmt_frame(canopen::NmtCommand::kResetNode, 0), "NMT 0x000"},
      {canopen::sync_frame(), "SYNC 0x080"},
      {canopen::heartbeat_frame(1, canopen::NmtState::kOperational), "heartbeat 0x701"},
      {canopen::valve_command_frame(0x212, {}), "set-point 0x212"},
      {canopen::enable_output_frame(0x240, 0), "set-point 0x240"}};
  for (const auto& [frame, name] : frames) {
    BenchMachine m;
    m.hung = true;
    BusAccess access = stranger_on(m);
    const Time start = m.now;
    BusAccess slow("can0", {std::shared_ptr<void>(), &m.bus.port(2)}, [&, sent = false](Time due) mutable {
      access.wait_until(due);
      // Two periods of a heartbeat after it began, and no sooner.
      if (!sent && access.now() - start >= from_seconds(2 * m.description.bus.controller_heartbeat_s)) {
        sent = true;
        m.bus.port(0).send(frame);
      }
      return access.now();
    });
    EXPECT_EQ(heard_of_other_controller(m.description.bus, slow), name);
  }
}

TEST(ListensFirst, WhatAProgramThatWasKilledLeftInTheInterfacesQueueIsNoControllerAsItDoesNotGoOn) {
  BenchMachine m;
  m.hung = true;
  BusAccess access = stranger_on(m);
  for (const CanFrame& left : {canopen::valve_command_frame(0x210, {}), canopen::enable_output_frame(0x240, 0),
                               canopen::heartbeat_frame(1, canopen::NmtState::kOperational), canopen::sync_frame()})
    ASSERT_TRUE(m.bus.port(0).send(left));
  EXPECT_NO_THROW(refuse_other_controller(m.description.bus, access));
  EXPECT_EQ(m.frames(canopen::kSyncId).size(), 1U) << "it was there to be heard";
}

TEST(ListensFirst, SendsNothing) {
  BenchMachine m;
  m.hung = true;
  m.run(50ms);
  m.wire.clear();
  BusAccess access = stranger_on(m);
  (void)heard_of_other_controller(m.description.bus, access);
  EXPECT_TRUE(m.wire.empty());
}

TEST(RealMachine, WithoutTheTransmittersOfACylinderIsLedOnlyOnceItIsIdentified) {
  MachineDescription machine = test::test_machine();
  EXPECT_NO_THROW(refuse_unidentified(machine));
  machine.source = "m.toml";
  machine.sensors.without_pressures = kArm;
  EXPECT_TRUE(test::begins(knuckle::test::refusal([&] { refuse_unidentified(machine); }),
                           "m.toml: key 'sensors.without_pressures' = \"arm\": "));
  machine.dynamics_calibration.emplace();
  EXPECT_NO_THROW(refuse_unidentified(machine));
}

}  // namespace
}  // namespace knuckle::slave
