// `knuckle bus import`: what is read of the frames that the machine's own controller sends, signal by signal.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/eds/dbc_commands.h"
#include "app/eds/dbc_file.h"
#include "app/eds/dbc_to_machine.h"
#include "machine/bus_description.h"

namespace knuckle::eds {

/// What a machine file is to have of a DBC: --signal boom_angle=Front_Angle.boom; of a pilot pressure
/// --signal boom_extend_pilot=Pilot.boom_up:shut=0.6,full=2.8.
struct WantedSignal {
  std::string signal;           ///< As machine files call it.
  std::string message, source;  ///< As the DBC calls both.
  std::string travel{};         ///< "shut=0.6,full=2.8", in the signal's unit; of a pilot pressure.
};
/// @throws InputError where it is not of this form.
[[nodiscard]] WantedSignal wanted_signal(const std::string& text);

/// @throws InputError where nobody measures such a signal.
[[nodiscard]] const SignalInfo& signal_info(const std::string& name);

/// One frame with what is wanted of it: of a message, those with one value of its multiplexer.
struct DbcFrame {
  const DbcMessage* message = nullptr;
  std::optional<DbcMultiplexing> by;
  struct Signal {
    std::string name;  ///< Knuckle's.
    const DbcSignal* source;
    std::string travel;  ///< travel_text()
  };
  std::vector<Signal> signals;
};

/// @throws InputError where the DBC has no such signal, or one that a machine file cannot have, and where one is wanted
/// twice.
[[nodiscard]] std::vector<DbcFrame> frames_of(const DbcFile& dbc, const std::vector<WantedSignal>& wanted);

/// "boom_angle = { start = 0, ... }" @throws InputError where its unit is none that machine files know.
[[nodiscard]] std::string line_of(const DbcFile& dbc, const DbcFrame& frame, const DbcFrame::Signal& signal);

/// What closes all frames of a message that the machine sends.
struct DbcClosing {
  const DbcMessage* message = nullptr;
  std::vector<ClosingLine> lines;
};
/// Takes the counters and checksums of such messages out of what is wanted. A message that is new to the machine file
/// has the counter that the DBC says (SigType), where nobody says another.
/// @param is_there whether the machine file has frames of a message, which the machine sends
/// @param to_do as of counter_of()
/// @throws InputError where the DBC has no such signal, or one that is another thing or not in every frame.
[[nodiscard]] std::vector<DbcClosing> take_closings(const DbcFile& dbc, const std::vector<DbcFrame>& frames,
                                                    WantedFrames& wanted,
                                                    const std::function<bool(const DbcMessage&)>& is_there,
                                                    std::vector<std::string>& to_do);

}  // namespace knuckle::eds
