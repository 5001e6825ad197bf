// A machine bus to work on, and what makes its time pass: a real interface in real time, or the simulated machine on
// virtual time. What uses it cannot tell which.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/time.h"
#include "machine/description.h"
#include "sim/simulated_machine.h"
#include "transport/can_bus.h"
#include "transport/virtual_can.h"

namespace knuckle::bringup {

class BusAccess {
 public:
  /// @param wait returns at `due` or later, with the time it is then. @param name for people: "can0", "simulated bus".
  BusAccess(std::string name, std::shared_ptr<CanBus> bus, std::function<Time(Time due)> wait)
      : name_(std::move(name)), bus_(std::move(bus)), wait_(std::move(wait)), now_(wait_(Time{})) {}

  /// What a person at the machine does by hand; where there is a person, nothing.
  std::function<void(bool pressed)> press_e_stop = [](bool) {};
  /// Pin-to-pin length of a cylinder as its tape says; nullopt where a person has to say it.
  std::function<std::optional<double>(int joint)> tape_m = [](int) { return std::nullopt; };

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] CanBus& bus() const noexcept { return *bus_; }
  [[nodiscard]] Time now() const noexcept { return now_; }
  void wait_until(Time due) { now_ = wait_(due); }

 private:
  std::string name_;
  std::shared_ptr<CanBus> bus_;
  std::function<Time(Time)> wait_;
  Time now_;
};

/// The simulated machine at the far end of a virtual bus.
struct SimulatedBus {
  static constexpr std::size_t kControllerPort = 0, kMachinePort = 1;
  SimulatedBus(const sim::MachineTruth& truth, const JointVector& start_rad, std::uint64_t seed);
  /// In steps of a millisecond.
  Time advance(Time due);

  VirtualCanBus bus;
  sim::SimulatedMachine machine;
  Time now{};
  /// Called after every millisecond; for tests.
  std::function<void(SimulatedBus&)> each_ms;
};

[[nodiscard]] BusAccess simulated_access(std::shared_ptr<SimulatedBus> simulated);
/// In the middle of its range. @param read the machine file as it was read, not calibrated: what was calibrated on this
/// machine must not make it another one.
[[nodiscard]] BusAccess simulated_access(const MachineDescription& read, std::uint64_t seed);
/// @throws InputError where there is no such CAN interface or it cannot be opened.
[[nodiscard]] BusAccess real_access(const std::string& interface);

}  // namespace knuckle::bringup
