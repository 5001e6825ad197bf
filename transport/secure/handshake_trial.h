// One handshake, only to know how it ends: it takes control from nobody, and asks for none.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "transport/secure/dtls_session.h"

namespace knuckle::secure {

struct Trial {
  Refusal refusal = Refusal::kNone;  ///< kNone: the handshake succeeded.
  bool port_closed = false;          ///< The computer answered that no program listens there.
  bool not_dtls = false;             ///< Something answered, but not in DTLS.
  std::optional<Fingerprint> peer;   ///< As far as it came.
  std::string peer_name;             ///< As the far end calls itself.
  bool busy = false;                 ///< After success: somebody has control there, ...
  std::string holder;                ///< ... as the far end calls him.
};

/// @param keep_on asked now and then; false ends it as kSilence. @throws InputError for an address that cannot be used.
[[nodiscard]] Trial try_handshake(const SocketAddress& address, const Identity& identity, const Peers& peers,
                                  std::chrono::milliseconds patience, const std::function<bool()>& keep_on);

}  // namespace knuckle::secure
