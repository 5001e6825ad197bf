#include "app/pairing/chosen_link.h"

#include <CLI/CLI.hpp>

#include "app/cli/command.h"
#include "app/pairing/key_folder.h"
#include "core/error.h"

namespace knuckle::pairing {
namespace {

constexpr const char* kPlainNote =
    "plain UDP (--insecure): neither authenticated nor encrypted; for loopback, labs, or inside a tunnel";

/// Beyond this computer, a plain link must be requested twice: nobody types that by habit.
void check_plain(const char* option, const LinkOptions& o) {
  if (o.insecure >= 2 || parse_address(o.address).is_loopback()) return;
  cli::refuse_option(option, o.address,
                     "--insecure is for this computer's own addresses (127.0.0.1, [::1]): anybody in the network could "
                     "lead the machine; pair instead (knuckle pair), or in a lab give --insecure twice");
}

struct Keys {
  secure::Identity identity;
  secure::Peers peers;
  std::string note;
};

Keys read_keys(const LinkOptions& o) {
  const KeyFolder folder(o.keys);
  Keys keys{folder.identity(), folder.peers(), {}};
  const auto valid = static_cast<std::size_t>(
      std::count_if(keys.peers.begin(), keys.peers.end(), [](const secure::Peer& peer) { return !peer.revoked; }));
  if (valid == 0) throw InputError(folder.peers_file() + ": this computer is paired with nobody: knuckle pair");
  keys.note = "DTLS, this computer is " + keys.identity.name + " (" + secure::short_text(keys.identity.fingerprint()) +
              "), paired with " + std::to_string(valid);
  return keys;
}

/// Of this computer's end of the link, for the path to it.
SocketAddress own_address(const std::string& bound, std::uint16_t port) {
  const SocketAddress address = parse_address(bound);
  if (!address.is_any()) {
    const std::string host = text(address);
    return parse_address(host.substr(0, host.rfind(':') + 1) + std::to_string(port));
  }
  return parse_address((address.bytes.ss_family == AF_INET6 ? "[::1]:" : "127.0.0.1:") + std::to_string(port));
}

}  // namespace

void add_link_options(CLI::App& command, LinkOptions& options) {
  command.add_option("--keys", options.keys,
                     "Folder of this computer's key and its pairings (knuckle pair; default: ~/.config/knuckle)");
  command.add_flag(
      "--insecure", options.insecure,
      "Plain UDP instead, neither authenticated nor encrypted; twice where the far end is another computer");
}

ChosenLink ChosenLink::listen(const LinkOptions& options) {
  ChosenLink chosen;
  const bool dials = !options.dial.rendezvous.empty();
  if (options.address.empty() && !dials) cli::refuse_option("--listen", "", "is required, unless --dial is given");
  check(options.dial, secure::Role::kMachine, options.insecure > 0);
  const std::string address = options.address.empty() ? "127.0.0.1:0" : options.address;
  chosen.address_ = options.address.empty() ? options.dial.rendezvous : options.address;
  if (options.insecure > 0) {
    check_plain("--listen", options);
    chosen.plain_ = std::make_unique<UdpLink>(UdpLink::listen(options.address));
    chosen.note_ = kPlainNote;
  } else {
    Keys keys = read_keys(options);
    chosen.note_ = keys.note;
    if (dials) {
      chosen.dialler_ =
          make_dialler(options.dial, secure::Role::kMachine, KeyFolder(options.keys), keys.identity, keys.peers);
      chosen.note_ += ", dialling out to " + options.dial.rendezvous;
    }
    chosen.secure_ = secure::SecureLink::listen(address, keys.identity, std::move(keys.peers));
    if (dials) chosen.dialler_->start(own_address(address, chosen.secure_->port()));
  }
  return chosen;
}

ChosenLink ChosenLink::connect(const LinkOptions& options) {
  ChosenLink chosen;
  const bool dials = !options.dial.rendezvous.empty();
  if (options.address.empty() != dials)
    cli::refuse_option("--connect", options.address, "give it or --dial, one of them");
  check(options.dial, secure::Role::kOperator, options.insecure > 0);
  chosen.address_ = dials ? options.dial.rendezvous : options.address;
  if (options.insecure > 0) {
    check_plain("--connect", options);
    chosen.plain_ = std::make_unique<UdpLink>(UdpLink::connect(options.address));
    chosen.note_ = kPlainNote;
  } else {
    Keys keys = read_keys(options);
    chosen.note_ = keys.note;
    std::string address = options.address;
    if (dials) {
      const KeyFolder folder(options.keys);
      keys.peers = {chosen_peer(options.dial, keys.peers, folder)};
      chosen.dialler_ = make_dialler(options.dial, secure::Role::kOperator, folder, keys.identity, keys.peers);
      chosen.note_ += ", dialling out to " + options.dial.rendezvous + " for " + options.dial.peer;
      address = chosen.dialler_->address();
    }
    chosen.secure_ = secure::SecureLink::connect(address, keys.identity, std::move(keys.peers));
    if (dials) chosen.dialler_->start(own_address(address, chosen.secure_->port()));
  }
  return chosen;
}

std::string ChosenLink::problem() const {
  if (dialler_) {
    // Without a path, the link's own complaint would be about an address that nobody has chosen.
    if (const std::string problem = dialler_->problem(); !problem.empty()) return problem;
  }
  if (secure_) return secure_->problem();
  return plain_->refused() ? "no program listens at " + address_ : "";
}

std::vector<std::string> ChosenLink::news() {
  std::vector<std::string> lines;
  if (dialler_) {
    for (const ice::PathEvent& one : dialler_->take_events()) lines.push_back(text(one));
  }
  secure::LinkEvent event;
  while (secure_ && secure_->next(event)) lines.push_back("link " + text(event));
  return lines;
}

}  // namespace knuckle::pairing
