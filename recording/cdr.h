// CDR, the byte order of ROS 2 messages (OMG XTypes 1.3, section 7.4.3, version 1, little-endian): numbers aligned to
// their own size, sequences and strings behind a 32-bit count. What Foxglove and PlotJuggler read as it is.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace knuckle::recording {

/// Version 1, little-endian, no options: in front of every message. Alignment counts from behind it.
inline constexpr std::array<std::uint8_t, 4> kCdrHeader{0, 1, 0, 0};

/// Writes into memory that is there; beyond its end nothing is written, and ok() is false.
class CdrWriter {
 public:
  /// Begins a message. @param room for it and its header.
  explicit CdrWriter(std::span<std::uint8_t> room) noexcept : room_(room) {
    bytes(kCdrHeader.data(), kCdrHeader.size());
  }

  template <typename Number>
  void put(Number value) noexcept {
    align(sizeof value);
    bytes(&value, sizeof value);
  }
  /// A sequence of bytes.
  void put_bytes(std::span<const std::uint8_t> data) noexcept {
    put(static_cast<std::uint32_t>(data.size()));
    bytes(data.data(), data.size());
  }
  void put_text(std::string_view text) noexcept {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes(text.data(), text.size());
    put(std::uint8_t{0});
  }
  /// builtin_interfaces/Time.
  void put_time(std::int64_t unix_ns) noexcept {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    put(static_cast<std::int32_t>(unix_ns / kSecond_ns));
    put(static_cast<std::uint32_t>(unix_ns % kSecond_ns));
  }
  /// Overwrites what lies `at` behind the message's header.
  template <typename Number>
  void patch(std::size_t at, Number value) noexcept {
    if (kCdrHeader.size() + at + sizeof value <= size_)
      std::memcpy(&room_[kCdrHeader.size() + at], &value, sizeof value);
  }

  [[nodiscard]] bool ok() const noexcept { return ok_; }
  /// Header included.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::span<const std::uint8_t> written() const noexcept { return room_.first(size_); }
  /// Takes back all behind the first `size` bytes.
  void cut(std::size_t size) noexcept {
    size_ = size;
    ok_ = true;
  }

 private:
  void align(std::size_t to) noexcept {
    constexpr std::array<std::uint8_t, 8> kZeros{};
    const std::size_t over = (size_ - kCdrHeader.size()) % to;
    if (over != 0) bytes(kZeros.data(), to - over);
  }
  void bytes(const void* data, std::size_t size) noexcept {
    ok_ = ok_ && size <= room_.size() - size_;
    if (!ok_ || size == 0) return;
    std::memcpy(&room_[size_], data, size);
    size_ += size;
  }

  std::span<std::uint8_t> room_;
  std::size_t size_ = 0;
  bool ok_ = true;
};

/// Reads a message; whatever lies beyond its end reads as zero, and ok() is false.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::uint8_t> message) noexcept : message_(message) {
    std::array<std::uint8_t, 4> header{};
    bytes(header.data(), header.size());
    ok_ = ok_ && header[0] == kCdrHeader[0] && header[1] == kCdrHeader[1];
  }

  template <typename Number>
  void get(Number& value) noexcept {
    align(sizeof value);
    value = {};
    bytes(&value, sizeof value);
  }
  template <typename Number>
  [[nodiscard]] Number get() noexcept {
    Number value{};
    get(value);
    return value;
  }
  /// A sequence of bytes, in the message's own memory.
  [[nodiscard]] std::span<const std::uint8_t> get_bytes() noexcept {
    const auto size = get<std::uint32_t>();
    ok_ = ok_ && size <= message_.size() - at_;
    if (!ok_) return {};
    at_ += size;
    return message_.subspan(at_ - size, size);
  }
  [[nodiscard]] std::string get_text() {
    const auto text = get_bytes();
    return text.empty() ? std::string() : std::string(text.begin(), text.end() - 1);
  }
  /// builtin_interfaces/Time, as Unix time.
  [[nodiscard]] std::int64_t get_time() noexcept {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    const std::int64_t seconds = get<std::int32_t>();
    return seconds * kSecond_ns + get<std::uint32_t>();
  }
  /// What was read is no value of its field.
  void refuse() noexcept { ok_ = false; }
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  /// Behind what was read.
  [[nodiscard]] std::size_t at() const noexcept { return at_; }

 private:
  void align(std::size_t to) noexcept {
    if (at_ < kCdrHeader.size()) return;
    const std::size_t over = (at_ - kCdrHeader.size()) % to;
    if (over != 0) skip(to - over);
  }
  void skip(std::size_t size) noexcept {
    ok_ = ok_ && size <= message_.size() - at_;
    if (ok_) at_ += size;
  }
  void bytes(void* data, std::size_t size) noexcept {
    ok_ = ok_ && size <= message_.size() - at_;
    if (!ok_) return;
    std::memcpy(data, &message_[at_], size);
    at_ += size;
  }

  std::span<const std::uint8_t> message_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace knuckle::recording
