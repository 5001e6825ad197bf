// How the link does, as its operator's end sees it: round trip, jitter and loss of the last ten seconds, and how long
// it takes from the hand to the valves.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

#include "app/console/console_view.h"
#include "core/histogram.h"
#include "core/recent_histogram.h"
#include "core/time.h"
#include "transport/link_messages.h"
#include "transport/machine_status.h"

namespace knuckle::console {

/// Which numbers of a sequence have come, each counted once, however often and in whatever order they come.
class NumbersSeen {
 public:
  static constexpr std::uint32_t kKept = 4096;  ///< Numbers up to the newest: 10 s of a machine at 400 Hz.

  enum class Arrival : std::uint8_t {
    kNewest,
    kLate,   ///< For the first time, after a newer one.
    kAgain,  ///< A copy, or older than all that is kept.
  };
  void begin(std::uint32_t number) noexcept;
  Arrival add(std::uint32_t number) noexcept;
  [[nodiscard]] std::uint32_t newest() const noexcept { return newest_; }
  /// 0: not begun.
  [[nodiscard]] std::uint32_t known() const noexcept { return known_; }
  /// Of the newest `window` numbers, of which the last `due` have been sent but never came: the share that is missing.
  [[nodiscard]] double missing(std::uint32_t window, std::uint32_t due) const noexcept;

 private:
  [[nodiscard]] static std::size_t index(std::uint32_t number) noexcept { return number % kKept; }

  std::bitset<kKept> came_;
  std::uint32_t newest_ = 0, known_ = 0;  // known_: numbers up to the newest since the first, at most kKept
};

class LinkWatch {
 public:
  /// @param period at which the machine sends.
  explicit LinkWatch(Duration period) noexcept : period_(period) {}

  /// Time that arrivals get from now on: of the step that takes them.
  void stamp(Time now) noexcept { now_ = now; }
  /// For every message, copies and overtaken ones included, with its echo by this side's clock.
  void note(const SlaveMessage& message) noexcept;
  /// For every new status. Its own way back, which is not measured, is taken as half of the quickest round trip.
  void note(const MachineStatus& status) noexcept;

  /// Puts in the next four.
  void show(LinkSide& link) const noexcept;
  // Of the last 10 s; a few thousand additions each: not for every step.
  [[nodiscard]] Histogram round_trip() const noexcept { return round_trip_.recent(now_); }
  /// How far from the machine's period messages come in.
  [[nodiscard]] Histogram arrival_jitter() const noexcept { return jitter_.recent(now_); }
  [[nodiscard]] Histogram hand_to_valve() const noexcept { return hand_to_valve_.recent(now_); }
  /// Share of the machine's messages that never came, as far as their numbers show; in a silence those that are due
  /// count, too, so that it grows. 0 before the first.
  [[nodiscard]] double loss() const noexcept;

 private:
  static constexpr std::size_t kSlices = 10;  // of a second
  struct Slice {
    std::int64_t second = -1;
    Duration quickest = Duration::max();  // round trip
  };
  void note_round_trip(Duration took) noexcept;
  [[nodiscard]] Duration quickest() const noexcept;

  Duration period_;
  Time now_{}, newest_at_ = kNever;
  std::uint64_t session_ = 0;
  NumbersSeen numbers_;
  RecentHistogram round_trip_, jitter_, hand_to_valve_;
  std::array<Slice, kSlices> quickest_{};
};

// One word for how well the machine is reached, from what the last ten seconds measured: round trip, loss, jitter, and
// how much of the time to neutral the newest silence has used up. The worst of them decides.

enum class LinkQuality : std::uint8_t { kGood, kFair, kPoor, kBad };
[[nodiscard]] const char* name(LinkQuality quality) noexcept;  ///< "good", "fair", "poor", "bad"

/// Up to `fair` good, up to `poor` fair, up to `bad` poor.
struct QualityBounds {
  double fair, poor, bad;
};
// Felt contacts hold to 10 % in 9 sessions of 10 up to 0.1 s, become soft up to 0.4 s (docs/evaluation.md); beyond
// 0.45 s no force is felt.
inline constexpr QualityBounds kRoundTripBounds_s{0.1, 0.2, 0.4};
inline constexpr QualityBounds kLossBounds{0.02, 0.1, 0.3};
inline constexpr QualityBounds kJitterBounds_s{0.015, 0.04, 0.1};  ///< p95 of arrivals, off the machine's period.
inline constexpr QualityBounds kSilenceBounds{0.4, 0.7, 1};        ///< Of the time to neutral.

struct LinkVerdict {
  LinkQuality quality = LinkQuality::kBad;
  std::string text;  ///< Of what decides, such as "180 ms round trip".
};
/// @param later_s since the view was made. @return nothing where nothing of it was measured: not heard, or the
/// recording of one side alone.
[[nodiscard]] std::optional<LinkVerdict> link_verdict(const LinkSide& link, double later_s);

// How the link did over the last minutes: of each second the least and the most, so that nothing short is lost and the
// room is fixed.

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
