#include "recording/file_names.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <regex>
#include <string_view>
#include <utility>

#include "core/descriptor.h"
#include "core/text.h"
#include "recording/topics.h"

namespace knuckle::recording {
namespace {

namespace fs = std::filesystem;
constexpr const char* kSuffix = ".mcap";
constexpr const char* kPart = "_part";
constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::string stamp(std::int64_t unix_ns) {
  return utc_text(unix_ns / kSecond_ns, "%Y-%m-%dT%H-%M-%S");
}

/// The program without its arguments: "slave" of "knuckle slave --can can0".
std::string side(const Head& head) {
  const std::size_t begin = head.program.find(' ');
  if (begin == std::string::npos) return head.program;
  return head.program.substr(begin + 1, head.program.find(' ', begin + 1) - begin - 1);
}

/// part_name() and flight_name() make these, and nobody else is likely to.
bool ours(const std::string& name) {
  static const std::regex kReal(
      R"(\d{4}-\d\d-\d\dT\d\d-\d\d-\d\d(\.\d{3})?Z_(slave|master|console|simulate|commission|recover)_)"
      R"([a-z_]+\d*(_\d+)?\.mcap)");
  static const std::regex kVirtual(R"(\d+\.\d{3}s_simulate_[a-z_]+(_\d+)?\.mcap)");
  return std::regex_match(name, kReal) || std::regex_match(name, kVirtual);
}

/// A FileWriter holds a lock, which ends with its program however that ends. nullopt: it cannot be told, as the file is
/// somebody else's and may not be opened, or lies where there are no locks.
std::optional<bool> being_written(const std::string& path) {
  Descriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NONBLOCK));  // NFS locks only for those who may write
  if (!file) file = Descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!file) return errno == EACCES ? std::nullopt : std::optional(true);
  const int error = ::flock(file.get(), LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
  return error == 0 ? std::optional(false) : error == EWOULDBLOCK ? std::optional(true) : std::nullopt;
}

}  // namespace

std::string default_folder() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  if (std::string folder = variable("KNUCKLE_RECORDINGS"); !folder.empty()) return folder;
  if (const std::string state = variable("XDG_STATE_HOME"); !state.empty()) return state + "/knuckle/recordings";
  const std::string home = variable("HOME");
  return (home.empty() ? "." : home) + "/.local/state/knuckle/recordings";
}

std::string part_name(const Head& head, int part) {
  return fmt::format("{}Z_{}{}{:03}{}", stamp(head.started_unix_ns), side(head), kPart, part, kSuffix);
}

std::string flight_name(const Head& head, Time at, const std::string& why) {
  const std::int64_t ms = (head.started_unix_ns + at.time_since_epoch().count()) / 1'000'000;
  const std::string when = head.virtual_time ? fmt::format("{:.3f}s", to_seconds(at))
                                             : fmt::format("{}.{:03}Z", stamp(ms * 1'000'000), ms % 1000);
  return when + "_" + side(head) + "_" + why + kSuffix;
}

bool make_folder(const std::string& folder) noexcept {
  std::error_code error;
  fs::create_directories(folder, error);
  if (fs::is_directory(folder, error)) return true;
  errno = error ? error.value() : ENOTDIR;
  return false;
}

std::string open_new(mcap::FileWriter& file, const std::string& path) {
  constexpr int kMostTwins = 99;
  const std::string stem = path.substr(0, path.size() - std::string_view(kSuffix).size());
  for (int twin = 1; twin <= kMostTwins; ++twin) {
    const std::string name = twin == 1 ? path : stem + "_" + std::to_string(twin) + kSuffix;
    if (file.open(name, topics())) return name;
    if (file.error() != EEXIST) break;
  }
  errno = file.error();
  return "";
}

std::vector<FileOfFolder> files_in(const std::string& folder) {
  std::vector<FileOfFolder> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code no_size, no_time;
    const std::string name = entry->path().filename().string();
    if (!ours(name) || !entry->is_regular_file(no_size)) continue;
    const FileOfFolder file{entry->path().string(), entry->file_size(no_size), name.find(kPart) == std::string::npos,
                            entry->last_write_time(no_time)};
    if (!no_size && !no_time) files.push_back(file);  // else it is gone meanwhile
  }
  std::sort(files.begin(), files.end(),
            [](const auto& a, const auto& b) { return std::pair(a.changed, a.path) < std::pair(b.changed, b.path); });
  return files;
}

std::vector<std::string> make_room(const std::string& folder, std::uint64_t most_bytes) {
  constexpr auto kLately = 1min;
  std::vector<FileOfFolder> files = files_in(folder);
  std::uint64_t total = 0;
  for (const FileOfFolder& file : files) total += file.bytes;
  // Not by the clock, which may be wrong: what is being written is marked as the newest.
  const auto late = (files.empty() ? fs::file_time_type() : files.back().changed) - kLately;
  const auto live = [late](const FileOfFolder& file) { return being_written(file.path).value_or(file.changed > late); };
  std::stable_partition(files.begin(), files.end(), [](const FileOfFolder& file) { return !file.flight; });
  std::vector<std::string> deleted;
  for (const FileOfFolder& file : files) {
    if (total <= most_bytes) break;
    std::error_code error;
    if (live(file) || !fs::remove(file.path, error)) continue;
    total -= file.bytes;
    deleted.push_back(file.path);
  }
  return deleted;
}

NewestMark::NewestMark(std::string path) : path_(std::move(path)) {
  constexpr auto kCoarsest = 2s;  // some file systems know no finer times
  for (const FileOfFolder& other : files_in(fs::path(path_).parent_path().string()))
    if (other.path != path_) least_ = std::max(least_, other.changed + kCoarsest);
  renew();
}

void NewestMark::renew() const noexcept {
  std::error_code ignored;
  if (!path_.empty() && fs::file_time_type::clock::now() < least_) fs::last_write_time(path_, least_, ignored);
}

std::optional<std::uint64_t> free_bytes(const std::string& path) noexcept {
  std::error_code error;
  const fs::space_info space = fs::space(fs::path(path), error);
  if (error || space.capacity == 0) return std::nullopt;  // a root file system in memory has no size
  return space.available;
}

std::optional<std::uint64_t> disk_bytes(const std::string& path) noexcept {
  std::error_code error;
  const fs::space_info space = fs::space(fs::path(path), error);
  if (error || space.capacity == 0) return std::nullopt;
  return space.capacity;
}

bool may_be_replaced(const std::string& path) {
  std::error_code ignored;
  const auto type = std::filesystem::symlink_status(path, ignored).type();
  return type == std::filesystem::file_type::not_found || type == std::filesystem::file_type::regular;
}

}  // namespace knuckle::recording
