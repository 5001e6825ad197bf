// Where recordings lie and how their files are named; what else is in the folder is left alone.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/time.h"
#include "recording/head.h"
#include "recording/mcap/file_writer.h"

namespace knuckle::recording {

/// $KNUCKLE_RECORDINGS, else knuckle/recordings in $XDG_STATE_HOME or ~/.local/state.
[[nodiscard]] std::string default_folder();

/// "2026-11-25T13-05-40Z_slave_part001.mcap"; the time is that of session time 0.
[[nodiscard]] std::string part_name(const Head& head, int part);
/// "2026-11-25T13-07-12.250Z_slave_link_lost.mcap"; the time is that of the event. On virtual time:
/// "12.250s_simulate_link_lost.mcap".
[[nodiscard]] std::string flight_name(const Head& head, Time at, const std::string& why);

/// Ends the name of a file that is being written, or whose writing was cut short.
inline constexpr const char* kUnfinished = ".partial";

/// With everything above it; true where it is there afterwards. Else errno says why.
[[nodiscard]] bool make_folder(const std::string& folder) noexcept;

/// Makes a new file, under this name or, where there is one already, NAME_2.mcap and so on.
/// @return its path; empty where it cannot be made, errno says why.
[[nodiscard]] std::string open_new(mcap::FileWriter& file, const std::string& path);

struct FileOfFolder {
  std::string path;
  std::uint64_t bytes = 0;
  bool flight = false;
  std::filesystem::file_time_type changed{};
};
/// Files of recordings in it, the oldest first; none where there is no folder.
[[nodiscard]] std::vector<FileOfFolder> files_in(const std::string& folder);
/// Deletes the oldest until no more than this is left, parts before flight records; never one that a FileWriter, of
/// whatever program, has open. Where that cannot be told (a file that may not be opened, a file system without locks),
/// none that was changed within a minute of the newest. @return what was deleted.
std::vector<std::string> make_room(const std::string& folder, std::uint64_t most_bytes);

/// The time of change of a file that is being written, by which files_in() puts the newest last: also where the clock
/// is behind. Boards without a battery begin in 1970, and a clock that was ahead leaves files of the future.
class NewestMark {
 public:
  NewestMark() = default;
  /// @param path in a folder of recordings; it becomes the newest there.
  explicit NewestMark(std::string path);
  /// After each time that the file was written or closed.
  void renew() const noexcept;

 private:
  std::string path_;
  std::filesystem::file_time_type least_ = std::filesystem::file_time_type::min();
};

/// Left on the disk of a folder or file; nullopt: not known.
[[nodiscard]] std::optional<std::uint64_t> free_bytes(const std::string& path) noexcept;
/// The whole disk; nullopt: not known.
[[nodiscard]] std::optional<std::uint64_t> disk_bytes(const std::string& path) noexcept;

/// Nothing is there, or a regular file: what is put in place of it takes nothing else away, such as a device or a link.
[[nodiscard]] bool may_be_replaced(const std::string& path);

}  // namespace knuckle::recording
