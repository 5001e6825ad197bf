// A machine with two buses: what it has of frames that it sends by itself is on the second one, of 250 kbit/s.
#pragma once

#include <stdexcept>
#include <string>

#include "tests/support/broadcast_machine.h"

namespace knuckle::test {

/// The first bus is called "valves", the second "machine". @param text of one bus, its broadcasts behind all else of it
inline std::string on_two_buses(std::string text) {
  const auto replace = [&text](const std::string& from, const std::string& to) {
    const auto at = text.find("\n" + from);
    if (at == std::string::npos) throw std::logic_error("no such line: " + from);
    text.replace(at + 1, from.size(), to);
  };
  replace("[bus]", "[[bus]]\nname = \"valves\"");
  replace("[[bus.broadcast]]", "[[bus]]\nname = \"machine\"\nbit_rate_kbps = 250\n[[bus.broadcast]]");
  return text;
}

/// Valves and enable node on the first one. The slope's frame has the identifier of the boom valve's status.
inline std::string two_buses_text() {
  std::string frames = kBroadcasts;
  frames.replace(frames.find("id = 0x1A5"), 10, "id = 0x190");
  return on_two_buses(broadcast_text(frames));
}

}  // namespace knuckle::test
