// How the link does, as its operator's end sees it: round trip, jitter and loss of the last ten seconds, and how long
// it takes from the hand to the valves.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>

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

}  // namespace knuckle::console
