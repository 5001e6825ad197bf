// `knuckle bus import`: what is read of the frames that the machine's own controller sends, signal by signal.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/eds/dbc_commands.h"
#include "app/eds/dbc_file.h"
#include "app/eds/dbc_to_machine.h"
#include "app/eds/dbc_wanted.h"

namespace knuckle::eds {

/// One frame with what is wanted of it: of a message, those with one value of its multiplexer.
struct DbcFrame {
  const DbcMessage* message = nullptr;
  std::optional<DbcMultiplexing> by;
  struct Signal {
    const WantedSignal* wanted;
    const DbcSignal* source;
    std::string line;  ///< "boom_angle = { start = 0, ... }"
  };
  std::vector<Signal> signals;
};

/// @param wanted outlives what is returned @throws InputError where the DBC has no such signal, or one that a machine
/// file cannot have.
[[nodiscard]] std::vector<DbcFrame> frames_of(const DbcFile& dbc, const std::vector<WantedSignal>& wanted);

/// What closes all frames of messages that the machine sends.
using Closings = std::map<const DbcMessage*, std::vector<ClosingLine>>;
/// Takes the counters and checksums of such messages out of what is wanted. A message that is new to the machine file
/// has the counter that the DBC says (SigType), where nobody says another.
/// @param is_there whether the machine file has frames of a message, which the machine sends
/// @param to_do as of counter_of()
/// @throws InputError where the DBC has no such signal, or one that is another thing or not in every frame.
[[nodiscard]] Closings take_closings(const DbcFile& dbc, const std::vector<DbcFrame>& frames, Wanted& wanted,
                                     const std::function<bool(const DbcMessage&)>& is_there,
                                     std::vector<std::string>& to_do);

}  // namespace knuckle::eds
