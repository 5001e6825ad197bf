#include "app/pairing/dial_options.h"

#include <sys/stat.h>

#include <algorithm>

#include "app/cli/command.h"
#include "core/error.h"
#include "machine/toml_reader.h"

namespace knuckle::pairing {
namespace {

void read_credentials(const std::string& file, ice::Servers& servers) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0)
    throw InputError(file + ": cannot be read: --turn needs it, with user = \"...\" and password = \"...\", mode 0600");
  if ((status.st_mode & 077U) != 0) throw InputError(file + ": others may read or write the password: chmod 600");
  TomlTable root = TomlTable::read(file);
  servers.turn_user = root.text("user");
  servers.turn_password = root.text("password");
  root.finish();
}

}  // namespace

void add_dial_options(const cli::OptionList& command, DialOptions& options, secure::Role role) {
  const bool operates = role == secure::Role::kOperator;
  command.add_option(
      "--dial", options.rendezvous,
      operates ? "Instead of --connect: meet the machine's side at this rendezvous, HOST:PORT (docs/network.md)"
               : "Instead of --listen or beside it: meet operators at this rendezvous, HOST:PORT (docs/network.md)");
  if (operates)
    command.add_option("--peer", options.peer, "With --dial: the machine's side, by its name in knuckle pair");
  command.add_option("--stun", options.stun,
                     "With --dial: STUN server HOST:PORT, which tells the address that a NAT gives");
  command.add_option("--turn", options.turn,
                     "With --dial: TURN server HOST:PORT, a relay for where no direct path is found; user and password "
                     "in turn.toml of the keys' folder");
}

void check(const DialOptions& o, secure::Role role, bool insecure) {
  if (o.rendezvous.empty()) {
    for (const auto& [option, value] :
         {std::pair("--peer", o.peer), std::pair("--stun", o.stun), std::pair("--turn", o.turn)})
      if (!value.empty()) cli::refuse_option(option, value, "goes with --dial");
    return;
  }
  if (insecure) cli::refuse_option("--dial", o.rendezvous, "does not go with --insecure: the ends must be paired");
  if (role == secure::Role::kOperator && o.peer.empty())
    cli::refuse_option("--dial", o.rendezvous, "needs --peer NAME: whom of the paired far ends (knuckle pair)");
  for (const auto& [option, address] :
       {std::pair("--dial", o.rendezvous), std::pair("--stun", o.stun), std::pair("--turn", o.turn)})
    if (!address.empty()) (void)parse_host_and_port(address, option);
}

secure::Peer chosen_peer(const DialOptions& options, const secure::Peers& peers, const KeyFolder& folder) {
  const auto found =
      std::find_if(peers.begin(), peers.end(), [&](const secure::Peer& one) { return one.name == options.peer; });
  if (found == peers.end())
    cli::refuse_option("--peer", options.peer,
                       "nobody of this name is paired (knuckle pair shows the names), see " + folder.peers_file());
  if (found->revoked) cli::refuse_option("--peer", options.peer, "its pairing was revoked: knuckle pair pairs it anew");
  return *found;
}

secure::Peers those_of(const secure::Fingerprint& far_end, secure::Peers peers) {
  std::erase_if(peers, [&](const secure::Peer& one) { return !(one.fingerprint == far_end); });
  return peers;
}

std::unique_ptr<ice::Dialler> make_dialler(const DialOptions& options, secure::Role role, const KeyFolder& folder,
                                           const secure::Identity& identity, const secure::Peers& peers) {
  ice::DialSetup setup{options.rendezvous, {}, role};
  if (!options.stun.empty()) setup.servers.stun = parse_host_and_port(options.stun);
  if (!options.turn.empty()) {
    setup.servers.turn = parse_host_and_port(options.turn);
    read_credentials(folder.path() + "/turn.toml", setup.servers);
  }
  return std::make_unique<ice::Dialler>(setup, identity, peers);
}

}  // namespace knuckle::pairing
