// Two computers show each other their certificates over a network that nobody vouches for. That nobody was between them
// is what people find out, by comparing the code that both show.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "transport/secure/dtls_session.h"
#include "transport/socket_address.h"

namespace knuckle::pairing {

struct Shown {
  secure::Fingerprint fingerprint;
  std::string name;  ///< As the far end calls itself.
  std::string code;  ///< The same on both, where nobody is between them.
  std::string expires_utc;
};

/// Tries until it succeeds: junk, floods and ends that do not answer only delay it.
/// @param addresses the one to listen on (the machine's side), or those of the far end, tried in turn: at least one.
/// @param keep_on asked now and then; false ends it.
/// @param tell why an attempt failed, in one line, once for each reason.
/// @return nothing where it was ended. @throws InputError where none of the addresses can be used.
[[nodiscard]] std::optional<Shown> exchange(secure::Role role, const std::vector<SocketAddress>& addresses,
                                            const secure::Identity& identity, const std::function<bool()>& keep_on,
                                            const std::function<void(const std::string&)>& tell = {});

}  // namespace knuckle::pairing
