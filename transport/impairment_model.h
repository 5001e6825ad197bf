// What becomes of each datagram in one direction of an impaired network: lost, or when it arrives, and how often.
// Seeded, and time is passed in: the same calls give the same fates, on virtual time and in the relay alike.
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "core/time.h"
#include "transport/link_impairment.h"

namespace knuckle {

struct ImpairmentCounts {
  std::uint64_t sent = 0;
  std::uint64_t lost = 0;  ///< In outages, in bad times, and singly.
  std::uint64_t lost_in_outage = 0, lost_in_burst = 0;
  std::uint64_t queue_full = 0;  ///< Dropped before the rate limit.
  std::uint64_t duplicated = 0, held_back = 0;
  std::uint64_t overflowed = 0;  ///< Dropped because too many were in flight.
};

class ImpairmentModel {
 public:
  /// @throws InputError as check().
  ImpairmentModel(const LinkImpairment& impairment, std::uint64_t seed);
  ImpairmentModel(const ImpairmentModel&) = delete;  // it points into itself
  ImpairmentModel& operator=(const ImpairmentModel&) = delete;

  struct Fate {
    std::array<Time, 3> arrivals{};  ///< Of each copy.
    std::size_t copies = 0;
    void add(Time at) noexcept { arrivals[copies++] = at; }
  };
  /// @param now never before that of an earlier call.
  [[nodiscard]] Fate send(std::size_t bytes, Time now) noexcept;
  /// Sent, and lost in any case.
  void lose() noexcept {
    ++counts_.sent;
    ++counts_.lost;
  }

  /// Everything sent from now on takes so much longer.
  void slow_down(Duration by) noexcept { slower_ = by; }
  /// Of what is sent from now on, this share more is lost.
  void lose_more(double share) noexcept { more_loss_ = share; }
  void count_overflow() noexcept { ++counts_.overflowed; }

  [[nodiscard]] const ImpairmentCounts& counts() const noexcept { return counts_; }
  [[nodiscard]] const LinkImpairment& impairment() const noexcept { return plan_; }

 private:
  void follow_plan(Time now) noexcept;
  bool in_outage(Time now) noexcept;
  bool lost(Time now) noexcept;
  bool lost_in_burst(Time now) noexcept;
  /// From the queue's end to the far end.
  Duration travel_time(Time now) noexcept;
  double jitter_ns() noexcept;
  double slow_jitter_ns(Time now) noexcept;
  double uniform() noexcept { return std::uniform_real_distribution<>()(random_); }

  LinkImpairment plan_;
  const LinkImpairment* now_;  ///< plan_, or one of its changes.
  Duration slower_{};
  double more_loss_ = 0;
  std::mt19937_64 random_;
  std::normal_distribution<> normal_;
  double queue_ = 0;  ///< Correlated variation, unit variance.
  Time queue_at_ = kNever;
  Time burst_from_ = kNever;  ///< Start of the current or next random outage.
  bool bad_ = false;          ///< State of the Gilbert-Elliott chain,
  Time bad_at_ = kNever;      ///< at this time.
  Time free_at_ = kNever;     ///< When the limited link has sent what is queued.
  Time newest_ = kNever;      ///< Arrival of the last one, where order is kept.
  ImpairmentCounts counts_;
};

}  // namespace knuckle
