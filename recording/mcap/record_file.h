// An MCAP file as a row of records, each found from the end of the one before. Every length is checked against the
// file.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/descriptor.h"
#include "recording/mcap/contents.h"
#include "recording/mcap/records.h"

namespace knuckle::mcap {

// What is wrong with a file, in lines for people.

class Damages {
 public:
  explicit Damages(std::string file) : file_(std::move(file)) {}
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

  /// "FILE: WHAT at byte AT (WHEN): WHY"; once, however often it is met.
  void add(std::string_view what, std::uint64_t at, std::string_view why, std::string_view when = "");
  /// Of more than a hundred the last line says so.
  [[nodiscard]] const std::vector<std::string>& lines() const noexcept { return lines_; }

 private:
  std::string file_;
  std::vector<std::string> lines_;
};

/// The largest record that is read, and the largest chunk after decompression; larger ones are left out.
inline constexpr std::uint64_t kLargestRecord_bytes = 256 << 20;

/// Where a record is; all of it is in the file.
struct Record {
  Opcode opcode{};
  std::uint64_t at = 0, bytes = 0;  ///< With its head.

  [[nodiscard]] std::uint64_t content_at() const noexcept { return at + kRecordHead_bytes; }
  [[nodiscard]] std::uint64_t content_bytes() const noexcept { return bytes - kRecordHead_bytes; }
  [[nodiscard]] std::uint64_t end() const noexcept { return at + bytes; }
};

class RecordFile {
 public:
  /// @throws InputError where it cannot be opened or is no MCAP file.
  explicit RecordFile(const std::string& path);
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;

  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
  /// Nothing at the end of the file, or where there is no whole record, which is damage.
  [[nodiscard]] std::optional<Record> record_at(std::uint64_t at);
  /// Nothing where it is too large or cannot be read, which is damage. Valid until the next call of anything.
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> content(const Record& record);
  /// The beginning of its content, as much as there is of so many bytes; otherwise as content().
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> content(const Record& record, std::uint64_t bytes);
  /// Of any place that is in the file, in place of what was in `to`. @return false where they cannot be read.
  [[nodiscard]] bool read(std::uint64_t at, std::uint64_t bytes, Bytes& to) const;

  void damaged(const Record& record, std::string_view why, std::string_view when = "");
  Damages damages;

 private:
  [[nodiscard]] std::optional<std::span<const std::uint8_t>> window(std::uint64_t at, std::uint64_t bytes);

  Descriptor file_;
  std::uint64_t size_ = 0;
  Bytes window_;  ///< Of the file, as records' heads stand close to each other.
  std::uint64_t window_at_ = 0;
};

}  // namespace knuckle::mcap
