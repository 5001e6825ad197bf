// `knuckle bus import`: messages that the machine's own controller is told by become [[bus.command]] tables. What moves
// a joint, what each other signal rests at and which one counts is said by hand: a DBC says none of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/eds/dbc_file.h"
#include "app/eds/dbc_to_machine.h"
#include "machine/bus_description.h"

namespace knuckle::eds {

/// Of one signal, or of all of a message that nothing else is said of.
struct PlaceInDbc {
  std::string message, signal;  ///< As the DBC calls them; no signal: all others.
};
/// --command boom=MESSAGE.SIGNAL:extend=0.4,retract=-0.4
struct WantedCommand {
  PlaceInDbc place;
  std::string joint;
  std::optional<double> extend{}, retract{};  ///< In the signal's unit.
};
/// --constant MESSAGE.SIGNAL=NEUTRAL or =NEUTRAL,LED; MESSAGE=NEUTRAL
struct WantedConstant {
  PlaceInDbc place;
  double neutral = 0;
  std::optional<double> led{};
};
/// --counter MESSAGE.SIGNAL or MESSAGE.SIGNAL=MODULUS
struct WantedCounter {
  PlaceInDbc place;
  std::optional<std::uint64_t> modulus{};  ///< Else as the file has it, or all that its bits can count.
};
/// --checksum MESSAGE.SIGNAL=crc8-j1850
struct WantedChecksum {
  PlaceInDbc place;
  std::string kind;  ///< As machine files call it.
};
struct WantedFrames {
  std::vector<WantedCommand> commands;
  std::vector<WantedConstant> constants;
  std::vector<WantedCounter> counters;
  std::vector<WantedChecksum> checksums;
  std::vector<WantedPeriod> periods;
};
// @throws InputError where the text is not of the form above.
[[nodiscard]] WantedCommand wanted_command(const std::string& text);
[[nodiscard]] WantedConstant wanted_constant(const std::string& text);
[[nodiscard]] WantedCounter wanted_counter(const std::string& text);
[[nodiscard]] WantedChecksum wanted_checksum(const std::string& text);
[[nodiscard]] WantedPeriod wanted_period(const std::string& text);
/// @throws InputError where one is said twice, or a joint of two messages: of two, one would be lost.
void refuse_twice(const WantedFrames& wanted);

/// What a frame is closed with, as machine files have it.
struct ClosingLine {
  std::string key, line;  ///< "counter" or "checksum"
  std::string signal;     ///< As the DBC calls it.
  BitField field{};       ///< Its bits.
  /// Of a line that is there: what the DBC and the command do not say.
  [[nodiscard]] bool keeps(const std::string& of) const;
};
[[nodiscard]] ClosingLine closing_line(const WantedCounter& counter, const DbcSignal& signal);
[[nodiscard]] ClosingLine closing_line(const WantedChecksum& checksum, const DbcSignal& signal);
/// What the DBC says to be the message's counter; nothing where another one is wanted, or that as something else.
/// @param to_do gets what the DBC says to be one and machine files cannot have @throws InputError where two are left
[[nodiscard]] std::optional<WantedCounter> counter_of(const DbcFile& dbc, const DbcMessage& message,
                                                      const WantedFrames& wanted, std::vector<std::string>& to_do);
/// "counter alive (was start = 48, bits = 8), checksum sum" @param there what the frame had before
[[nodiscard]] std::string closing_text(const std::vector<ClosingLine>& closing, const FrameClosing& there);

/// A table as machine files have it.
struct CommandTable {
  struct Field {
    std::string name, line;
    std::string joint{};  ///< That it moves; empty of a constant.
  };
  const DbcMessage* message = nullptr;
  std::optional<std::size_t> there{};  ///< Place in BusDescription::commands of the one that the file has already.
  std::string head;                    ///< Lines, each with its end.
  std::vector<ClosingLine> closing;
  std::vector<std::string> gone;  ///< Constants of one that is there which are its counter or checksum from now on.
  std::vector<Field> fields;      ///< Of one that is there: what is changed or added.
  std::string summary;            ///< "Velocity (0x18FF0105): boom, arm; constant: swing"
  [[nodiscard]] std::string text() const;
};
/// Of every message that is named. Values and bits are left to the machine file's own checks.
/// @param before what the machine file has already @param on 0, or kSecondBus @param to_do as of counter_of()
/// @throws InputError, one line, where the DBC has no such signal, a message no fixed place or period, or where a
/// signal of such a message has no value.
[[nodiscard]] std::vector<CommandTable> command_tables(const DbcFile& dbc, const WantedFrames& wanted,
                                                       const BusDescription& before, std::uint32_t on,
                                                       std::vector<std::string>& to_do);

}  // namespace knuckle::eds
