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
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace knuckle::audit {

inline constexpr const char* kFileEvent = "file";
inline constexpr const char* kResumedEvent = "resumed";
/// A program that began again did not find the last lines, or not as the head says: the chain is broken here.
inline constexpr const char* kMissingEvent = "missing";
inline constexpr std::size_t kLargestFile_bytes = 64 << 20;

/// Hex, 64 digits.
[[nodiscard]] std::string sha256(std::string_view bytes);
[[nodiscard]] std::string hash_before_all();

[[nodiscard]] std::string file_of(const std::string& folder, std::uint64_t number);
[[nodiscard]] std::string head_file_of(const std::string& folder);
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

}  // namespace knuckle::audit
