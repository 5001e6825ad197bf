// The folder with this computer's key and whom it is paired with: key.pem, peers.toml.
#pragma once

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "transport/secure/identity.h"

namespace knuckle::pairing {

// Files that only their owner may read or write, and that are never there in part.

enum class Existing : std::uint8_t { kRefuse, kReplace };

/// Behind the name of a file that is being written, and that is left where its program was killed meanwhile.
inline constexpr const char* kLeftOver = ".part-";

/// Whole or not at all, mode 0600, on the disk when it returns. @throws InputError
void write_private_file(const std::string& file, const std::string& text, Existing existing);
/// Of a file that decides who controls the machine, or of the folder of one. @param what "file" or "folder".
/// @throws InputError where it belongs to another user, or anybody else may write it.
void check_only_owner_writes(const std::string& path, const char* what);

/// What the folder holds is named so (cli::KeptName): without it this computer is nobody.
[[nodiscard]] const char* kept_name(const std::filesystem::path& place);

class KeyFolder {
 public:
  /// @param path empty: $XDG_CONFIG_HOME/knuckle, or ~/.config/knuckle.
  explicit KeyFolder(const std::string& path = {});

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] std::string key_file() const { return path_ + "/key.pem"; }
  [[nodiscard]] std::string peers_file() const { return path_ + "/peers.toml"; }
  /// Credentials for a TURN server.
  [[nodiscard]] std::string turn_file() const { return path_ + "/turn.toml"; }

  [[nodiscard]] bool has_key() const;
  /// @throws InputError where there is none, others may read it or write the folder, it is no key, or it is not valid
  /// now.
  [[nodiscard]] secure::Identity identity() const;
  /// The same, also where it is not valid now.
  [[nodiscard]] secure::Identity stored_identity() const;
  /// Makes folder (mode 0700) and key. @param name empty: this computer's. @throws InputError, also where a key is
  /// there.
  secure::Identity make(const std::string& name) const;
  /// A new key in place of the old one, of the same name where `name` is empty, also where the old one is damaged and a
  /// name is given. Pairings stay known. @throws InputError
  secure::Identity renew(const std::string& name) const;
  /// Empty where there is no file. @throws InputError for a malformed one, one that others may write, or one that has
  /// a fingerprint or a name twice.
  [[nodiscard]] secure::Peers peers() const;
  /// @throws InputError where change_peers() could not write.
  void check_can_be_written() const;
  /// Reads, changes, writes: whole or not at all, one program at a time. @throws InputError
  void change_peers(const std::function<void(secure::Peers&)>& change) const;

 private:
  void check_folder() const;
  void make_folder() const;
  void remove_leftovers() const;
  std::string path_;
};

/// Why a key cannot be used now: it has expired, or is not valid yet; empty where it can.
[[nodiscard]] std::string not_valid_now(const secure::Identity& identity);
/// Days until a certificate expires. @param utc "2031-11-24T05:00:00Z"; nothing where it is no such time.
[[nodiscard]] std::optional<double> days_left(const std::string& utc);
inline constexpr double kWarnDays = 30;
inline constexpr const char* kThisComputers = "this computer's";
/// "desk 1's key expires on ..., in 12 days: ..."; empty where that is far away or not known.
/// @param whose kThisComputers, or that of a far end.
[[nodiscard]] std::string expiry_warning(const std::string& whose, const std::string& utc);

/// Where this computer's clock is before this program was written, so that keys made now expire too early; else empty.
[[nodiscard]] std::string clock_warning(std::time_t now = std::time(nullptr));

/// Notices that the file of peers was changed, for programs that run. For two threads.
class PeersWatch {
 public:
  explicit PeersWatch(KeyFolder folder);
  /// The peers, where the file is another than at the last call. One that cannot be read changes nothing: then
  /// problem() says why.
  [[nodiscard]] std::optional<secure::Peers> changed();
  /// What there is to say since the last call, in one line; empty: nothing.
  [[nodiscard]] std::string news();

 private:
  [[nodiscard]] std::string stamp() const;
  KeyFolder folder_;
  std::string stamp_;
  std::mutex mutex_;
  std::string news_;
};

}  // namespace knuckle::pairing
