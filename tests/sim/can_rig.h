// A bus with a bare controller, driven tick by tick, for tests of what sits at its other end: the nodes alone (CanRig)
// or the whole machine.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "machine/description.h"
#include "sim/can_nodes.h"
#include "tests/support/bus_nodes.h"
#include "transport/canopen.h"
#include "transport/virtual_can.h"

namespace knuckle::sim::rig {

inline MachineDescription bus_machine() {
  MachineDescription machine;
  machine.bus.nodes = knuckle::test::one_node_each();
  for (NodeDescription& node : machine.bus.nodes) {
    node.vendor = 0x1234;
    node.product = 0x5600U + node.id;
  }
  machine.sensors.pressure_range_Pa = 400e5;
  return machine;
}

inline std::vector<int> bytes(const CanFrame& frame) {
  return {frame.data.begin(), frame.data.begin() + frame.size};
}

struct Heard {
  Time at{};
  CanFrame frame;
};

/// The controller's side. `step_machine` is called every millisecond, after the bus has moved.
class BusRig {
 public:
  explicit BusRig(std::function<void(Time)> step_machine = {}) : bus(2, 500000), step(std::move(step_machine)) {
    bus.set_tap({[](void* self, Time at, const CanFrame& frame) {
                   static_cast<BusRig*>(self)->heard.push_back({at, frame});
                 },
                 this});
    heard.reserve(100000);
  }
  BusRig(const BusRig&) = delete;
  BusRig& operator=(const BusRig&) = delete;

  /// One millisecond.
  void tick() {
    now += 1ms;
    bus.advance(now);
    CanFrame frame;
    while (controller().receive(frame)) {
    }
    step(now);
    if (ticks_++ % 5 == 0 && syncing) send(canopen::sync_frame());
    if (ticks_ % 10 == 0 && commanding) {
      for (std::uint8_t j = 0; j < 3; ++j) send(canopen::valve_command_frame(canopen::rpdo1_id(valve(j)), command[j]));
    }
    if (ticks_ % 50 == 0 && beating) {
      send(canopen::heartbeat_frame(1, canopen::NmtState::kOperational));
      send(canopen::enable_output_frame(canopen::rpdo1_id(0x40), output));
    }
  }
  void run(Duration duration) {
    for (const Time end = now + duration; now < end;) tick();
  }
  void send(const CanFrame& frame) { controller().send(frame); }
  CanBus& controller() { return bus.port(0); }
  static std::uint8_t valve(unsigned joint) { return static_cast<std::uint8_t>(0x10 + joint); }

  /// Sends an SDO request and returns what the node answers.
  std::optional<canopen::SdoResponse> ask(const CanFrame& request) {
    const std::size_t before = heard.size();
    send(request);
    run(4ms);
    for (std::size_t i = before; i < heard.size(); ++i) {
      if (heard[i].frame.id == request.id - 0x80) return canopen::parse_sdo_response(heard[i].frame);
    }
    return std::nullopt;
  }
  /// Newest frame with this identifier since `since`.
  std::optional<Heard> newest(std::uint32_t id, Time since = Time{}) const {
    const auto found = std::find_if(heard.rbegin(), heard.rend(), [&](const Heard& h) { return h.frame.id == id; });
    if (found == heard.rend() || found->at < since) return std::nullopt;
    return *found;
  }
  std::uint16_t status_word(std::uint8_t node) const {
    const auto last = newest(canopen::tpdo1_id(node));
    return last ? canopen::parse_valve_status(last->frame)->status_word : 0xFFFF;
  }
  /// Watchdogs configured, everything operational, valves ACTIVE at rest, pilot pressure on.
  void start() {
    tick();
    for (const std::uint8_t id : ids) {
      ask(canopen::sdo_download(id, canopen::kConsumerHeartbeat, 1U << 16 | 150U, 4));
      ask(canopen::sdo_download(id, canopen::kProducerHeartbeat, 100, 2));
    }
    for (unsigned j = 0; j < 3; ++j) {
      ask(canopen::sdo_download(valve(j), canopen::kRpdo1Timer, 50, 2));
      ask(canopen::sdo_download(valve(j), canopen::kTpdo1Type, 2, 1));
    }
    ask(canopen::sdo_download(0x40, canopen::kTpdo1Timer, 50, 2));
    send(canopen::nmt_frame(canopen::NmtCommand::kStart, 0));
    syncing = commanding = beating = true;
    for (auto& c : command) c = {canopen::kControlActive, 0};
    output = 1;
    run(200ms);
  }

  VirtualCanBus bus;
  std::function<void(Time)> step;
  Time now{};
  std::vector<Heard> heard;
  PerJoint<canopen::ValveCommand> command{};
  std::uint8_t output = 0;
  bool syncing = false, commanding = false, beating = false;
  static constexpr std::array<std::uint8_t, 14> ids{0x10, 0x11, 0x12, 0x20, 0x21, 0x22, 0x23,
                                                    0x24, 0x25, 0x30, 0x31, 0x32, 0x38, 0x40};

 private:
  int ticks_ = 0;
};

/// The nodes alone; spools follow their demand with 20 ms, or spring back without pilot pressure.
class CanRig : public BusRig {
 public:
  explicit CanRig(const SensorErrors& errors = {}, std::uint64_t seed = 1)
      : nodes(bus_machine(), errors, bus.port(1), seed) {
    step = [this](Time at) {
      const NodeOutputs outputs = nodes.outputs();
      const JointVector target = outputs.pilot ? outputs.spool_demand : JointVector::Zero();
      signals.spool += (target - signals.spool) * 0.05;
      nodes.step(at, signals);
    };
  }
  CanNodes nodes;
  MachineSignals signals;
};

}  // namespace knuckle::sim::rig
