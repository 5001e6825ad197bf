// Little-endian cursors over fixed buffers, byte by byte: what every codec of this folder is written with. Reading past
// the end yields zeros and clears ok(), so a decoder checks once, at its end.
#pragma once

#include <bit>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace knuckle {

/// Writes from the front of a buffer that must be large enough; bytes beyond its end are dropped and ok() is cleared.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::uint8_t> out) noexcept : out_(out) {}
  template <std::integral T>
  void put(T value) noexcept {
    const auto bits = static_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i) byte(static_cast<std::uint8_t>(bits >> (8 * i)));
  }
  void put(float value) noexcept { put(std::bit_cast<std::uint32_t>(value)); }
  void put(double value) noexcept { put(std::bit_cast<std::uint64_t>(value)); }
  [[nodiscard]] std::size_t size() const noexcept { return at_; }
  [[nodiscard]] bool ok() const noexcept { return ok_; }

 private:
  void byte(std::uint8_t value) noexcept {
    if (at_ < out_.size()) {
      out_[at_++] = value;
    } else {
      ok_ = false;
    }
  }
  std::span<std::uint8_t> out_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

/// Reads from the front of a buffer. ok() is false after reading past the end or a non-finite floating-point number.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> in) noexcept : in_(in) {}
  template <std::integral T>
  T get() noexcept {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) bits |= std::uint64_t{byte()} << (8 * i);
    return static_cast<T>(bits);
  }
  template <std::floating_point T>
  T get() noexcept {
    static_assert(std::is_same_v<T, float> || std::is_same_v<T, double>);
    using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
    const T value = std::bit_cast<T>(get<Bits>());
    ok_ = ok_ && std::isfinite(value);
    return value;
  }
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  [[nodiscard]] bool at_end() const noexcept { return at_ == in_.size(); }

 private:
  std::uint8_t byte() noexcept {
    if (at_ < in_.size()) return in_[at_++];
    ok_ = false;
    return 0;
  }
  std::span<const std::uint8_t> in_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace knuckle
