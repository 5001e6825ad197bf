// All that explain says about one stop.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/explain/cause.h"
#include "app/explain/evidence.h"
#include "app/explain/window.h"
#include "machine/description.h"
#include "recording/recording.h"

namespace knuckle::explain {

// What was commanded after a stop, and how the machine came to move again.

/// Times are those of the machine's steps, counted from the session's start. Empty where it was not seen to happen.
struct WhatFollowed {
  std::optional<Time> commands_neutral;   ///< The last valve was commanded to neutral; before the stop: it was already.
  std::optional<Time> pilot_off;          ///< The enable node reported that pilot pressure is off; likewise.
  std::optional<Time> spools_neutral;     ///< All spools were reported within their dead bands; likewise.
  bool spools_told = true;                ///< The machine tells where its spools are.
  bool sent_nothing = false;              ///< No frame to a valve got out any more, ...
  std::string guard;                      ///< ... and what ends motion then.
  std::optional<Time> released, pressed;  ///< Enable, before it moved again.
  std::optional<Time> resumed;            ///< Engaged again.
  std::optional<Time> cause_gone;         ///< Nothing but the operator stood in the way from then on.
  std::optional<Time> home;               ///< The operator chose to go on without the cylinder that failed.
  bool moved_unasked = false;             ///< A valve was commanded before it was engaged again.
  Time known_until{};
};

[[nodiscard]] WhatFollowed what_followed(const Stop& stop, const Window& window, const MachineDescription& machine);
/// One line for each thing of it.
[[nodiscard]] std::vector<std::string> lines_of(const WhatFollowed& followed, const Stop& stop);

/// Lines of plain text, without indentation.
struct Timeline {
  Stop stop;
  std::string headline;  ///< What stopped the machine, when, in which mode.
  Cause cause;
  std::vector<std::string> inputs;  ///< The last of each wire, and what changed first.
  std::vector<std::string> before;  ///< Operator, sensors, estimate and limits in the last second.
  std::vector<std::string> after;
  WhatFollowed followed;
};

/// Of one recording, with all of its stops.
struct Report {
  Survey survey;
  std::string began_with;  ///< Why the machine was stopped in the first step already; empty: it was not.
  std::vector<Timeline> timelines;
  std::vector<std::string> notes;  ///< Where nothing stopped: what is out of the ordinary all the same.
};

/// @throws InputError where the recording has no machine file, or no steps of any loop.
[[nodiscard]] Report report_on(recording::Recording& recording, Sides sides);

// The last inputs of each wire at a stop, how old they were, and which changed first.

[[nodiscard]] std::vector<std::string> last_inputs(const Stop& stop, const Window& window, const Evidence& evidence,
                                                   const BusDescription& bus);
/// Of a recording in which nothing stopped the machine: what is out of the ordinary on its bus all the same.
[[nodiscard]] std::vector<std::string> unusual(const Evidence& evidence, const Window& window);
/// What J1939 tells people, and nothing stops for: another sender or device, packets that were lost.
[[nodiscard]] std::vector<std::string> j1939_notes(const Window& window, const MachineDescription& machine);

// What operator, sensors and estimate said in the last second before a stop, and what each limit did.

[[nodiscard]] std::vector<std::string> last_second(const Stop& stop, const Window& window,
                                                   const MachineDescription& machine);

}  // namespace knuckle::explain
