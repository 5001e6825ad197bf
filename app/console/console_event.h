// What happened, as the loops' thread notes it in the very step: plain data on its way to the event book, so that a
// window that stalls misses nothing.
#pragma once

#include <cstdint>

#include "core/reason.h"
#include "core/time.h"
#include "sim/world.h"
#include "transport/link_messages.h"

namespace knuckle::console {

enum class ConsoleEventKind : std::uint8_t {
  kMachine,   ///< mode or fault changed: mode, reason = the fault, or what blocks
  kBlocked,   ///< reason has blocked, or limited, for more than a second
  kDevice,    ///< reason why the device cannot be used; kNone: it can
  kLink,      ///< on: packets from the machine are received
  kContact,   ///< on; value: force on the tip [N]
  kTooMuch,   ///< on: value is beyond limit, the maximum that the person has set [N]; off: it is well within again
  kPiece,     ///< simulated world: piece; value as its event says
  kStop,      ///< on: pressed in
  kInput,     ///< on: what is held counts again; off: the window has stalled, inputs count as released
  kAttended,  ///< on: the window has the focus; off: it has not, inputs count as released
  kScales,    ///< on: taken; off: refused while the machine is led
  kWarning,   ///< reason; kNone: over
  kPaused,    ///< on
  kNewStart,  ///< the simulated session was restarted
  kTooSmall,  ///< on: the window has no room for any screen, inputs count as released; off: it has again
  kOwnPause,  ///< the loop did not run for value [s], and the machine's fault comes of that
};

struct ConsoleEvent {
  ConsoleEventKind kind = ConsoleEventKind::kMachine;
  Time at{};              ///< Of the session on screen.
  std::uint32_t run = 1;  ///< Which session: counts restarts.
  bool on = false;
  Mode mode = Mode::kOff;
  Reason reason;
  sim::WorldEventKind piece = sim::WorldEventKind::kPieceBroke;
  double value = 0, limit = 0;
};

}  // namespace knuckle::console
