// Where a program of a test may listen.
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "transport/udp_link.h"

namespace knuckle::test {

/// A port that was free a moment ago. No two calls in a program return the same one: whoever is to have it may bind it
/// late.
inline std::uint16_t free_port() {
  static std::set<std::uint16_t> given;
  for (;;)
    if (const std::uint16_t port = UdpLink::listen("127.0.0.1:0").port(); given.insert(port).second) return port;
}

inline std::string free_address() {
  return "127.0.0.1:" + std::to_string(free_port());
}

}  // namespace knuckle::test
