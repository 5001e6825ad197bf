#include "app/pairing/chosen_link.h"

#include <fmt/format.h>
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
  TomlTable root = TomlTable::read(file, false);
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
    read_credentials(folder.turn_file(), setup.servers);
  }
  return std::make_unique<ice::Dialler>(setup, identity, peers);
}

namespace {

constexpr auto kSameNews = std::chrono::seconds(30);
constexpr const char* kHowToGrant = ": type grant and Enter to give it away, or do nothing to keep it";
constexpr const char* kHowToTake = "; \"take\" asks for it again";
constexpr const char* kEncryptedComes =
    "somebody without --insecure tries to connect, which this end with it refuses: start both without it (or, in a "
    "lab, both with it)";
constexpr const char* kEncryptedThere =
    "the far end runs without --insecure and this one with it: start both without it (or, in a lab, both with it)";
constexpr const char* kPlainNote =
    "link: plain UDP (--insecure): neither authenticated nor encrypted; for loopback, labs, or inside a tunnel";

/// Beyond this computer, a plain link must be requested twice: nobody types that by habit.
void check_plain(const char* option, const LinkOptions& o, bool listens) {
  if (o.insecure >= 2) return;
  const SocketAddress address = listens ? parse_address(o.address, option) : look_up_one(o.address, option);
  if (address.is_loopback()) return;
  cli::refuse_option(option, o.address,
                     "--insecure is for this computer's own addresses (127.0.0.1, [::1]): anybody in the network could "
                     "lead the machine; pair instead (knuckle pair), or in a lab give --insecure twice");
}

struct Keys {
  secure::Identity identity;
  secure::Peers peers;
  std::vector<std::string> notes;
};

Keys read_keys(const KeyFolder& folder) {
  Keys keys{folder.identity(), folder.peers(), {}};
  const auto valid =
      std::count_if(keys.peers.begin(), keys.peers.end(), [](const secure::Peer& peer) { return !peer.revoked; });
  if (valid == 0) throw InputError(folder.peers_file() + ": this computer is paired with nobody: knuckle pair");
  keys.notes.push_back("link: DTLS, this computer is " + keys.identity.name + " (" +
                       secure::short_text(keys.identity.fingerprint()) + "), paired with " + std::to_string(valid));
  const auto warn = [&keys](const std::string& whose, const std::string& utc) {
    if (const std::string warning = expiry_warning(whose, utc); !warning.empty()) keys.notes.push_back(warning);
  };
  warn("this computer's", keys.identity.expires_utc());
  for (const secure::Peer& peer : keys.peers) {
    if (!peer.revoked) warn(peer.name + "'s", peer.expires_utc);
  }
  return keys;
}

/// Of an event, without the address and, of strangers, the certificate: both can be another one each time.
std::string kind_of(const secure::LinkEvent& event) {
  using secure::Refusal;
  const bool stranger = event.kind == secure::LinkEvent::Kind::kRefused && event.refusal != Refusal::kRevokedPeer &&
                        event.refusal != Refusal::kBusy && event.refusal != Refusal::kObserver;
  return "link " + std::to_string(static_cast<int>(event.kind)) + " " +
         std::to_string(static_cast<int>(event.refusal)) + (stranger ? "" : " " + secure::short_text(event.peer));
}

std::string with_port(const std::string& address, std::uint16_t port) {
  return address.substr(0, address.rfind(':') + 1) + std::to_string(port);
}

/// Of this computer's end of the link, for the path to it.
SocketAddress own_address(const std::string& bound, std::uint16_t port) {
  const SocketAddress address = parse_address(bound);
  if (!address.is_any()) return parse_address(with_port(text(address), port));
  return parse_address((address.bytes.ss_family == AF_INET6 ? "[::1]:" : "127.0.0.1:") + std::to_string(port));
}

}  // namespace

void add_link_options(const cli::OptionList& command, LinkOptions& options) {
  command.add_option("--keys", options.keys,
                     "Folder of this computer's key and its pairings (knuckle pair; default: ~/.config/knuckle)");
  command.add_flag(
      "--insecure", options.insecure,
      "Plain UDP instead, neither authenticated nor encrypted; twice where the far end is another computer");
}

void ChosenLink::use(const LinkOptions& options, bool listens) {
  const bool dials = !options.dial.rendezvous.empty();
  const secure::Role role = listens ? secure::Role::kMachine : secure::Role::kOperator;
  if (listens && options.address.empty() && !dials)
    cli::refuse_option("--listen", "", "is required, unless --dial is given");
  if (!listens && options.address.empty() != dials)
    cli::refuse_option("--connect", options.address, "give it or --dial, one of them");
  check(options.dial, role, options.insecure > 0);
  listens_ = listens;
  if (listens && !options.address.empty()) (void)parse_address(options.address, "--listen");
  if (!listens && !options.address.empty()) (void)parse_host_and_port(options.address, "--connect");
  address_ = options.address.empty() ? options.dial.rendezvous : options.address;
  if (options.insecure > 0) {
    check_plain(listens ? "--listen" : "--connect", options, listens);
    if (!options.keys.empty())
      cli::refuse_option("--keys", options.keys, "does not go with --insecure: no key is used");
    if (options.observe) cli::refuse_option("--observe", "", "goes with a paired link, not with --insecure");
    plain_ = std::make_unique<UdpLink>(listens ? UdpLink::listen(options.address) : UdpLink::connect(options.address));
    if (listens) address_ = with_port(options.address, plain_->port());
    notes_ = {kPlainNote};
    return;
  }
  const KeyFolder folder(options.keys);
  watch_ = std::make_shared<PeersWatch>(folder);  // before the peers are read, so that no change is missed
  Keys keys = read_keys(folder);
  notes_ = std::move(keys.notes);
  std::string address = options.address;
  std::optional<secure::Fingerprint> only;
  if (dials) {
    if (!listens) {
      keys.peers = {chosen_peer(options.dial, keys.peers, folder)};
      only = keys.peers.front().fingerprint;
    }
    dialler_ = make_dialler(options.dial, role, folder, keys.identity, keys.peers);
    notes_.push_back("link: dialling out to " + options.dial.rendezvous + (listens ? "" : " for " + options.dial.peer));
    if (!listens) address = dialler_->address();
    if (address.empty()) address = "127.0.0.1:0";
  }
  secure::SecureLinkAccess access;
  if (options.observe) access.purpose = secure::Purpose::kObserve;
  access.most_observers = static_cast<std::size_t>(options.observers);
  // The dialler ends after the link, whose thread calls this.
  access.newer_peers = [watch = watch_, only, dialler = dialler_.get()] {
    std::optional<secure::Peers> peers = watch->changed();
    if (peers && only) peers = those_of(*only, *peers);
    if (peers && dialler != nullptr) dialler->set_peers(*peers);
    return peers;
  };
  secure_ = listens ? secure::SecureLink::listen(address, keys.identity, std::move(keys.peers), {}, access)
                    : secure::SecureLink::connect(address, keys.identity, std::move(keys.peers), {}, access);
  if (listens && !options.address.empty()) address_ = with_port(options.address, secure_->port());
  if (dials) dialler_->start(own_address(address, secure_->port()));
}

ChosenLink ChosenLink::listen(const LinkOptions& options) {
  ChosenLink chosen;
  chosen.use(options, true);
  return chosen;
}

ChosenLink ChosenLink::connect(const LinkOptions& options) {
  ChosenLink chosen;
  chosen.use(options, false);
  return chosen;
}

std::string ChosenLink::problem() const {
  if (dialler_) {
    // Without a path, the link's own complaint would be about an address that nobody has chosen.
    if (const std::string problem = dialler_->problem(); !problem.empty()) return problem;
  }
  if (const int version = secure_ ? secure_->other_version() : plain_->other_version(); version != 0)
    return fmt::format(
        "the far end's messages are of version {} of the link, this program's of version {}: both sides "
        "need the same version of Knuckle",
        version, kLinkVersion);
  if (secure_) return secure_->problem();
  if (plain_->heard_encrypted()) return listens_ ? kEncryptedComes : kEncryptedThere;
  return plain_->refused() ? "no program listens at " + address_ : "";
}

bool ChosenLink::repeats(const std::string& kind) {
  const auto now = Clock::now();
  std::erase_if(told_, [now](const auto& told) { return now - told.second > kSameNews; });
  const bool again = std::any_of(told_.begin(), told_.end(), [&kind](const auto& told) { return told.first == kind; });
  if (!again) told_.emplace_back(kind, now);
  return again;
}

/// Where a rendezvous was used, the address is one between two sockets of this program, and says nothing.
std::string ChosenLink::line_of(secure::LinkEvent event) const {
  if (dialler_ && event.address.size != 0 && (!listens_ || event.address.is_loopback())) event.address = {};
  return "link " + text(event) + (event.kind == secure::LinkEvent::Kind::kAsked ? kHowToGrant : "");
}

/// Operator's side: who asks for its control, or has it instead.
void ChosenLink::follow_control(const secure::LinkEvent& event) {
  using Kind = secure::LinkEvent::Kind;
  if (event.kind == Kind::kAsked) asker_ = event;
  if (event.kind != Kind::kConnected && event.kind != Kind::kRefused) return;
  asker_.reset();
  holder_ = event.refusal == secure::Refusal::kBusy ? std::string(event.name.view()) : "";
}

void ChosenLink::take_events(std::vector<cli::News>& news, const Watch* watch) {
  secure::LinkEvent event;
  while (secure_->next(event)) {
    if (watch != nullptr) watch->on_event(event);
    const bool refused = event.kind == secure::LinkEvent::Kind::kRefused;
    if (!listens_) follow_control(event);
    if (!listens_ && refused) continue;  // its problem() says so
    const std::string kind = kind_of(event);
    if (!refused || !repeats(kind)) news.push_back({line_of(event), kind});
  }
  const std::uint64_t lost = secure_->events_lost();
  if (lost == events_lost_) return;
  if (watch != nullptr) watch->on_lost(lost - events_lost_);
  news.push_back({"link: " + std::to_string(lost - events_lost_) + " more events, too many at once", "link lost"});
  events_lost_ = lost;
}

std::vector<cli::News> ChosenLink::news(const Watch* watch) {
  std::vector<cli::News> news;
  if (dialler_) {
    for (const ice::PathEvent& one : dialler_->take_events())
      news.push_back({text(one), "path to " + one.far_end + " " + std::to_string(static_cast<int>(one.kind))});
  }
  if (secure_) take_events(news, watch);
  if (const std::string problem = this->problem(); !problem.empty() && !repeats(problem))
    news.push_back({"link: " + problem, "link: " + problem});
  if (!watch_) return news;
  if (std::string changed = watch_->news(); !changed.empty()) {
    if (watch != nullptr) watch->on_changed_pairings(changed);
    news.push_back({std::move(changed), "pairings"});
  }
  return news;
}

std::string ChosenLink::no_control() const {
  return "this computer has no control" + (holder_.empty() ? "" : ": " + holder_ + " has it");
}

std::string ChosenLink::release() {
  if (!secure_) return "a plain link has no control to release: stop this program";
  const bool had = secure_->has_control();
  secure_->release();  // and asks for it no more
  return (had ? "control released" : no_control()) + kHowToTake;
}

std::string ChosenLink::grant() {
  if (!secure_) return "a plain link has no control to grant";
  if (!secure_->has_control()) return no_control();
  if (!asker_) return "nobody has asked for control";
  secure_->grant(asker_->peer);
  const std::string who = std::string(asker_->name.view()) + " (" + secure::short_text(asker_->peer) + ")";
  asker_.reset();
  return "control granted to " + who + kHowToTake;
}

std::string ChosenLink::take_control() {
  if (!secure_) return "a plain link has no control to ask for";
  if (secure_->has_control()) return "this computer has control";
  secure_->take_control();
  return "asking for control";
}

}  // namespace knuckle::pairing
