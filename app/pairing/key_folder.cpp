#include "app/pairing/key_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "app/cli/output_file.h"
#include "core/error.h"
#include "machine/toml_reader.h"

namespace knuckle::pairing {
namespace {

namespace fs = std::filesystem;

std::string default_path() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && config[0] == '/') return std::string(config) + "/knuckle";
  const char* home = std::getenv("HOME");
  if (home != nullptr && home[0] == '/') return std::string(home) + "/.config/knuckle";
  throw InputError("--keys: neither HOME nor XDG_CONFIG_HOME says where this computer's key is: give its folder");
}

/// Of this computer, as far as its characters may be in a name.
std::string host_name() {
  std::array<char, 256> host{};
  (void)::gethostname(host.data(), host.size() - 1);
  std::string name(host.data());
  std::erase_if(name, [](char c) { return !secure::is_name(std::string(1, c)); });
  name.resize(std::min(name.size(), secure::kMostNameLength));
  return secure::is_name(name) ? name : "unnamed";
}

}  // namespace

KeyFolder::KeyFolder(const std::string& path) : path_(path.empty() ? default_path() : path) {}

bool KeyFolder::has_key() const {
  return fs::exists(fs::symlink_status(key_file()));
}

secure::Identity KeyFolder::identity() const {
  secure::Identity read = secure::load_identity(key_file());
  if (read.expired())
    throw InputError(key_file() + ": expired on " + read.expires_utc() +
                     ": move it away, make a new one and pair again (knuckle pair)");
  return read;
}

secure::Identity KeyFolder::make(const std::string& name) const {
  secure::Identity made = secure::make_identity(name.empty() ? host_name() : name);
  std::error_code error;
  const bool is_new = fs::create_directories(path_, error);
  if (error) throw InputError(path_ + ": cannot be made: " + error.message());
  if (is_new) (void)::chmod(path_.c_str(), 0700);
  secure::save_identity(made, key_file());
  return made;
}

secure::Peers KeyFolder::peers() const {
  struct stat status {};
  if (::stat(peers_file().c_str(), &status) != 0 && errno == ENOENT) return {};
  if ((status.st_mode & 022U) != 0)
    throw InputError(peers_file() + ": others may write it, and so let anybody lead the machine: chmod 600");
  TomlTable root = TomlTable::read(peers_file());
  secure::Peers peers;
  for (TomlTable& table : root.tables("peer")) {
    secure::Peer& peer = peers.emplace_back();
    peer.name = table.text("name");
    table.require(secure::is_name(peer.name), "name", "must be 1 to 40 letters, digits, spaces and . _ -");
    peer.fingerprint = secure::fingerprint_of_hex(table.text("fingerprint"), peers_file() + ": fingerprint");
    peer.revoked = table.boolean("revoked");
  }
  root.finish();
  return peers;
}

void KeyFolder::save(const secure::Peers& peers) const {
  cli::OutputFile file("peers", peers_file());
  file.stream() << "# Whom this computer is paired with; written by knuckle pair.\n";
  for (const secure::Peer& peer : peers) {
    file.stream() << "\n[[peer]]\nname = \"" << peer.name << "\"\nfingerprint = \"" << secure::hex(peer.fingerprint)
                  << "\"\nrevoked = " << (peer.revoked ? "true" : "false") << '\n';
  }
  file.commit();
  (void)::chmod(peers_file().c_str(), 0600);
}

}  // namespace knuckle::pairing
