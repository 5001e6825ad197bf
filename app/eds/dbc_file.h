// A machine's bus as its maker describes it (DBC): messages, signals, and what their numbers mean. What has no meaning
// or two makes the message unusable that it belongs to, so that whoever wants another one is not stopped. What is said
// for people alone (comments, names of values, receivers) is passed over.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "transport/can_bus.h"
#include "transport/signal_codec.h"

namespace knuckle::eds {

/// Of a signal that is there only in frames in which another one, its multiplexer, has one of these values.
struct DbcCondition {
  std::size_t multiplexer = 0;  ///< Place in the message's signals.
  /// Raw values, from and to, ascending and apart from each other.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> values;
};

struct DbcSignal {
  std::string name;
  BitField field;
  std::uint8_t first_byte = 0;                     ///< Of a message of several packets: its bits count from there.
  std::optional<std::pair<double, double>> range;  ///< Least and most value; nothing where the file gives none.
  std::string unit;
  bool is_multiplexer = false;
  bool is_counter = false;   ///< SigType says so: it counts the message's frames.
  bool is_checksum = false;  ///< Likewise.
  std::optional<DbcCondition> condition;
  std::string unusable;  ///< Why nobody can read it in a message of several packets; empty where they can.
  int line = 0;
};

struct DbcMessage {
  std::uint32_t id = 0;  ///< Bit 31 is set where it has 29 bits and not 11.
  std::string name, sender;
  std::uint16_t size = 0;
  std::optional<double> period_s;  ///< GenMsgCycleTime; nothing where that is 0 or not there.
  bool j1939 = false;              ///< VFrameFormat says so: a parameter group, from whichever source.
  /// Why no frame of it can be sent or read, "line 12: ..."; empty where they can.
  std::string unusable;
  std::vector<DbcSignal> signals;  ///< Empty where it is unusable.
  int line = 0;

  /// A J1939 group that no frame holds alone.
  [[nodiscard]] bool is_of_packets() const noexcept { return size > sizeof(CanFrame::data); }
  /// nullptr where it has none of this name.
  [[nodiscard]] const DbcSignal* find(std::string_view signal) const noexcept;
};

struct DbcFile {
  std::string source;                ///< The file's name.
  std::vector<DbcMessage> messages;  ///< No two that can be used have one identifier.
  std::vector<std::string> slips;    ///< What the file says in a way that it should not: "line 12: ...".

  /// @throws InputError, one line with file, line and what is wrong, where there is none of this name, more than one,
  /// or one that is unusable.
  [[nodiscard]] const DbcMessage& usable(std::string_view message) const;
  /// @throws InputError "FILE:LINE: why"
  [[noreturn]] void refuse(int line, const std::string& why) const;
};

/// @throws InputError, one line with file and line, where it cannot be read at all.
[[nodiscard]] DbcFile parse_dbc(std::string_view text, const std::string& source);
[[nodiscard]] DbcFile read_dbc(const std::string& path);

/// Whether a frame of this message has the signal: it is long enough, and its multiplexers are set so. Of a message of
/// several packets no frame has one.
[[nodiscard]] bool is_in(const CanFrame& frame, const DbcMessage& message, const DbcSignal& signal) noexcept;

}  // namespace knuckle::eds
