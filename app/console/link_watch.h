// How the link does, as its operator's end sees it: round trip, jitter and loss of the last ten seconds, and how long
// it takes from the hand to the valves.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/histogram.h"
#include "core/recent_histogram.h"
#include "core/time.h"
#include "transport/link.h"
#include "transport/link_messages.h"
#include "transport/machine_status.h"

namespace knuckle::app {

/// Passes everything on.
class LinkWatch final : public Link {
 public:
  /// @param link outlives this. @param period at which the machine sends.
  LinkWatch(Link& link, Duration period) noexcept : link_(link), period_(period) {}

  /// Time that arrivals get from now on: of the step that takes them.
  void stamp(Time now) noexcept { now_ = now; }
  bool send(std::span<const std::uint8_t> bytes) noexcept override { return link_.send(bytes); }
  bool receive(Datagram& datagram) noexcept override;
  /// For every new status. Its own way back, which nobody measures, is taken for half of the quickest round trip.
  void note(const MachineStatus& status) noexcept;

  // Of the last 10 s; a few thousand additions each: not for every step.
  [[nodiscard]] Histogram round_trip() const noexcept { return round_trip_.recent(now_); }
  [[nodiscard]] Histogram arrival_jitter() const noexcept { return jitter_.recent(now_); }
  [[nodiscard]] Histogram hand_to_valve() const noexcept { return hand_to_valve_.recent(now_); }
  /// Share of the machine's messages that never came, as far as their numbers tell.
  [[nodiscard]] double loss() const noexcept;

 private:
  static constexpr std::size_t kSlices = 10;  // of a second
  struct Slice {
    std::int64_t second = -1;
    std::uint64_t sent = 0, came = 0;
    Duration quickest = Duration::max();  // round trip
  };
  void note(const SlaveMessage& message) noexcept;
  [[nodiscard]] Slice& slice() noexcept;
  [[nodiscard]] bool recent(const Slice& slice) const noexcept;
  [[nodiscard]] Duration quickest() const noexcept;

  Link& link_;
  Duration period_;
  Time now_{}, newest_at_ = kNever;
  std::optional<std::uint32_t> newest_;
  RecentHistogram round_trip_, jitter_, hand_to_valve_;
  std::array<Slice, kSlices> slices_{};
};

}  // namespace knuckle::app
