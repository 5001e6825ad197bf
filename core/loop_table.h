// The one table of Knuckle's threads: how often each loop steps, and which SCHED_FIFO priority each asks for.
#pragma once

#include "core/time.h"

namespace knuckle {

/// Period of every loop but the machine's side (whose period is the bus's SYNC), and of virtual time.
inline constexpr Duration kTick = 1ms;

namespace fifo_priority {
inline constexpr int kDevicePort = 85;  ///< Above the loop that waits for its reports.
inline constexpr int kSlave = 80;       ///< Decides what the valves do.
inline constexpr int kMaster = 75;
inline constexpr int kMachine = 70;  ///< Simulated: below the loops.
inline constexpr int kHand = 65;     ///< Simulated, with its device.
inline constexpr int kRelay = 60;    ///< A network, where it shares a computer with both sides.
}  // namespace fifo_priority

}  // namespace knuckle
