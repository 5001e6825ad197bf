// A simulated machine on its bus, stepped in the one order there is: frames arrive, whoever controls the machine hears
// and commands, the machine moves. In lock-step with a controller, or in a thread of its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "core/joints.h"
#include "core/loop_table.h"
#include "core/time.h"
#include "machine/description.h"
#include "sim/can_nodes.h"
#include "sim/plant.h"
#include "sim/truth.h"
#include "sim/world.h"
#include "transport/bus_access.h"
#include "transport/can_bus.h"
#include "transport/can_buses.h"
#include "transport/faulty_ports.h"
#include "transport/thread_wires.h"
#include "transport/virtual_can.h"

namespace knuckle::sim {

// The whole machine as the bus sees it: the plant behind its CANopen nodes. Controllers meet it only through frames.

class SimulatedMachine {
 public:
  /// @param port the nodes' side of the bus; must outlive the machine. @param seed of the sensor noise.
  /// @throws InputError as Plant does.
  SimulatedMachine(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad, CanBus& port,
                   std::uint64_t seed);

  /// Moves the plant to `now` with what the nodes asked for at the last call, then lets the nodes hear, sample and
  /// send. The first call only sets the time. Steps are multiples of 0.25 ms; call it after the bus has advanced.
  void step(Time now) noexcept;

  [[nodiscard]] Plant& plant() noexcept { return plant_; }
  [[nodiscard]] const Plant& plant() const noexcept { return plant_; }
  [[nodiscard]] CanNodes& nodes() noexcept { return nodes_; }
  [[nodiscard]] const CanNodes& nodes() const noexcept { return nodes_; }

  // Faults of the machine. False where no node has this id or its kind cannot have this fault.
  bool inject(std::uint8_t node, NodeFault fault) noexcept { return nodes_.inject(node, fault); }
  bool send_emcy(std::uint8_t node, std::uint16_t code) noexcept { return nodes_.send_emcy(node, code); }
  void set_estop(bool pressed) noexcept { nodes_.set_estop(pressed); }

 private:
  /// @param now at most a tick after the last.
  void step_once(Time now) noexcept;
  /// The transmitters' own lag.
  void feel(Duration time) noexcept;
  /// What the encoders' wires follow: askew, and slack after a reversal; their shafts have slack alone.
  void draw_wires() noexcept;
  [[nodiscard]] double ripple_Pa(std::size_t channel) const noexcept;
  [[nodiscard]] MachineSignals signals() const noexcept;

  Plant plant_;
  CanNodes nodes_;
  std::array<double, 6> felt_Pa_, share_{};  // of the way to the true pressure within felt_for_
  Duration felt_for_{};
  JointVector wire_m_, wire_mps_ = JointVector::Zero(), shaft_rad_;
  Time last_ = kNever;
};

class MachineOnBus {
 public:
  static constexpr std::size_t kControllerPort = 0, kMachinePort = 1;  ///< Of the virtual bus.

  /// @param wire bus that is there and outlives this; nullptr: a virtual one of its own. @param seed of the sensor
  /// noise. @throws InputError where truth, world and start do not fit together.
  MachineOnBus(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad,
               std::uint64_t seed, CanBus* wire = nullptr);
  MachineOnBus(const MachineOnBus&) = delete;
  MachineOnBus& operator=(const MachineOnBus&) = delete;

  /// Every tick. @param controller called once the bus has carried what was sent before; must be fit for a step.
  template <typename Controller>
  void step(Time now, const Controller& controller) noexcept {
    if (bus_) bus_->advance(now);
    if (second_) second_->advance(now);
    controller();
    // The plant moves in whole milliseconds; periods that were skipped are made up for.
    machine_.step(Time(now.time_since_epoch() / kTick * kTick));
    now_ = now;
  }
  void step(Time now) noexcept {
    step(now, [] {});
  }
  /// Tick by tick from 0 on, where the machine is switched on, for who controls it between two calls. @return due
  Time advance(Time due);
  /// Called after every tick of advance(), for who looks on or meddles.
  std::function<void(MachineOnBus&)> each_tick;

  [[nodiscard]] Time now() const noexcept { return now_; }
  [[nodiscard]] const PlantState& plant() const noexcept { return machine_.plant().state(); }
  [[nodiscard]] SimulatedMachine& machine() noexcept { return machine_; }
  [[nodiscard]] FaultyPort& nodes_end() noexcept { return nodes_end_; }
  // With virtual buses only.
  /// @param which 0, or 1 where there are two
  [[nodiscard]] VirtualCanBus& bus(std::size_t which = 0) noexcept { return which == 0 ? *bus_ : *second_; }
  [[nodiscard]] CanBus& controllers_end() noexcept { return *controllers_end_; }
  /// Of both buses; those of the second have kSecondBus. Between two of a tick their order is not that of time.
  void set_tap(CanTap tap) noexcept;

 private:
  [[nodiscard]] CanBus& make_buses(const BusDescription& bus);

  std::optional<VirtualCanBus> bus_, second_;
  std::optional<CanBuses> controllers_end_, nodes_ends_;
  CanTap tap_;
  FaultyPort nodes_end_;
  SimulatedMachine machine_;
  Time now_ = kNever;
};

/// Period of a controller in lock-step with it. @throws InputError where it is no multiple of a tick.
[[nodiscard]] Duration period_in_ticks(const MachineDescription& machine);

/// Access to the bus of a simulated machine, or both as one, that goes on when somebody waits.
[[nodiscard]] BusAccess access_to(std::shared_ptr<MachineOnBus> machine);
/// To one alone. @param which 0, or 1 where there are two
[[nodiscard]] BusAccess access_to(std::shared_ptr<MachineOnBus> machine, std::size_t which);

/// A machine on a virtual bus in a thread of its own: a loop in another thread meets it as on the machine, through a
/// CAN controller.
class ThreadedMachine {
 public:
  ThreadedMachine(const MachineTruth& truth, const WorldDescription& world, const JointVector& start_rad,
                  std::uint64_t seed)
      : machine_(truth, world, start_rad, seed) {}

  /// For the thread of the loop.
  [[nodiscard]] CanBus& controller() noexcept { return can_.controller(); }

  // For the thread of the machine.
  /// Its ticks are due so long after the loops' steps: what these send does not wait long, and what the nodes answer
  /// is there before the next step.
  static constexpr Duration kPhase = kTick / 2;
  /// Every tick. What was sent since the last one is carried from now on: earlier, a frame might be seen on the bus
  /// before it was sent.
  void step(Time now) noexcept {
    machine_.step(now, [this] { can_.exchange(machine_.controllers_end()); });
  }
  [[nodiscard]] const PlantState& plant() const noexcept { return machine_.plant(); }
  /// Before the first step.
  void set_tap(CanTap tap) noexcept { machine_.set_tap(tap); }

 private:
  ThreadCan can_;
  MachineOnBus machine_;
};

}  // namespace knuckle::sim
