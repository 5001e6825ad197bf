// A shipped machine as if nobody had put pressure transmitters on one of its cylinders.
#pragma once

#include <string>

#include "tests/support/shipped.h"

namespace knuckle::test {

/// Its machine file without the two transmitters' nodes, and the key that says so.
inline std::string without_transmitters(const std::string& joint, std::string text = shipped_text()) {
  for (const char* side : {"_head_pressure", "_rod_pressure"}) {
    const std::size_t name = text.find("name = \"" + joint + side + "\"");
    const std::size_t from = text.rfind("[[bus.node]]", name), to = text.find("[[bus.node]]", name);
    text.erase(from, to - from);
  }
  return text.replace(text.find("[sensors]\n"), 10, "[sensors]\nwithout_pressures = \"" + joint + "\"\n");
}

}  // namespace knuckle::test
