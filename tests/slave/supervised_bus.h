// A CANopen client, the simulated nodes that bring it up, and every frame of theirs in the test's hands.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "core/error.h"
#include "sim/can_nodes.h"
#include "slave/canopen_client.h"
#include "tests/slave/passed.h"
#include "tests/slave/reasons.h"
#include "tests/slave/test_machine.h"
#include "transport/canopen.h"
#include "transport/virtual_can.h"

namespace knuckle::slave {

using Phase = CanopenClient::Phase;

inline constexpr std::uint8_t kValve = 0x10, kEnableNode = 0x40;
inline constexpr std::uint16_t kWell = canopen::kControlActive | canopen::kStatusReady;
inline constexpr std::uint8_t kClosedAndOn = canopen::kInputEStopClosed | canopen::kInputPilotOn;

/// A port that keeps what is sent and can be full.
class WatchedPort final : public CanBus {
 public:
  explicit WatchedPort(CanBus& port) : port_(port) {}
  bool send(const CanFrame& frame) noexcept override {
    if (full) return false;
    sent.push_back(frame);
    (void)port_.send(frame);  // the wire itself is not asked: nothing moves it on once all is up
    return true;
  }
  bool receive(CanFrame& frame) noexcept override { return port_.receive(frame); }
  [[nodiscard]] CanState state() const noexcept override { return state_now; }

  std::vector<CanFrame> sent;
  bool full = false;
  CanState state_now = CanState::kActive;

 private:
  CanBus& port_;
};

/// Limits that binary fractions say exactly: a border is a border.
inline MachineDescription machine_with_exact_limits() {
  MachineDescription d = test::test_machine();
  d.bus.sensor_age_limit_s = 0.03125;
  d.bus.sync_Hz = 256;
  d.bus.set_point_every_nth_sync = d.bus.valve_status_every_nth_sync = 2;  // a status every 2 / 256 s
  d.bus.controller_heartbeat_s = 0.0625;
  return d;
}

class SupervisedBus : public ::testing::Test {
 protected:
  explicit SupervisedBus(const MachineDescription& its_machine = machine_with_exact_limits()) : machine(its_machine) {}
  using Filter = std::function<bool(CanFrame&)>;  // false: does not arrive

  /// Up to this phase by the simulated nodes, a step every 5 ms; at most so long.
  bool bring_to(Phase phase, const Filter& arrives = {}, Duration most = 4s) {
    for (const Time end = now + most; now < end;) {
      tick();
      if (to_ms(now) % 5 != 0) continue;
      for (CanFrame frame; port.receive(frame);) {
        if (!arrives || arrives(frame)) client.receive(frame, now);
      }
      step();
      if (client.phase() == phase) return true;
    }
    return false;
  }
  static std::int64_t to_ms(Time t) { return t.time_since_epoch() / 1ms; }
  void step(const PassedCommands& commands = {}, bool enable = false) {
    client.begin_step(now);
    client.end_step(commands, enable, now);
  }
  void heartbeat(std::uint8_t id, canopen::NmtState state = canopen::NmtState::kOperational) {
    client.receive(canopen::heartbeat_frame(id, state), now);
  }
  void status(std::uint8_t id, std::uint16_t word = kWell, double spool = 0) {
    client.receive(
        canopen::valve_status_frame(canopen::tpdo1_id(id), {word, spool}, machine.bus.wire.valve_full_stroke), now);
  }
  void inputs(std::uint8_t bits = kClosedAndOn) {
    client.receive(canopen::enable_inputs_frame(canopen::tpdo1_id(kEnableNode), bits), now);
  }
  void all_live(std::uint8_t but = 0) {
    for (const std::uint8_t id : all()) {
      if (id != but) heartbeat(id);
    }
    statuses_but(0);
    inputs();
  }
  void statuses_but(std::uint8_t silent) {
    for (std::uint8_t id = kValve; id < kValve + 3; ++id) {
      if (id != silent) status(id);
    }
  }
  static std::vector<std::uint8_t> all() {
    return {0x10, 0x11, 0x12, 0x20, 0x21, 0x22, 0x23, 0x24, 0x25, 0x30, 0x31, 0x32, 0x38, 0x40};
  }
  void expect_fault(ReasonCode code, int subject, double value, double limit) {
    test::expect_reason(client.fault(), code, subject, value, limit, 1e-4);
  }
  /// All is well now; and a step, a nanosecond from now.
  void step_across_border() {
    step();
    EXPECT_TRUE(client.operational()) << text(client.fault());
    now += 1ns;
    step();
  }
  /// Operational, everything seen just now, nothing sent yet.
  void up() {
    ASSERT_TRUE(bring_to(Phase::kOperational)) << text(client.fault());
    all_live();
    step();
    ASSERT_TRUE(client.operational()) << text(client.fault());
    port.sent.clear();
  }
  void tick() {
    now += 1ms;
    nodes.step(now, {});
    bus.advance(now);
  }
  /// They miss their controller, and say so to nobody.
  void leave_nodes_alone(int ms = 300) {
    for (int i = 0; i < ms; ++i) tick();
    for (CanFrame frame; port.receive(frame);) {
    }
  }
  /// Up anew: for the next of several ways to fail.
  void up_again() {
    leave_nodes_alone();
    client.restart();
    ASSERT_EQ(client.phase(), Phase::kIdle);
    up();
  }
  std::vector<CanFrame> sent(std::uint32_t id) const {
    std::vector<CanFrame> found;
    for (const CanFrame& frame : port.sent) {
      if (frame.id == id) found.push_back(frame);
    }
    return found;
  }
  std::vector<CanFrame> sent_to_valve(int joint) const {
    return sent(canopen::rpdo1_id(static_cast<std::uint8_t>(kValve + joint)));
  }
  PassedCommands passed(int joint, double value) const {
    const PassedCommands commands = passed_now(machine, joint, value, now);
    EXPECT_EQ(commands[joint], value);
    return commands;
  }

  MachineDescription machine;
  VirtualCanBus bus{2, machine.bus.bit_rate};
  sim::CanNodes nodes{machine, {}, bus.port(1), 1};
  WatchedPort port{bus.port(0)};
  CanopenClient client{machine, port};
  Time now{1s};
};

}  // namespace knuckle::slave
