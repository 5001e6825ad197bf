// A machine with two buses: what it has of frames that it sends by itself is on the second one, of 250 kbit/s.
#pragma once

#include <string>

#include "tests/support/broadcast_machine.h"

namespace knuckle::test {

/// The first bus is called "valves", the second "machine". @param text of one bus, its broadcasts behind all else of it
inline std::string on_two_buses(std::string text) {
  text = replaced(text, "\n[bus]", "\n[[bus]]\nname = \"valves\"");
  return replaced(text, "\n[[bus.broadcast]]", "\n[[bus]]\nname = \"machine\"\nbit_rate_kbps = 250\n[[bus.broadcast]]");
}

/// Valves and enable node on the first one. The slope's frame has the identifier of the boom valve's status.
inline std::string two_buses_text() {
  return on_two_buses(broadcast_text(replaced(kBroadcasts, "id = 0x1A5", "id = 0x190")));
}

}  // namespace knuckle::test
