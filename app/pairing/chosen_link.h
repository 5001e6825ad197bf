// The link of a program with a real far end: secure, or plain where that was requested.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/pairing/key_folder.h"
#include "transport/ice/dialler.h"
#include "transport/secure/secure_link.h"
#include "transport/udp_link.h"

namespace knuckle::pairing {

// Command line of a link whose ends both dial out: where they meet, which servers help, whom the operator's side wants.

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

struct LinkOptions {
  std::string address;   ///< Of --listen or --connect.
  std::string keys;      ///< Folder; empty: the usual one.
  int insecure = 0;      ///< How often it was said.
  bool observe = false;  ///< Operator's side: hear the machine only.
  int observers = 4;     ///< Machine's side: how many may do so.
  DialOptions dial;      ///< Instead of an address, or of the machine's side beside one.
};
/// --keys and --insecure.
void add_link_options(const cli::OptionList& command, LinkOptions& options);

class ChosenLink {
 public:
  /// @throws InputError where a plain link is requested for an address beyond this computer but not twice, where there
  /// is no key or nobody is paired, and where the address cannot be used.
  static ChosenLink listen(const LinkOptions& options);
  static ChosenLink connect(const LinkOptions& options);

  [[nodiscard]] Link& link() noexcept { return secure_ ? static_cast<Link&>(*secure_) : *plain_; }
  [[nodiscard]] bool secure() const noexcept { return secure_ != nullptr; }
  /// For the first lines of a program.
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept { return notes_; }
  /// What keeps the link from being there, in one line; empty: nothing known. news() has it, too.
  [[nodiscard]] std::string problem() const;
  /// Where the far end is to be found: the address (of a listening end as bound, with its port), or the rendezvous.
  [[nodiscard]] const std::string& where() const noexcept { return address_; }
  /// nullptr where the far end has an address.
  [[nodiscard]] const ice::Dialler* dialler() const noexcept { return dialler_.get(); }
  struct Watch {
    std::function<void(const secure::LinkEvent&)> on_event;       ///< Shown every event.
    std::function<void(const std::string&)> on_changed_pairings;  ///< A line on it.
    std::function<void(std::uint64_t)> on_lost;                   ///< So many events came faster than they were taken.
  };
  /// What has happened to it since the last call, and its problem; what repeats is left out for a while.
  [[nodiscard]] std::vector<cli::News> news(const Watch* watch = nullptr);
  /// What keys for pictures are made of, of the secure session; nullopt once it has ended. False, and secret untouched,
  /// where it is the same as at the last call.
  bool take(std::optional<secure::VideoSecret>& secret) noexcept { return secure_ && secure_->take(secret); }
  /// Tells the far end that nobody is here, after the loop has ended.
  void close() noexcept {
    if (secure_) secure_->close();
  }

  // Operator's side; each returns a line that says what was done, or why not.
  /// Gives control up.
  std::string release();
  /// Gives it to who asked for it last.
  std::string grant();
  /// Asks for it again.
  std::string take_control();

 private:
  using Clock = std::chrono::steady_clock;
  void use(const LinkOptions& options, bool listens);
  [[nodiscard]] bool repeats(const std::string& kind);
  void take_events(std::vector<cli::News>& news, const Watch* watch);
  void follow_control(const secure::LinkEvent& event);
  [[nodiscard]] std::string line_of(secure::LinkEvent event) const;
  [[nodiscard]] std::string no_control() const;

  std::unique_ptr<ice::Dialler> dialler_;  // ends after the link has said farewell over it
  std::unique_ptr<UdpLink> plain_;
  std::shared_ptr<PeersWatch> watch_;  // also the secure link's thread's
  std::unique_ptr<secure::SecureLink> secure_;
  std::vector<std::string> notes_;
  std::string address_;
  bool listens_ = false;
  std::optional<secure::LinkEvent> asker_;
  std::string holder_;  // operator's side: who else has control, as the machine's side calls him; empty: unknown
  std::vector<std::pair<std::string, Clock::time_point>> told_;  // refusals: kind, when
  std::uint64_t events_lost_ = 0;
};

}  // namespace knuckle::pairing
