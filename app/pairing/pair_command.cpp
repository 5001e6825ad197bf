
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <iostream>
#include <optional>
#include <string>

#include "app/cli/interrupt.h"
#include "app/pairing/key_folder.h"
#include "app/pairing/pairing_exchange.h"
#include "core/error.h"

namespace knuckle::pairing {
namespace {

// Asks a person whether a code is the one on the other computer, and keeps nobody waiting meanwhile.

class CodePrompt {
 public:
  enum class Answer : std::uint8_t { kYes, kNo, kEnded };  ///< kEnded: no more lines will come.

  explicit CodePrompt(int descriptor) : descriptor_(descriptor) {}
  /// Puts the question on standard output. What was typed into a terminal before it answers nothing.
  void ask();
  /// Never waits. Another line than yes or no, y or n, in any case, is asked again. @return nothing: not answered yet.
  std::optional<Answer> answer();

 private:
  void read();
  int descriptor_;
  bool ended_ = false;
  std::string typed_;
};

constexpr std::size_t kMostTyped = 4096;

/// Without what surrounds it, such as the carriage return of some terminals.
std::string bare(std::string line) {
  std::erase_if(line, [](unsigned char c) { return std::isspace(c) != 0; });
  std::transform(line.begin(), line.end(), line.begin(), [](unsigned char c) { return std::tolower(c); });
  return line;
}

void CodePrompt::ask() {
  if (::isatty(descriptor_) == 1) (void)::tcflush(descriptor_, TCIFLUSH);
  std::cout << "Is this the code on the other computer? [yes/no] " << std::flush;
}

void CodePrompt::read() {
  pollfd ready{descriptor_, POLLIN, 0};
  if (ended_ || ::poll(&ready, 1, 0) <= 0) return;
  std::array<char, 256> part;
  const ssize_t count = ::read(descriptor_, part.data(), part.size());
  if (count < 0 && (errno == EINTR || errno == EAGAIN)) return;
  ended_ = count <= 0 || typed_.size() > kMostTyped;
  if (count > 0) typed_.append(part.data(), static_cast<std::size_t>(count));
  if (ended_ && !typed_.empty() && typed_.back() != '\n') typed_ += '\n';  // a last line without its end
}

std::optional<CodePrompt::Answer> CodePrompt::answer() {
  read();
  for (auto end = typed_.find('\n'); end != std::string::npos; end = typed_.find('\n')) {
    const std::string line = bare(typed_.substr(0, end));
    typed_.erase(0, end + 1);
    if (line == "yes" || line == "y") return Answer::kYes;
    if (line == "no" || line == "n") return Answer::kNo;
    std::cout << "Type yes or no: " << std::flush;
  }
  if (ended_) return Answer::kEnded;
  return std::nullopt;
}

struct Options {
  std::string keys, name, listen, connect, as, code, revoke;
  bool observer = false, renew = false;
};

void add_options(const cli::OptionList& c, Options& o) {
  c.add_option("--keys", o.keys, "Folder of this computer's key and its pairings (default: ~/.config/knuckle)");
  c.add_option("--name", o.name, "Name in a new key, shown to far ends (default: the computer's)");
  c.add_option("--listen", o.listen, "Pair with the computer that connects to this address and port");
  c.add_option("--connect", o.connect, "Pair with the computer that listens there");
  c.add_option("--as", o.as, "What the far end is called here (default: as it calls itself)");
  c.add_option("--code", o.code,
               "The code that the far end shows, case and dashes do not count: pair without asking, or fail");
  c.add_flag("--observer", o.observer, "On the machine's computer: let it observe the machine, but not control it");
  c.add_flag("--renew", o.renew, "Make a new key for this computer: every far end must be paired again");
  c.add_option("--revoke", o.revoke, "Revoke the far end of this name: it is let in no more");
}

/// A code as a person copies it: case and what is between its groups do not count.
std::string bare_code(std::string code) {
  std::erase_if(code, [](char c) { return c == '-' || c == ' '; });
  for (char& c : code) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return code;
}

bool is_code(const std::string& text) {
  constexpr std::size_t kLength = 24;  // secure::pairing_code()
  const std::string code = bare_code(text);
  return code.size() == kLength &&
         std::all_of(code.begin(), code.end(), [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '2' && c <= '7'); });
}

void check(const Options& o) {
  if (!o.listen.empty() && !o.connect.empty())
    cli::refuse_option("--connect", o.connect, "give it or --listen, not both");
  const bool pairs = !o.listen.empty() || !o.connect.empty();
  if (!pairs && !o.as.empty()) cli::refuse_option("--as", o.as, "goes with --listen or --connect");
  if (!pairs && !o.code.empty()) cli::refuse_option("--code", o.code, "goes with --listen or --connect");
  if (!o.listen.empty()) (void)parse_address(o.listen, "--listen");
  if (!o.connect.empty()) (void)parse_host_and_port(o.connect, "--connect");
  if (!o.code.empty() && !is_code(o.code))
    cli::refuse_option("--code", o.code, "must be as the far end shows it: six groups of four of A-Z and 2-7");
  if (!pairs && o.observer) cli::refuse_option("--observer", "", "goes with --listen or --connect");
  if (pairs && !o.revoke.empty()) cli::refuse_option("--revoke", o.revoke, "does not go with --listen or --connect");
  if (o.renew && (pairs || !o.revoke.empty()))
    cli::refuse_option("--renew", "", "does not go with --listen, --connect or --revoke");
  if (!o.revoke.empty() && !o.name.empty()) cli::refuse_option("--name", o.name, "does not go with --revoke");
  for (const auto& [option, name] : {std::pair("--name", o.name), std::pair("--as", o.as)}) {
    if (!name.empty() && !secure::is_name(name))
      cli::refuse_option(option, name, "must be 1 to 40 letters, digits, spaces and . _ -");
  }
}

void warn(const std::string& whose, const std::string& expires_utc) {
  if (const std::string warning = expiry_warning(whose, expires_utc); !warning.empty())
    std::cerr << "knuckle pair: " << warning << '\n';
}

/// Also of a key that cannot be used now: then it is said why.
void list(const KeyFolder& folder) {
  const secure::Identity identity = folder.stored_identity();
  std::cout << "this computer: " << identity.name << " (" << secure::short_text(identity.fingerprint())
            << "), valid until " << identity.expires_utc() << "\nkey: " << folder.key_file() << '\n';
  if (const std::string why = not_valid_now(identity); !why.empty()) {
    std::cerr << "knuckle pair: " << folder.key_file() << ": " << why << '\n';
  } else {
    warn(kThisComputers, identity.expires_utc());
  }
  const secure::Peers peers = folder.peers();
  if (peers.empty()) std::cout << "paired with nobody\n";
  for (const secure::Peer& peer : peers) {
    std::cout << (peer.revoked ? "revoked: " : "paired with: ") << peer.name << " ("
              << secure::short_text(peer.fingerprint) << ")" << (peer.observer ? ", observes only" : "")
              << ", valid until " << peer.expires_utc << '\n';
    if (!peer.revoked) warn(peer.name + "'s", peer.expires_utc);
  }
}

/// Needs no key of this computer, and makes none.
void revoke(const KeyFolder& folder, const std::string& name) {
  const auto named = [&name](const secure::Peer& peer) { return peer.name == name; };
  const secure::Peers known = folder.peers();
  if (std::none_of(known.begin(), known.end(), named))
    cli::refuse_option("--revoke", name, "no far end of this name is in " + folder.peers_file());
  if (std::none_of(known.begin(), known.end(), [&](const auto& peer) { return named(peer) && !peer.revoked; })) {
    std::cout << "is revoked already: " << name << '\n';
    return;
  }
  folder.change_peers([&](secure::Peers& peers) {
    for (secure::Peer& peer : peers) peer.revoked |= named(peer);
  });
  std::cout << "revoked: " << name << ": programs that run notice within a second, and cut it off\n";
}

/// @param what "made this computer's key"
void show_made(const char* what, const secure::Identity& made) {
  std::cout << what << ": " << made.name << " (" << secure::short_text(made.fingerprint()) << "), valid until "
            << made.expires_utc() << std::endl;
  if (const std::string wrong = clock_warning(); !wrong.empty()) std::cerr << "knuckle pair: " << wrong << std::endl;
}

void renew(const KeyFolder& folder, const std::string& name) {
  if (!folder.has_key()) return show_made("this computer had no key; made", folder.make(name));
  show_made("new key", folder.renew(name));
  std::cout << "every far end knows the old key only: pair each of them again (knuckle pair "
            << "--listen here, --connect there, or the other way round);\nwhom this computer is paired with has not "
            << "changed. Programs that run keep the old key until they are restarted\n";
}

/// In place of what is known of the same far end; one of the same name with another key is replaced only where it was
/// renewed there: revoked here, or expired. @throws InputError
void put(const KeyFolder& folder, const secure::Peer& pinned, secure::Peers& peers) {
  std::erase_if(peers, [&](const secure::Peer& known) {
    const bool over = known.revoked || days_left(known.expires_utc).value_or(0) <= kWarnDays;
    return known.fingerprint == pinned.fingerprint || (known.name == pinned.name && over);
  });
  const bool taken =
      std::any_of(peers.begin(), peers.end(), [&](const auto& known) { return known.name == pinned.name; });
  if (taken)
    cli::refuse_option(
        "--as", pinned.name,
        "another far end has this name in " + folder.peers_file() + ": give a new one, or --revoke the other first");
  peers.push_back(pinned);
}

/// What could keep it from being stored, before anybody is asked. @throws InputError
void check_can_be_stored(const KeyFolder& folder, const secure::Identity& identity, const secure::Peer& pinned) {
  if (pinned.fingerprint == identity.fingerprint())
    throw InputError("the other computer shows this computer's own key: give each a key of its own (--keys FOLDER)");
  secure::Peers peers = folder.peers();
  put(folder, pinned, peers);
}

/// Until both ends have confirmed the code, or one has not. @return empty where both have, else why not.
/// The code is no secret: it is made of two certificates that anybody may see. So it is compared as any text, and not
/// in constant time.
std::string not_confirmed(const Options& o, const std::string& code, PairingExchange& exchange,
                          const cli::InterruptGuard& interrupt) {
  const std::string kBetween = ": where the codes differ, somebody may be between the two computers";
  CodePrompt prompt(STDIN_FILENO);
  Verdict here = Verdict::kNone;
  const auto confirm = [&] {
    exchange.say(here = Verdict::kYes);
    std::cout << "confirmed here; waiting for the other computer to confirm" << std::endl;
  };
  if (!o.code.empty()) {
    if (bare_code(o.code) != bare_code(code)) return "the code is not the one of --code" + kBetween;
    confirm();
  } else {
    prompt.ask();
  }
  while (here == Verdict::kNone || exchange.heard() == Verdict::kNone) {
    exchange.serve();
    if (interrupt.pending()) throw cli::Interrupted("not paired");
    if (exchange.heard() == Verdict::kNo || exchange.gone()) std::cout << std::endl;  // the question's line
    if (exchange.heard() == Verdict::kNo) break;
    if (exchange.gone()) return "the other computer is silent: its program has ended, or the network is cut";
    const auto answer = here == Verdict::kNone ? prompt.answer() : std::nullopt;
    if (answer == CodePrompt::Answer::kNo) return "you answered no" + kBetween;
    if (answer == CodePrompt::Answer::kEnded) return "standard input ended without an answer";
    if (answer == CodePrompt::Answer::kYes) confirm();
  }
  return exchange.heard() == Verdict::kYes ? "" : "the other computer has not confirmed the code: it says why";
}

int confirm_and_store(const Options& o, const KeyFolder& folder, const secure::Identity& identity, const Shown& shown,
                      PairingExchange& exchange, const cli::InterruptGuard& interrupt) {
  const std::string name = o.as.empty() ? shown.name : o.as;
  const secure::Peer pinned{shown.fingerprint, name, false, o.observer, shown.expires_utc};
  check_can_be_stored(folder, identity, pinned);
  std::cout << "other computer: " << name << " (" << secure::short_text(shown.fingerprint) << ")\ncode: " << shown.code
            << std::endl;
  if (const std::string why = not_confirmed(o, shown.code, exchange, interrupt); !why.empty()) {
    std::cerr << "knuckle pair: not paired: " << why << '\n';
    exchange.say(Verdict::kNo);
    (void)exchange.part();
    return 1;
  }
  folder.change_peers([&](secure::Peers& peers) { put(folder, pinned, peers); });
  std::cout << "paired with " << name << (o.observer ? ", which may observe a machine here, not control it" : "")
            << std::endl;
  warn(name + "'s", shown.expires_utc);
  if (exchange.part()) return 0;
  std::cerr << "knuckle pair: the other computer has fallen silent, and may not have stored this one: look there "
               "(knuckle pair), and pair again where it has not\n";
  return 1;
}

/// With the computer that listens or connects. @return exit code
int pair(const Options& o, const KeyFolder& folder) {
  const secure::Identity identity = folder.identity();
  folder.check_can_be_written();
  const cli::InterruptGuard interrupt;
  const bool listens = !o.listen.empty();
  PairingExchange exchange(listens ? secure::Role::kMachine : secure::Role::kOperator,
                           listens ? std::vector{parse_address(o.listen, "--listen")} : look_up(o.connect, "--connect"),
                           identity);
  std::cout << "this computer: " << identity.name << " (" << secure::short_text(identity.fingerprint()) << ")\n"
            << (listens ? "waiting for the other computer on " + o.listen : "asking " + o.connect) << std::endl;
  if (!std::cout && o.code.empty()) throw InputError("standard output: cannot be written: nobody would see the code");
  const auto shown =
      exchange.meet([&interrupt] { return !interrupt.pending(); },
                    [](const std::string& why) { std::cerr << "knuckle pair: not yet: " << why << std::endl; });
  if (!shown) return 130;
  try {
    return confirm_and_store(o, folder, identity, *shown, exchange, interrupt);
  } catch (...) {  // bad input, a signal, a full disk: the other computer is not to believe that it is paired
    exchange.say(Verdict::kNo);
    (void)exchange.part();
    throw;
  }
}

int run(const Options& o) {
  check(o);
  const KeyFolder folder(o.keys);
  if (o.renew) {
    renew(folder, o.name);
    return 0;
  }
  if (!o.revoke.empty()) {
    revoke(folder, o.revoke);
    return 0;
  }
  if (folder.has_key() && !o.name.empty())
    cli::refuse_option("--name", o.name, "this computer has a key already: " + folder.key_file() + " (see --renew)");
  if (!folder.has_key()) show_made("made this computer's key", folder.make(o.name));
  (void)folder.peers();  // a malformed file is told before anybody is asked
  if (!o.listen.empty() || !o.connect.empty()) return pair(o, folder);
  list(folder);
  return 0;
}

}  // namespace

cli::Command pair_entry() {
  return cli::command<Options>(
      "pair", "Make this computer's key, and pair it with the computer at the other end of the link", add_options, run);
}

}  // namespace knuckle::pairing
