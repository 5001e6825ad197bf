// How the link did over the last minutes: of each second the least and the most, so that nothing short is lost and the
// room is fixed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "app/console/console_view.h"
#include "app/console/link_quality.h"

namespace knuckle::console {

/// What the quality word is made of, in its order; and the round trip of the newest packets, of which the word's median
/// of ten seconds hides those that are few.
enum class LinkMeasure : std::uint8_t { kRoundTrip, kLoss, kJitter, kSilence, kNewestRoundTrip };
inline constexpr std::size_t kLinkMeasures = 5;
[[nodiscard]] const QualityBounds& bounds_of(LinkMeasure measure) noexcept;

/// By LinkMeasure; what is not known is no number.
using LinkValues = std::array<float, kLinkMeasures>;
/// nullopt: nothing of it is known.
[[nodiscard]] std::optional<LinkValues> link_values(const LinkSide& link) noexcept;

class LinkHistory {
 public:
  static constexpr std::size_t kSeconds = 600;
  static constexpr Duration kKept = kSeconds * Duration(1s);
  /// Nothing is known of it: both are no numbers.
  struct Range {
    float least = std::numeric_limits<float>::quiet_NaN(), most = std::numeric_limits<float>::quiet_NaN();
  };

  /// Every frame. Restarts with the session.
  void watch(const ConsoleView& view) noexcept;
  /// Time has come to here; where it goes back, everything begins anew.
  void pass(Time now) noexcept;
  /// Seen in the second that runs.
  void add(const LinkValues& values) noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// 0: of the second that runs. Seconds in which nobody looked are unknown.
  [[nodiscard]] const Range& ago(std::size_t seconds, LinkMeasure measure) const noexcept {
    return seconds_[(newest_ + kSeconds - seconds) % kSeconds][static_cast<std::size_t>(measure)];
  }

 private:
  using Second = std::array<Range, kLinkMeasures>;
  std::array<Second, kSeconds> seconds_{};
  std::size_t newest_ = 0, count_ = 0;
  std::optional<std::int64_t> second_;
};

}  // namespace knuckle::console
