// Bytes of an MCAP file: its opcodes, and how numbers, texts and records are encoded (https://mcap.dev/spec).
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/descriptor.h"
#include "recording/mcap/contents.h"

namespace knuckle::mcap {

static_assert(std::endian::native == std::endian::little, "numbers are copied as they are in memory");

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kAttachment,
  kAttachmentIndex,
  kStatistics,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd,
};
/// Opcode and length of content.
inline constexpr std::size_t kRecordHead_bytes = 1 + 8;
inline constexpr std::size_t kFooter_bytes = kRecordHead_bytes + 8 + 8 + 4;
/// Of a message, before its data.
inline constexpr std::size_t kMessageHead_bytes = 2 + 4 + 8 + 8;

/// Appends to bytes.
class Encoder {
 public:
  explicit Encoder(Bytes& out) noexcept : out_(out) {}

  template <typename Number>
  void number(Number value) {
    append(&value, sizeof value);
  }
  void append(const void* bytes, std::size_t size) {
    const std::size_t at = out_.size();
    out_.resize(at + size);
    if (size > 0) std::memcpy(out_.data() + at, bytes, size);
  }
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    append(value.data(), value.size());
  }
  void texts(const Texts& values);
  /// A record with whatever content() appends.
  template <typename Content>
  void record(Opcode opcode, const Content& content) {
    number(opcode);
    const std::size_t at = out_.size();
    number(std::uint64_t{0});
    content();
    overwrite(at, static_cast<std::uint64_t>(out_.size() - at - 8));
  }
  /// A number that is already there.
  template <typename Number>
  void overwrite(std::size_t at, Number value) {
    std::memcpy(out_.data() + at, &value, sizeof value);
  }
  /// What was appended since its size was `at`; until more is.
  [[nodiscard]] std::span<const std::uint8_t> since(std::size_t at) const noexcept {
    return std::span<const std::uint8_t>(out_).subspan(at);
  }
  [[nodiscard]] std::size_t size() const noexcept { return out_.size(); }

 private:
  Bytes& out_;
};

/// Takes bytes apart; what is read beyond their end is zero or empty, and ok() false from then on.
class Decoder {
 public:
  explicit Decoder(std::span<const std::uint8_t> bytes) noexcept : left_(bytes) {}

  template <typename Number>
  [[nodiscard]] Number number() noexcept {
    Number value{};
    if (const auto from = bytes(sizeof value); ok_) std::memcpy(&value, from.data(), sizeof value);
    return value;
  }
  [[nodiscard]] std::span<const std::uint8_t> bytes(std::uint64_t size) noexcept {
    ok_ = ok_ && size <= left_.size();
    if (!ok_) return {};
    const auto taken = left_.first(static_cast<std::size_t>(size));
    left_ = left_.subspan(taken.size());
    return taken;
  }
  [[nodiscard]] std::string_view text() noexcept {
    const auto taken = bytes(number<std::uint32_t>());
    return {reinterpret_cast<const char*>(taken.data()), taken.size()};
  }
  [[nodiscard]] Texts texts();
  [[nodiscard]] std::span<const std::uint8_t> rest() const noexcept { return left_; }
  [[nodiscard]] bool ok() const noexcept { return ok_; }

 private:
  std::span<const std::uint8_t> left_;
  bool ok_ = true;
};

void encode(Encoder& to, std::uint16_t id, const Schema& schema);
void encode(Encoder& to, std::uint16_t id, const Channel& channel);
void encode(Encoder& to, const Attachment& attachment);
void encode(Encoder& to, const Metadata& metadata);

/// CRC-32 as zip has it.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes) noexcept;
/// Of a part and the next one, from the CRC-32 of each.
[[nodiscard]] std::uint32_t crc32_joined(std::uint32_t first, std::uint32_t second,
                                         std::uint64_t second_bytes) noexcept;

// An MCAP file as a row of records, each found from the end of the one before. Every length is checked against the
// file.

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
