// The link's messages as bytes, little-endian, by their field lists. For the messages of this folder only.
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <type_traits>

#include "core/fields.h"
#include "core/time.h"
#include "transport/bytes.h"
#include "transport/link.h"
#include "transport/link_header.h"

namespace knuckle::link_codec {

/// No honest time comes near it; within it no difference overflows.
inline constexpr Duration kMostTime = std::chrono::hours(10 * 365 * 24);
inline constexpr unsigned kFlagsInAByte = 8;

/// Visits the fields of a message and appends them.
class FieldWriter {
 public:
  explicit FieldWriter(ByteWriter& out) noexcept : out_(out) {}

  template <typename T, typename... How>
  void operator()(const char*, const T& value, How... how) noexcept {
    if constexpr (std::is_same_v<T, bool>) {
      if (flags_in_ == kFlagsInAByte) end_flags();
      flags_ |= (value ? 1U : 0U) << flags_in_++;
    } else {
      end_flags();
      put(value, how...);
    }
  }
  /// Behind the last field.
  void end_flags() noexcept {
    if (flags_in_ > 0) out_.put(static_cast<std::uint8_t>(flags_));
    flags_ = flags_in_ = 0;
  }

 private:
  template <typename T>
  void put(const T& value) noexcept {
    if constexpr (std::is_same_v<T, Duration>) {
      out_.put(std::int64_t{value.count()});
    } else if constexpr (std::is_same_v<T, float>) {
      // A reason may carry the very NaN it complains of; it must still get through, so it is sent as the largest
      // number.
      out_.put(std::isfinite(value) ? value : std::copysign(std::numeric_limits<float>::max(), value));
    } else if constexpr (ScalarField<T>) {
      static_assert(!std::is_same_v<T, double>, "a double travels within bounds: say which");
      out_.put(number_of(value));
    } else {
      visit_fields(value, *this);
    }
  }
  template <std::unsigned_integral T, typename How>
  void put(T value, How) noexcept {
    out_.put(value);
  }
  void put(double value, wire::Within) noexcept { out_.put(value); }
  void put(double value, wire::Cut bounds) noexcept { out_.put(std::clamp(value, bounds.min, bounds.max)); }
  void put(double value, wire::Single) noexcept {
    constexpr double kMost = std::numeric_limits<float>::max();
    out_.put(static_cast<float>(std::clamp(value, -kMost, kMost)));
  }
  template <VectorField T, typename How>
  void put(const T& values, How how) noexcept {
    for (const double value : values) put(value, how);
  }
  template <std::size_t N>
  void put(const std::array<char, N>& text, wire::Text) noexcept {
    for (const char c : text) out_.put(static_cast<std::uint8_t>(c));
  }

  ByteWriter& out_;
  unsigned flags_ = 0, flags_in_ = 0;
};

[[nodiscard]] inline bool printable(char c) noexcept {
  return c >= ' ' && c <= '~';
}

/// Visits the fields of a message and reads each.
class FieldReader {
 public:
  explicit FieldReader(ByteReader& in) noexcept : in_(in) {}

  template <typename T, typename... How>
  void operator()(const char*, T& value, How... how) noexcept {
    if constexpr (std::is_same_v<T, bool>) {
      if (flags_in_ == kFlagsInAByte) end_flags();
      if (flags_in_++ == 0) flags_ = in_.get<std::uint8_t>();
      value = (flags_ & 1U) != 0;
      flags_ >>= 1;
    } else {
      end_flags();
      get(value, how...);
    }
  }
  /// Behind the last field.
  void end_flags() noexcept {
    accept(flags_ == 0);
    flags_ = flags_in_ = 0;
  }
  /// Every field was there and acceptable.
  [[nodiscard]] bool ok() const noexcept { return ok_ && in_.ok(); }

 private:
  template <typename T>
  void get(T& value) noexcept {
    if constexpr (std::is_same_v<T, Time>) {
      value = Time(Duration(in_.get<std::int64_t>()));
      accept(value.time_since_epoch() >= -kMostTime && value.time_since_epoch() <= kMostTime);
    } else if constexpr (std::is_same_v<T, Duration>) {
      value = Duration(in_.get<std::int64_t>());
      accept(value >= Duration::zero() && value <= kMostTime);
    } else if constexpr (std::is_enum_v<T>) {
      const auto number = in_.get<std::underlying_type_t<T>>();
      accept(number < number_of_words(T{}));
      value = static_cast<T>(number);
    } else if constexpr (std::is_arithmetic_v<T>) {
      value = in_.get<T>();
    } else {
      visit_fields(value, *this);
    }
  }
  template <std::unsigned_integral T>
  void get(T& value, wire::Within bounds) noexcept {
    value = in_.get<T>();
    accept(value >= bounds.min && value <= bounds.max);
  }
  template <std::unsigned_integral T>
  void get(T& value, wire::Bits bits) noexcept {
    value = in_.get<T>();
    accept((value & ~bits.known) == 0);
  }
  template <typename Bounds>
  void get(double& value, Bounds bounds) noexcept {
    value = in_.get<std::conditional_t<std::is_same_v<Bounds, wire::Single>, float, double>>();
    accept(value >= bounds.min && value <= bounds.max);
  }
  template <VectorField T, typename Bounds>
  void get(T& values, Bounds bounds) noexcept {
    for (double& value : values) get(value, bounds);
  }
  template <std::size_t N>
  void get(std::array<char, N>& text, wire::Text) noexcept {
    for (char& c : text) c = static_cast<char>(in_.get<std::uint8_t>());
    const auto end = std::find(text.begin(), text.end(), '\0');
    accept(end != text.end() && std::all_of(text.begin(), end, printable) &&
           std::all_of(end, text.end(), [](char c) { return c == '\0'; }));
  }
  void accept(bool acceptable) noexcept { ok_ = ok_ && acceptable; }

  ByteReader& in_;
  unsigned flags_ = 0, flags_in_ = 0;
  bool ok_ = true;
};

template <typename Message>
[[nodiscard]] Datagram encode(const Message& message, LinkKind kind) noexcept {
  Datagram datagram;
  ByteWriter out(datagram.bytes);
  out.put(kLinkMagic);
  out.put(kLinkVersion);
  out.put(static_cast<std::uint8_t>(kind));
  FieldWriter writer(out);
  visit_fields(message, writer);
  writer.end_flags();
  datagram.size = static_cast<std::uint16_t>(out.size());
  return datagram;
}

/// nullopt where size or header is not that of this kind, or a field not acceptable.
template <typename Message>
[[nodiscard]] std::optional<Message> decode(std::span<const std::uint8_t> bytes, LinkKind kind) noexcept {
  if (link_kind(bytes) != kind) return std::nullopt;
  ByteReader in(bytes.subspan(kLinkHeaderSize));
  Message message;
  FieldReader reader(in);
  visit_fields(message, reader);
  reader.end_flags();
  if (!reader.ok() || !in.at_end()) return std::nullopt;
  return message;
}

}  // namespace knuckle::link_codec
