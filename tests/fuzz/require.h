// What every fuzzer asks: a requirement that does not hold ends the program, and so becomes a finding.
#pragma once

#include <cstdlib>
#include <string>

#include "core/error.h"
#include "core/text.h"

namespace knuckle::test {

inline void require(bool condition) {
  if (!condition) std::abort();
}

/// A message is one line that a terminal shows as it is.
inline void require_line(const std::string& text) {
  require(!text.empty() && printable(text) == text);
}

/// @param read throws InputError or leaves nothing to object to; anything else it throws ends the program.
template <typename Read>
void refused_or(Read read) {
  try {
    read();
  } catch (const InputError& error) {
    require_line(error.what());
  }
}

}  // namespace knuckle::test
