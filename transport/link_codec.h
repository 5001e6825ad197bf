// What the codecs of the link's messages have in common: one header, and numbers that must be within bounds. For the
// codecs of this folder only.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/time.h"
#include "transport/bytes.h"
#include "transport/link.h"
#include "transport/link_kind.h"
#include "transport/link_stamp.h"

namespace knuckle::link_codec {

/// No honest time comes near it; within it no difference overflows.
inline constexpr Duration kMostTime = std::chrono::hours(10 * 365 * 24);

/// A writer past the header of a datagram of this size.
inline ByteWriter begin(Datagram& datagram, LinkKind kind, std::size_t size) noexcept {
  datagram.size = static_cast<std::uint16_t>(size);
  ByteWriter out(std::span(datagram.bytes).first(size));
  out.put(kLinkMagic);
  out.put(kLinkVersion);
  out.put(static_cast<std::uint8_t>(kind));
  return out;
}

/// A reader past the header; nullopt where size or header is not that of this kind.
inline std::optional<ByteReader> open(std::span<const std::uint8_t> bytes, LinkKind kind, std::size_t size) noexcept {
  if (bytes.size() != size || link_kind(bytes) != kind) return std::nullopt;
  return ByteReader(bytes.subspan(kLinkHeaderSize));
}

inline void put(ByteWriter& out, Duration duration) noexcept {
  out.put(std::int64_t{duration.count()});
}
inline void put(ByteWriter& out, Time time) noexcept {
  put(out, time.time_since_epoch());
}
inline constexpr std::size_t kStampSize = 2 * 8 + 4 + 2 * 8;
inline void put(ByteWriter& out, const LinkStamp& stamp) noexcept {
  out.put(stamp.session);
  out.put(stamp.echoed_session);
  out.put(stamp.sequence);
  put(out, stamp.sent_at);
  put(out, stamp.echoed);
}
template <typename Values>
void put_each(ByteWriter& out, const Values& values) noexcept {
  for (const double value : values) out.put(value);
}
/// For what has no bound of its own and must not cost the message.
template <typename Values>
void put_each(ByteWriter& out, const Values& values, double most) noexcept {
  for (const double value : values) out.put(std::clamp(value, -most, most));
}

/// Reads numbers that must be within bounds.
class BoundedReader {
 public:
  explicit BoundedReader(ByteReader& in) noexcept : in_(in) {}
  Time time() noexcept { return Time(between(-kMostTime, kMostTime)); }
  LinkStamp stamp() noexcept {
    LinkStamp stamp;
    stamp.session = in_.get<std::uint64_t>();
    stamp.echoed_session = in_.get<std::uint64_t>();
    stamp.sequence = in_.get<std::uint32_t>();
    stamp.sent_at = time();
    stamp.echoed = time();
    return stamp;
  }
  /// Not negative.
  Duration span() noexcept { return between(Duration::zero(), kMostTime); }
  double number(double min, double max) noexcept { return within(in_.get<double>(), min, max); }
  double single(double min, double max) noexcept { return within(double{in_.get<float>()}, min, max); }
  template <typename Values>
  void each(Values& values, double most) noexcept {
    for (double& value : values) value = number(-most, most);
  }
  [[nodiscard]] bool ok() const noexcept { return ok_ && in_.ok(); }

 private:
  Duration between(Duration min, Duration max) noexcept {
    const Duration value{in_.get<std::int64_t>()};
    ok_ = ok_ && value >= min && value <= max;
    return value;
  }
  double within(double value, double min, double max) noexcept {
    ok_ = ok_ && value >= min && value <= max;
    return value;
  }
  ByteReader& in_;
  bool ok_ = true;
};

}  // namespace knuckle::link_codec
