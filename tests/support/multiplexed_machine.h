// Machines whose angles and pressures come under one identifier, told apart by a multiplexer.
#pragma once

#include <string>

#include "tests/support/broadcast_machine.h"

namespace knuckle::test {

/// Of frames as kBroadcasts has them, and the standard200's: byte 7 is 1 where they have angles, 2 where pressures; a
/// counter runs over both.
inline std::string multiplexed(const std::string& frames) {
  const std::string counter = "counter = { start = 48, bits = 4 }\n", bits = "multiplexer = { start = 56, bits = 8, ";
  const auto at = frames.find("id = 0x18FF1021");
  std::string text = frames.substr(0, at) + replaced(frames.substr(at), "period_ms = 10\n",
                                                     "period_ms = 10\n" + bits + "value = 1 }\n" + counter);
  const auto next = text.find("id = 0x18FF2021");
  std::string rest = replaced(text.substr(next), "id = 0x18FF2021", "id = 0x18FF1021");
  rest = replaced(rest, "bytes = 6", "bytes = 8");
  return text.substr(0, next) +
         replaced(rest, "period_ms = 10\n", "period_ms = 10\n" + bits + "value = 2 }\n" + counter);
}

/// With `to` in place of the first `from` of its broadcasts.
inline MachineDescription multiplexed_machine(const std::string& from = "", const std::string& to = "") {
  return parse_machine(broadcast_text(replaced(multiplexed(kBroadcasts), from, to)), "m.toml");
}

}  // namespace knuckle::test
