// The files of an audit trail: FOLDER/audit-000001.jsonl and so on, one JSON object a line, oldest first; and
// FOLDER/head, which says how far they go.
//
// Each line has its number `n` and, in `before`, the SHA-256 of the line before it (without its line feed), across
// files; of the very first line: 64 zeros. The first line of each file is a `file` event: `file` its own number,
// `oldest` that of the oldest file that is kept. What a killed program or a power cut left unfinished stays where it
// is, line feeds and all; the line after it is a `resumed` event with its size and SHA-256 (without its last line
// feed).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/cli/command.h"

namespace knuckle::audit {

inline constexpr const char* kFileEvent = "file";
inline constexpr const char* kResumedEvent = "resumed";
/// A program that began again did not find the last lines, or not as the head says: the chain is broken here.
inline constexpr const char* kMissingEvent = "missing";
inline constexpr std::size_t kLargestFile_bytes = 64 << 20;

[[nodiscard]] std::string hash_before_all();

[[nodiscard]] std::string file_of(const std::string& folder, std::uint64_t number);
[[nodiscard]] std::string head_file_of(const std::string& folder);
/// A trail's files are named so (cli::KeptName): without them its history is gone.
[[nodiscard]] const char* kept_name(const std::filesystem::path& place);
/// Numbers of the files that are there, ascending. @throws InputError where the folder cannot be read.
[[nodiscard]] std::vector<std::uint64_t> file_numbers(const std::string& folder);

/// What the chain needs of a line; nothing where it is no line of a trail.
struct Link {
  std::uint64_t number = 0;
  std::string before, event;
  std::uint64_t file = 0, oldest = 0;  ///< Of a `file` event.
  std::uint64_t torn_bytes = 0;        ///< Of a `resumed` event, with the next.
  std::string torn_sha256;
};
[[nodiscard]] std::optional<Link> link_of(const std::string& line);

struct Line {
  std::string text;          ///< Without its line feed.
  std::optional<Link> link;  ///< Of one that is none, or that is unfinished: nothing.
  bool unfinished = false;   ///< As a `resumed` line after it says.
};
struct FileContent {
  std::vector<Line> lines;  ///< Whole ones.
  std::string rest;         ///< After the last line feed.
};
/// @throws InputError where it cannot be read, is no regular file, or is larger than kLargestFile_bytes.
[[nodiscard]] FileContent read_lines(const std::string& file);

/// Number and hash of the newest line that is safely on the disk.
struct Head {
  std::uint64_t number = 0;
  std::string hash;
};
[[nodiscard]] std::string head_text(const Head& head);
/// Nothing where there is none. @throws InputError where it is no regular file.
[[nodiscard]] std::optional<Head> read_head(const std::string& folder);

// Whether an audit trail is as it was written.

struct Check {
  std::vector<std::string> lines;  ///< All that are there, oldest first.
  std::vector<std::string> notes;  ///< What is worth knowing and breaks nothing: removed by rotation, unfinished lines.
  /// "FILE:LINE: why" of all breaks, but in each file only of the first: more may follow from it. Empty: the chain is
  /// whole.
  std::vector<std::string> breaks;
  std::size_t files = 0;
  Head last;  ///< Number 0 where there is no line.
  /// The first break; empty where there is none.
  [[nodiscard]] std::string broken() const { return breaks.empty() ? "" : breaks.front(); }
};
/// @throws InputError where folder or files cannot be read.
[[nodiscard]] Check check_trail(const std::string& folder);

/// A line of a Check for people, printable: "2026-11-25T07:08:09.123Z connected: name=desk 1, fingerprint=QF3K-..."
[[nodiscard]] std::string readable(const std::string& line);

/// Exit codes: 0 the chain is whole, 1 it is broken.
[[nodiscard]] cli::Command audit_entry();

}  // namespace knuckle::audit
