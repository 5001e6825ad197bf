// A machine bus to work on, and what makes its time pass: a real interface in real time, or a simulated machine's bus
// on virtual time. What uses it cannot tell which.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/time.h"
#include "transport/can_bus.h"

namespace knuckle {

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

/// @throws InputError where there is no such CAN interface or it cannot be opened.
[[nodiscard]] BusAccess real_access(const std::string& interface);

}  // namespace knuckle
