// Two computers show each other their certificates over a network that nobody vouches for. That nobody was between them
// is what people find out, by comparing the code that both show.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "transport/secure/dtls_session.h"

namespace knuckle::pairing {

struct Shown {
  secure::Fingerprint fingerprint;
  std::string name;  ///< As the far end calls itself.
  std::string code;  ///< The same on both, where nobody is between them.
};

/// @param address to listen on (the machine's side) or to connect to. @param keep_on asked now and then; false ends it.
/// @return nothing where it was ended. @throws InputError for an address that cannot be used, or a far end that does
/// not speak DTLS 1.2.
[[nodiscard]] std::optional<Shown> exchange(secure::Role role, const std::string& address,
                                            const secure::Identity& identity, const std::function<bool()>& keep_on);

}  // namespace knuckle::pairing
