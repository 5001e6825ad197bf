// What [[bus.broadcast]] and [[bus.command]] of a machine file have in common: a frame's identifier, length and period,
// where a number is in it, and what it is closed with.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "machine/bus_description.h"
#include "machine/toml_reader.h"

namespace knuckle {

/// Whether it can be a name in options, scenarios and a DBC: a letter, then letters, digits and _.
[[nodiscard]] bool is_plain_name(const std::string& name, std::size_t longest);

/// The channel that a key names, "0" to "99"; nothing where it names none.
[[nodiscard]] std::optional<int> channel_number(const std::string& key);

/// What a frame has but its fields and closing: a command's, too, as far as CommandFrame has it.
/// Notes a name that one of the others has, or an identifier that no multiplexer tells apart from another's.
/// @param bus kSecondBus where it is on that
/// @param is_broadcast "pgn" may stand in place of "id", and there may be a multiplexer.
/// @param own_address J1939 address of whoever sends it: a frame from there is known by its group and receiver.
[[nodiscard]] BroadcastFrame read_frame_head(TomlTable& file, const std::vector<BroadcastFrame>& others,
                                             std::uint32_t bus, bool is_broadcast,
                                             std::optional<std::uint8_t> own_address = {});

/// Notes a name that another one has, or that a DBC could not have, and an identifier that may be another's.
/// @param name_key, id_key what the file says them by
void check_frame_head(const TomlTable& file, const BroadcastFrame& head, const std::vector<BroadcastFrame>& others,
                      const char* name_key, const char* id_key);

/// Channels of a module that the table's keys name, in order; notes keys that name none.
[[nodiscard]] std::vector<int> analog_numbers(TomlTable& file);

/// start, bits, type and order.
[[nodiscard]] BitField read_bits(TomlTable& file, std::uint8_t frame_bytes);

/// The highest raw value. Notes bits that are not an unsigned of at most so many.
[[nodiscard]] std::int64_t most_raw(const TomlTable& file, const BitField& bits, std::uint8_t most_bits = 32);

/// Likewise in a message of several packets, from its first byte on: within 8 bytes.
struct MessageBits {
  BitField bits;
  std::uint8_t first_byte = 0;
};
[[nodiscard]] MessageBits read_message_bits(TomlTable& file, std::uint8_t message_bytes);

inline constexpr std::array kChecksumNames{"sum", "xor", "crc8-j1850",
                                           "crc8-h2f"};  ///< In FrameChecksum::Kind's order.

/// Bits of a frame that have a meaning, and whose they are.
struct UsedBits {
  BitField bits;
  std::string whose;
};
/// counter and checksum, where there are. Notes what has bits of others.
[[nodiscard]] FrameClosing read_frame_closing(TomlTable& file, std::uint8_t frame_bytes,
                                              const std::vector<UsedBits>& used);

/// Notes an identifier of a broadcast or a command that CANopen gives to a service of the controller or of a node.
/// @param file the table [bus]
void check_frames_beside_nodes(const TomlTable& file, const BusDescription& bus);

}  // namespace knuckle
