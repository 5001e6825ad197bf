// `knuckle master --observe`: hears the machine's messages and says what it does; sends it nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "app/programs/program_console.h"
#include "app/programs/run_events.h"
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
  std::vector<ObservedEvent> events;  ///< The first of each kind, and the newest others (RunEvents).
  std::uint64_t messages = 0;
  double ran_s = 0;
  std::uint64_t records_lost = 0;  ///< Events there was no room for.
};

class Observer {
 public:
  /// @param link used by this thread alone.
  Observer(Link& link, ProgramConsole& console) : link_(link), console_(console) {}

  /// Takes what has come, and tells what is new. Often.
  void tend(Time now);
  /// After the run.
  [[nodiscard]] ObserverOutcome outcome(double ran_s) const;

 private:
  void tell(Time now);

  Link& link_;
  ProgramConsole& console_;
  RunEvents<ObservedEvent> events_;
  std::uint64_t messages_ = 0;
  std::optional<SlaveMessage> newest_;
  Time heard_at_{};
  ObservedEvent last_;
};

/// Runs one until the run is over.
[[nodiscard]] ObserverOutcome run_observer(Link& link, const ProgramRun& run);

}  // namespace knuckle::programs
