// Where a program of a test may listen.
#pragma once

#include <string>

#include "transport/udp_link.h"

namespace knuckle::test {

/// "127.0.0.1:PORT" of a port that was free a moment ago.
inline std::string free_address() {
  const UdpLink probe = UdpLink::listen("127.0.0.1:0");
  return "127.0.0.1:" + std::to_string(probe.port());
}

}  // namespace knuckle::test
