// The link of a program with a real far end: secure, or plain where that was requested.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/pairing/dial_options.h"
#include "transport/ice/dialler.h"
#include "transport/secure/secure_link.h"
#include "transport/udp_link.h"

namespace CLI {
class App;
}

namespace knuckle::pairing {

struct LinkOptions {
  std::string address;  ///< Of --listen or --connect.
  std::string keys;     ///< Folder; empty: the usual one.
  int insecure = 0;     ///< How often it was said.
  DialOptions dial;     ///< Instead of an address, or of the machine's side beside one.
};
/// --keys and --insecure.
void add_link_options(CLI::App& command, LinkOptions& options);

class ChosenLink {
 public:
  /// @throws InputError where a plain link is requested for an address beyond this computer but not twice, where there
  /// is no key or nobody is paired, and where the address cannot be used.
  static ChosenLink listen(const LinkOptions& options);
  static ChosenLink connect(const LinkOptions& options);

  [[nodiscard]] Link& link() noexcept { return secure_ ? static_cast<Link&>(*secure_) : *plain_; }
  /// For the first lines of a program.
  [[nodiscard]] const std::string& note() const noexcept { return note_; }
  /// What keeps the link from being there, in one line; empty: nothing known.
  [[nodiscard]] std::string problem() const;
  /// Where the far end is to be found: the address, or the rendezvous.
  [[nodiscard]] const std::string& where() const noexcept { return address_; }
  /// nullptr where the far end has an address.
  [[nodiscard]] const ice::Dialler* dialler() const noexcept { return dialler_.get(); }
  /// What has happened to it since the last call, a line each.
  [[nodiscard]] std::vector<std::string> news();
  /// Tells the far end that nobody is here, after the loop has ended.
  void close() noexcept {
    if (secure_) secure_->close();
  }

 private:
  std::unique_ptr<ice::Dialler> dialler_;  // ends after the link has said farewell over it
  std::unique_ptr<UdpLink> plain_;
  std::unique_ptr<secure::SecureLink> secure_;
  std::string note_, address_;
};

}  // namespace knuckle::pairing
