// `knuckle bus import`: messages that the machine's own controller is told by become [[bus.command]] tables. What moves
// a joint, what each other signal rests at and which one counts is said by hand: a DBC says none of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/eds/dbc_file.h"

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
struct WantedFrames {
  std::vector<WantedCommand> commands;
  std::vector<WantedConstant> constants;
  std::vector<PlaceInDbc> counters;  ///< --counter MESSAGE.SIGNAL
};
// @throws InputError where the text is not of the form above.
[[nodiscard]] WantedCommand wanted_command(const std::string& text);
[[nodiscard]] WantedConstant wanted_constant(const std::string& text);
[[nodiscard]] PlaceInDbc wanted_counter(const std::string& text);

/// A table as machine files have it.
struct CommandTable {
  std::string name, text, summary;  ///< "Velocity (0x18FF0105): boom, arm; constant: swing"
};
/// Of every message that is named. Values and bits are left to the machine file's own checks.
/// @throws InputError, one line, where the DBC has no such signal, a message no fixed place or period, or where a
/// signal of such a message has no value.
[[nodiscard]] std::vector<CommandTable> command_tables(const DbcFile& dbc, const WantedFrames& wanted);

}  // namespace knuckle::eds
