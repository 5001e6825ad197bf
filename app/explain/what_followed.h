// What was commanded after a stop, and how the machine came to move again.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/explain/window.h"
#include "machine/description.h"

namespace knuckle::explain {

/// Times are those of the machine's steps, counted from the session's start. Empty where it was not seen to happen.
struct WhatFollowed {
  std::optional<Time> commands_neutral;   ///< The last valve was commanded to neutral; before the stop: it was already.
  std::optional<Time> pilot_off;          ///< The enable node reported that pilot pressure is off; likewise.
  std::optional<Time> spools_neutral;     ///< All spools were reported within their dead bands; likewise.
  bool sent_nothing = false;              ///< No frame to a valve got out any more.
  std::optional<Time> released, pressed;  ///< Enable, before it moved again.
  std::optional<Time> resumed;            ///< Engaged again.
  std::optional<Time> cause_gone;         ///< Nothing but the operator stood in the way from then on.
  bool moved_unasked = false;             ///< A valve was commanded before it was engaged again.
  Time known_until{};
};

[[nodiscard]] WhatFollowed what_followed(const Stop& stop, const Window& window, const MachineDescription& machine);
/// One line for each thing of it.
[[nodiscard]] std::vector<std::string> lines_of(const WhatFollowed& followed, const Stop& stop);

}  // namespace knuckle::explain
