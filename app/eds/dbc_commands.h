// `knuckle bus import`: messages that the machine's own controller is told by become [[bus.command]] tables; and what
// frames of both directions are closed with. What moves a joint, what each other signal rests at and which one counts
// is said by hand: a DBC says none of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/eds/dbc_file.h"
#include "app/eds/dbc_wanted.h"
#include "machine/bus_description.h"

namespace knuckle::eds {

/// What a frame is closed with, as machine files have it.
struct ClosingLine {
  WantedClosing wanted;
  const DbcSignal* signal = nullptr;
  [[nodiscard]] std::string text() const;
  /// Of a line that is there: what the DBC and the command do not say.
  [[nodiscard]] bool keeps(const std::string& key) const;
};
/// What the DBC says to be the message's counter; nothing where another one is wanted, or that as something else.
/// @param to_do gets what the DBC says to be one and machine files cannot have @throws InputError where two are left
[[nodiscard]] std::optional<WantedClosing> counter_of(const DbcFile& dbc, const DbcMessage& message,
                                                      const Wanted& wanted, std::vector<std::string>& to_do);
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
[[nodiscard]] std::vector<CommandTable> command_tables(const DbcFile& dbc, Wanted wanted, const BusDescription& before,
                                                       std::uint32_t on, std::vector<std::string>& to_do);

}  // namespace knuckle::eds
