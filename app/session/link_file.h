// Link files: what a network between operator and machine does, each way, and when. For sessions on virtual time and
// for `knuckle relay`; docs/network.md describes the keys.
#pragma once

#include <string>
#include <string_view>

#include "transport/link_impairment.h"

namespace knuckle::session {

struct LinkFile {
  std::string source;  ///< Where it was read from.
  std::string name, description;
  LinkImpairment to_machine, to_operator;
};

/// @throws InputError naming file, line, key, value and bound.
[[nodiscard]] LinkFile load_link(const std::string& path);
/// The same for text in memory; `source` names it in messages.
[[nodiscard]] LinkFile parse_link(std::string_view text, const std::string& source);

}  // namespace knuckle::session
