// Somebody between the ends and their TURN server, or that server itself: passes datagrams on, and what it does to
// relayed ones changes with every SIGUSR1.
#pragma once

#include <string>

namespace knuckle::test {

/// honest - each with a flipped bit - honest - false ones and old ones around each - honest - nothing relayed - honest.
/// @param turn the TURN server, ADDR:PORT. @param steps how often SIGUSR1 came. Until `ended` is not 0.
void run_lying_relay(const std::string& listen, const std::string& turn, const volatile std::sig_atomic_t& steps,
                     const volatile std::sig_atomic_t& ended);

}  // namespace knuckle::test
