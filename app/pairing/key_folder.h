// The folder with this computer's key and whom it is paired with: key.pem, peers.toml.
#pragma once

#include <string>

#include "transport/secure/identity.h"

namespace knuckle::pairing {

class KeyFolder {
 public:
  /// @param path empty: $XDG_CONFIG_HOME/knuckle, or ~/.config/knuckle.
  explicit KeyFolder(const std::string& path = {});

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::string key_file() const { return path_ + "/key.pem"; }
  [[nodiscard]] std::string peers_file() const { return path_ + "/peers.toml"; }

  [[nodiscard]] bool has_key() const;
  /// @throws InputError where there is none, others may read it, it is no key, or it has expired.
  [[nodiscard]] secure::Identity identity() const;
  /// Makes folder (mode 0700) and key. @param name empty: this computer's. @throws InputError
  secure::Identity make(const std::string& name) const;
  /// Empty where there is no file. @throws InputError for a malformed one, or one that others may write.
  [[nodiscard]] secure::Peers peers() const;
  /// Whole or not at all. @throws InputError
  void save(const secure::Peers& peers) const;

 private:
  std::string path_;
};

}  // namespace knuckle::pairing
