// Reasons of a known machine: which node or signal of its bus they are about, and both by their names.
#pragma once

#include <cstdint>
#include <string>

#include "core/reason.h"
#include "machine/bus_description.h"

namespace knuckle {

/// What a reason about one signal names (SubjectKind::kNodeOrSignal): it where its node has several, else the node.
/// @param role, index of the signal, as SignalInfo has them
[[nodiscard]] std::uint8_t subject_of(NodeRole role, int index, const BusDescription& bus) noexcept;
/// The node that the reason is about, or that has the signal it names; null where it is about none, or the bus has none
/// such.
[[nodiscard]] const NodeDescription* node_of(const Reason& reason, const BusDescription& bus) noexcept;

// What follows allocates: not for loops.

/// "boom_encoder (node 0x30)"
[[nodiscard]] std::string node_text(const NodeDescription& node);
/// The same; "node 0x30" where the bus has none of this id.
[[nodiscard]] std::string node_text(std::uint8_t id, const BusDescription& bus);
/// An identifier as candump writes it, with 0x: "0x18F00A21", "0x181".
[[nodiscard]] std::string id_text(std::uint32_t id);
/// "front_rate 0x18FF0105, setting 0x18FF0205"
[[nodiscard]] std::string commands_text(const BusDescription& bus);
/// Of a node that is told what to do, all that a proof of its guard holds for: its channels, or a module's outputs
/// with neutral, extend and retract: "1 = boom (6, 9, 3), 4 (6), in the upper half".
[[nodiscard]] std::string told_channels_text(const NodeDescription& node, const BusDescription& bus);
/// Which of two buses it is on: ", bus valves"; empty where there is one.
[[nodiscard]] std::string bus_text(std::uint32_t id, const BusDescription& bus);
/// A frame that the machine sends: "front_angle (0x18FF1021)", "engine (PGN 0xF004)", "engine (PGN 0xF004 of 0x00)".
[[nodiscard]] std::string frame_text(const BroadcastFrame& frame, const BusDescription& bus);
/// What the reason is about: "pressures (node 0x20), boom_head_pressure"; what is no node as subject_text(reason).
[[nodiscard]] std::string subject_text(const Reason& reason, const BusDescription& bus);
/// One line a person can act on: "pressures (node 0x20), boom_head_pressure: sensor has stopped sending: ...".
[[nodiscard]] std::string text(const Reason& reason, const BusDescription& bus);
/// The same behind its identifier, for logs: "sensor_stale: pressures (node 0x20), ...".
[[nodiscard]] std::string text_with_code(const Reason& reason, const BusDescription& bus);

}  // namespace knuckle
