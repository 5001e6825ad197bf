// Breaks and mends what is behind the machine's bus, be the bus a virtual or a real one.
#pragma once

#include <cstdint>

#include "app/session/fault_kinds.h"
#include "machine/description.h"
#include "sim/simulated_machine.h"
#include "transport/faulty_ports.h"

namespace knuckle::session {

class MachineFaults {
 public:
  /// @param bus as the machine file says.
  explicit MachineFaults(const BusDescription& bus) noexcept;

  /// @param kind one behind the bus; others do nothing. @param node that it concerns; 0 where it concerns none.
  /// @param port of the machine's nodes.
  void set(FaultKind kind, std::uint8_t node, bool broken, sim::SimulatedMachine& machine, FaultyPort& port) noexcept;
  /// What has to be done again: every millisecond while it is broken.
  void keep_up(FaultKind kind, std::uint8_t node, sim::SimulatedMachine& machine, FaultyPort& port) noexcept;

 private:
  double babble_bits_per_ms_, babble_bits_ = 0;
  int babblers_ = 0;  ///< They share what is left of the bus.
};

}  // namespace knuckle::session
