// Bytes of an MCAP file: its opcodes, and how numbers, texts and records are encoded (https://mcap.dev/spec).
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>

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

}  // namespace knuckle::mcap
