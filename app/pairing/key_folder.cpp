#include "app/pairing/key_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

#include "app/cli/output_file.h"
#include "core/descriptor.h"
#include "core/error.h"
#include "machine/toml_reader.h"

namespace knuckle::pairing {

namespace {

[[noreturn]] void refuse(const std::string& file, int error) {
  throw InputError(file + ": cannot be written: " + std::strerror(error));
}

/// @return 0, or errno.
int write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t count = ::write(descriptor, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    text.remove_prefix(static_cast<std::size_t>(count));
  }
  return ::fsync(descriptor) == 0 ? 0 : errno;
}

/// Or a power cut may bring the old name back.
void sync_folder_of(const std::string& file) {
  const std::string folder = std::filesystem::absolute(file).parent_path();
  const Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor) (void)::fsync(descriptor.get());
}

}  // namespace

void write_private_file(const std::string& file, const std::string& text, Existing existing) {
  std::string beside = file + kLeftOver + "XXXXXX";
  Descriptor descriptor(::mkostemp(beside.data(), O_CLOEXEC));  // mode 0600
  if (!descriptor) refuse(file, errno);
  int error = write_all(descriptor.get(), text);
  if (const int refused = descriptor.close(); error == 0) error = refused;
  // A second name fails where there is a file; renaming would replace it.
  if (error == 0) {
    const bool put = existing == Existing::kReplace ? ::rename(beside.c_str(), file.c_str()) == 0
                                                    : ::link(beside.c_str(), file.c_str()) == 0;
    if (!put) error = errno;
  }
  if (error != 0 || existing == Existing::kRefuse) ::unlink(beside.c_str());
  if (error == EEXIST) throw InputError(file + ": is there already");
  if (error != 0) refuse(file, error);
  sync_folder_of(file);
}

void check_only_owner_writes(const std::string& path, const char* what) {
  cli::check_only_owner_writes(path, what, "let anybody control the machine");
}

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

/// One program at a time changes what is in a folder: the one that holds this.
Descriptor locked(const std::string& folder) {
  Descriptor lock(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock || ::flock(lock.get(), LOCK_EX) != 0)
    throw InputError(folder + ": cannot be locked: " + std::strerror(errno));
  return lock;
}

std::string written(const secure::Peers& peers) {
  std::string text = "# Whom this computer is paired with; written by knuckle pair.\n";
  for (const secure::Peer& peer : peers) {
    text += fmt::format(
        "\n[[peer]]\nname = \"{}\"\nfingerprint = \"{}\"\nrole = \"{}\"\nexpires = \"{}\"\nrevoked = {}\n", peer.name,
        secure::hex(peer.fingerprint), peer.observer ? "observer" : "operator", peer.expires_utc, peer.revoked);
  }
  return text;
}

}  // namespace

const char* kept_name(const std::filesystem::path& place) {
  const KeyFolder here(".");
  const auto is = [name = place.filename()](const std::string& file) {
    return std::filesystem::path(file).filename() == name;
  };
  if (is(here.key_file())) return "is named like a computer's private key";
  return is(here.peers_file()) || is(here.turn_file()) ? "is named like a file of the pairings" : nullptr;
}

KeyFolder::KeyFolder(const std::string& path) : path_(path.empty() ? default_path() : path) {}

bool KeyFolder::has_key() const {
  return fs::exists(fs::symlink_status(key_file()));
}

secure::Identity KeyFolder::identity() const {
  secure::Identity read = stored_identity();
  if (const std::string why = not_valid_now(read); !why.empty()) throw InputError(key_file() + ": " + why);
  return read;
}

secure::Identity KeyFolder::stored_identity() const {
  std::error_code error;
  if (fs::exists(path_, error)) check_folder();
  return secure::load_identity(key_file());
}

void KeyFolder::check_folder() const {
  std::error_code error;
  if (fs::exists(path_, error) && !fs::is_directory(path_, error)) throw InputError(path_ + ": is no folder");
  check_only_owner_writes(path_, "folder");
}

void KeyFolder::make_folder() const {
  std::error_code error;
  const bool is_new = !fs::exists(path_, error) && fs::create_directories(path_, error);
  if (error) throw InputError(path_ + ": cannot be written: " + error.message());
  if (is_new) (void)::chmod(path_.c_str(), 0700);
  check_folder();
}

/// Of a program that was killed while it wrote (write_private_file), perhaps a private key. The folder is locked.
void KeyFolder::remove_leftovers() const {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(path_, error)) {
    const std::string name = entry.path().filename();
    const std::string file = name.substr(0, name.find(kLeftOver));
    const bool left = file != name && (file == "key.pem" || file == "peers.toml");
    if (left) fs::remove(entry.path(), error);
  }
}

secure::Identity KeyFolder::make(const std::string& name) const {
  secure::Identity made = secure::make_identity(name.empty() ? host_name() : name);
  make_folder();
  const Descriptor lock = locked(path_);
  remove_leftovers();
  write_private_file(key_file(), made.pem(), Existing::kRefuse);
  return made;
}

secure::Identity KeyFolder::renew(const std::string& name) const {
  if (!has_key()) return make(name);
  check_folder();
  const Descriptor lock = locked(path_);
  remove_leftovers();
  secure::Identity made = secure::make_identity(name.empty() ? secure::load_identity(key_file()).name : name);
  write_private_file(key_file(), made.pem(), Existing::kReplace);
  return made;
}

secure::Peers KeyFolder::peers() const {
  if (!fs::exists(peers_file())) return {};
  check_folder();
  check_only_owner_writes(peers_file(), "file");
  TomlTable root = TomlTable::read(peers_file(), false);
  secure::Peers peers;
  for (TomlTable& table : root.tables("peer")) {
    secure::Peer& peer = peers.emplace_back();
    peer.name = table.text("name");
    table.require(secure::is_name(peer.name), "name", "must be 1 to 40 letters, digits, spaces and . _ -");
    const auto fingerprint = secure::fingerprint_of_hex(table.text("fingerprint"));
    if (table.require(fingerprint.has_value(), "fingerprint", "must be 64 hexadecimal digits"))
      peer.fingerprint = *fingerprint;
    const auto known = [&peers](const auto& same) { return std::any_of(peers.begin(), peers.end() - 1, same); };
    table.require(!known([&](const secure::Peer& one) { return one.name == peer.name; }), "name",
                  "must be of one far end only: remove one of the two");
    table.require(!known([&](const secure::Peer& one) { return one.fingerprint == peer.fingerprint; }), "fingerprint",
                  "must be of one far end only: remove one of the two");
    peer.observer = table.choice("role", {"operator", "observer"}) == 1;
    peer.expires_utc = table.text("expires");
    table.require(days_left(peer.expires_utc).has_value(), "expires", "must be a time such as 2031-11-24T05:00:00Z");
    peer.revoked = table.boolean("revoked");
  }
  root.finish();
  return peers;
}

void KeyFolder::check_can_be_written() const {
  if (::access(path_.c_str(), W_OK | X_OK) != 0)
    throw InputError(path_ + ": no pairing can be stored here: " + std::strerror(errno));
}

void KeyFolder::change_peers(const std::function<void(secure::Peers&)>& change) const {
  const Descriptor lock = locked(path_);
  remove_leftovers();
  secure::Peers known = peers();
  change(known);
  write_private_file(peers_file(), written(known), Existing::kReplace);
}

std::string not_valid_now(const secure::Identity& identity) {
  if (identity.expired())
    return "expired on " + identity.expires_utc() +
           " (or this computer's clock is wrong): make a new one (knuckle pair --renew) and pair again";
  if (identity.not_yet_valid()) return "is not valid yet: this computer's clock is behind; set it (timedatectl)";
  return "";
}

std::optional<double> days_left(const std::string& utc) {
  std::tm time{};
  const char* end = ::strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%SZ", &time);
  if (end == nullptr || *end != '\0') return std::nullopt;
  return std::difftime(::timegm(&time), std::time(nullptr)) / 86400;
}

std::string expiry_warning(const std::string& whose, const std::string& utc) {
  const std::optional<double> days = days_left(utc);
  if (!days || *days > kWarnDays) return "";
  const char* where = whose == kThisComputers ? "here" : "there";
  if (*days <= 0)
    return fmt::format("{} key expired on {}: make a new one {} (knuckle pair --renew) and pair again", whose, utc,
                       where);
  return fmt::format(
      "{} key expires on {}, in {:.0f} days: make a new one {} in time (knuckle pair --renew) and pair again", whose,
      utc, *days, where);
}

std::string clock_warning(std::time_t now) {
  constexpr std::time_t kWritten = 1'793'491'200;  // 2026-11-01 UTC: no clock was right before this was written
  if (now >= kWritten) return "";
  return fmt::format(
      "this computer's clock is {:.0f} days or more behind: set it (timedatectl), then make the key anew (knuckle pair "
      "--renew), or it expires as much too early",
      std::ceil(std::difftime(kWritten, now) / 86400));
}

PeersWatch::PeersWatch(KeyFolder folder) : folder_(std::move(folder)), stamp_(stamp()) {}

/// A file that was renamed into place is another one.
std::string PeersWatch::stamp() const {
  struct stat status {};
  if (::stat(folder_.peers_file().c_str(), &status) != 0) return "none";
  return fmt::format("{} {} {} {}.{} {}.{}", status.st_ino, status.st_size, status.st_mode, status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec, status.st_ctim.tv_sec, status.st_ctim.tv_nsec);
}

std::optional<secure::Peers> PeersWatch::changed() {
  const std::string now = stamp();
  if (now == stamp_) return std::nullopt;
  stamp_ = now;
  std::optional<secure::Peers> peers;
  std::string news = "pairings were changed: " + folder_.peers_file();
  try {
    peers = folder_.peers();
  } catch (const InputError& error) {
    news = std::string(error.what()) + ": the pairings from before stay in use";
  }
  const std::lock_guard lock(mutex_);
  news_ = news;
  return peers;
}

std::string PeersWatch::news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

}  // namespace knuckle::pairing
