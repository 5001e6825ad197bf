// All that explain says about one stop.
#pragma once

#include <string>
#include <vector>

#include "app/explain/cause.h"
#include "app/explain/what_followed.h"
#include "app/explain/window.h"
#include "machine/description.h"
#include "recording/recording.h"

namespace knuckle::explain {

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
  std::vector<Timeline> timelines;
  std::vector<std::string> notes;  ///< Where nothing stopped: what is out of the ordinary all the same.
};

/// @throws InputError where the recording has no machine file, or no steps of any loop.
[[nodiscard]] Report report_on(recording::Recording& recording, Sides sides);

}  // namespace knuckle::explain
