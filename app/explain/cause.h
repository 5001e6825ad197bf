// The most likely cause of a stop, from what the wires say; the fault's code only tells where to look first.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/explain/evidence.h"
#include "app/explain/window.h"
#include "machine/description.h"

namespace knuckle::explain {

struct Cause {
  std::string id;                     ///< Stable, for JSON: "node_silent".
  std::string text;                   ///< What happened, and what to check.
  std::vector<std::string> supports;  ///< What speaks for it.
  std::vector<std::string> against;   ///< What speaks against it, or looks the same and cannot be told from it.
  Time since{};                       ///< First sign of it on the wires.
};

[[nodiscard]] Cause likely_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                 const MachineDescription& machine);

// Causes on the bus itself: who else speaks there.

/// nullopt where the stop has another reason than somebody else on the bus.
[[nodiscard]] std::optional<Cause> bus_cause(const Stop& stop, const Window& window, const MachineDescription& machine);

/// Likewise by J1939: who sends a group, and whose an address is.
[[nodiscard]] std::optional<Cause> j1939_cause(const Stop& stop, const Window& window,
                                               const MachineDescription& machine);

// Causes at the haptic device.

/// nullopt where the stop has another reason than the device.
[[nodiscard]] std::optional<Cause> device_cause(const Stop& stop, const Window& window, const Evidence& evidence);

// Causes between the two sides: network, programs, what the operator's side sends.

/// nullopt where the stop has another reason than the link.
[[nodiscard]] std::optional<Cause> link_cause(const Stop& stop, const Window& window, const Evidence& evidence);

// Causes at frames that the machine sends by itself, and what they say of those that it is told by.

/// nullopt where the stop's reason is about no such frame, or the frame shows nothing.
[[nodiscard]] std::optional<Cause> frame_cause(const Stop& stop, const Evidence& evidence,
                                               const MachineDescription& machine);

/// What ends the motion of a machine that is led by frames when they stop; empty of one that is led by valve nodes.
[[nodiscard]] std::string own_guard_text(const BusDescription& bus);

// Causes at a node of the machine's bus, at its sensor or valve, or at all of them.

/// nullopt where no node shows anything.
[[nodiscard]] std::optional<Cause> node_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                              const MachineDescription& machine);

/// Its sensor sends what cannot be, or what contradicts the others. nullopt where it is no sensor, or the stop has
/// another reason.
[[nodiscard]] std::optional<Cause> sensor_cause(const Stop& stop, const Window& window, const Evidence& evidence,
                                                const MachineDescription& machine);

}  // namespace knuckle::explain
