// Notices in the loops' own step what to report to the person, and puts it where the window finds it when it has time.
#pragma once

#include <cstdint>
#include <limits>

#include "app/console/console_event.h"
#include "core/reason.h"
#include "core/ring.h"
#include "core/time.h"
#include "master/master_loop.h"
#include "sim/world.h"
#include "transport/link_messages.h"

namespace knuckle::console {

using EventRing = Ring<ConsoleEvent, 512>;

/// What events come from; of a loop that runs, or of one that was recorded.
struct Watched {
  const SlaveMessage* machine = nullptr;  ///< Newest; nullptr: none was received.
  double silence_s = 0;
  bool stop = false;
  Reason device, warning;
  double force_most_N = std::numeric_limits<double>::infinity();  ///< That the person has set.
};
[[nodiscard]] inline Watched watched(const master::MasterLoop& master) noexcept {
  return {master.machine() ? &*master.machine() : nullptr, master.silence_s(), master.stop(), master.device().reason,
          master.warning()};
}

class EventWatch {
 public:
  /// @param ring outlives this; this is its only producer.
  explicit EventWatch(EventRing& ring) noexcept : ring_(ring) {}

  /// After every step. @param world of a simulated session; nullptr: there is none.
  void step(Time now, const Watched& side, const sim::WorldEventRing* world) noexcept;
  /// What happens in the loop around.
  void note(Time now, ConsoleEventKind kind, bool on, double value = 0) noexcept;
  /// Another session from now on.
  void begin_anew() noexcept;
  [[nodiscard]] std::uint32_t run() const noexcept { return run_; }

 private:
  void watch_machine(Time now, const Watched& side) noexcept;
  void watch_force(Time now, const SlaveMessage& machine, double most_N) noexcept;
  void watch_standing(Time now, const Reason& reason) noexcept;
  void watch_operator(Time now, const Watched& side) noexcept;
  void watch_world(Time now, const sim::WorldEventRing& world) noexcept;
  [[nodiscard]] ConsoleEvent event(Time now, ConsoleEventKind kind) const noexcept;

  /// What was reported last.
  struct Told {
    bool heard = false, contact = false, too_much = false, stop = false;
    Mode mode = Mode::kOff;
    Reason fault, reason, device{ReasonCode::kStartingUp, 0, 0, 0}, warning;
  };
  EventRing& ring_;
  std::uint32_t run_ = 1;
  Told told_;
  Reason standing_;
  Time standing_since_{};
  std::uint64_t world_read_ = 0;
};

}  // namespace knuckle::console
