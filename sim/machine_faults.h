// Breaks and mends what is behind the machine's bus, be the bus a virtual or a real one.
#pragma once

#include <array>
#include <cstdint>

#include "machine/bus_description.h"
#include "sim/fault_kinds.h"
#include "sim/machine_on_bus.h"

namespace knuckle::sim {

class MachineFaults {
 public:
  /// @param bus_load share of the bus' time that its own frames take at worst.
  MachineFaults(const BusDescription& bus, double bus_load) noexcept;

  /// @param kind one behind the bus; others do nothing. @param node that it concerns; 0 where it concerns none.
  void set(FaultKind kind, std::uint8_t node, bool broken, MachineOnBus& far) noexcept;
  /// What has to be done again: every millisecond while it is broken.
  void keep_up(FaultKind kind, std::uint8_t node, MachineOnBus& far) noexcept;

 private:
  void send_foreign(FaultKind kind, std::uint8_t node, FaultyPort& port) noexcept;

  BusDescription bus_;
  std::array<int, 128> foreign_ms_{};  ///< By node: since somebody else's last frames to it; 0: the controller's.
  double babble_bits_per_ms_, babble_bits_ = 0;
  int babblers_ = 0;  ///< They share what is left of the bus.
};

}  // namespace knuckle::sim
