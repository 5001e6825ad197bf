// Command line of a link whose ends both dial out: where they meet, which servers help, whom the operator's side wants.
#pragma once

#include <memory>
#include <string>

#include "app/cli/options.h"
#include "app/pairing/key_folder.h"
#include "transport/ice/dialler.h"

namespace knuckle::pairing {

struct DialOptions {
  std::string rendezvous;  ///< Of --dial; empty: the far end has an address.
  std::string peer;        ///< Operator's side.
  std::string stun, turn;
};
/// --dial, --stun, --turn, and --peer of the operator's side.
void add_dial_options(const cli::OptionList& command, DialOptions& options, secure::Role role);
/// @throws InputError where options contradict each other, or an address is malformed.
void check(const DialOptions& options, secure::Role role, bool insecure);

/// @throws InputError where nobody of this name is paired, or no more.
[[nodiscard]] secure::Peer chosen_peer(const DialOptions& options, const secure::Peers& peers, const KeyFolder& folder);
/// Of newer pairings those of this far end: one, or none.
[[nodiscard]] secure::Peers those_of(const secure::Fingerprint& far_end, secure::Peers peers);
/// Credentials for --turn come from turn.toml in the folder. @throws InputError
[[nodiscard]] std::unique_ptr<ice::Dialler> make_dialler(const DialOptions& options, secure::Role role,
                                                         const KeyFolder& folder, const secure::Identity& identity,
                                                         const secure::Peers& peers);

}  // namespace knuckle::pairing
