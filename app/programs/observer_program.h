// `knuckle master --observe`: hears the machine's messages and says what it does; sends it nothing.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/programs/program_console.h"
#include "core/reason.h"
#include "transport/link.h"
#include "transport/link_messages.h"

namespace knuckle::programs {

/// Mode or fault of the machine as observed, or that it is not heard any more.
struct ObservedEvent {
  double at_s = 0;
  bool heard = false;
  Mode mode = Mode::kOff;
  Reason fault;
};
struct ObserverOutcome {
  std::vector<ObservedEvent> events;  ///< The newest, at most kMostEvents.
  std::uint64_t messages = 0;
  double ran_s = 0;
  static constexpr std::size_t kMostEvents = 2000;
};

/// Runs until the run is over. @param link used by this thread alone. @param problem of the link, in one line.
[[nodiscard]] ObserverOutcome run_observer(Link& link, const ProgramRun& run,
                                           const std::function<std::string()>& problem);

}  // namespace knuckle::programs
