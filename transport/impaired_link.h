// A network between operator and machine on virtual time, as good or bad as its two directions are set. Seeded: the
// same calls give the same fate to every datagram.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "core/time.h"
#include "transport/link.h"
#include "transport/link_impairment.h"

namespace knuckle {

// What becomes of each datagram in one direction of an impaired network: lost, or when it arrives, and how often.
// Seeded, and time is passed in: the same calls give the same fates, on virtual time and in the relay alike.

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

// One direction of an impaired network: the model that says what becomes of a datagram, and bounded room for those that
// are on their way.

class ImpairedPath {
 public:
  static constexpr std::size_t kInFlight = 2048;  ///< 4 s at 500 Hz. More are dropped and counted.

  /// @param most_bytes of a datagram. Allocates all room. @throws InputError as check().
  ImpairedPath(const LinkImpairment& impairment, std::uint64_t seed, std::size_t most_bytes);

  /// @param bytes at most most_bytes. @param now never before that of an earlier call.
  void send(std::span<const std::uint8_t> bytes, Time now) noexcept;

  struct Arrival {
    std::span<const std::uint8_t> bytes;  ///< Until pop().
    Time sent_at{}, due_at{};
  };
  /// The one that is due first, if it is by then.
  [[nodiscard]] std::optional<Arrival> front(Time now) const noexcept;
  /// Takes it away.
  void pop() noexcept;
  /// When the first is due; Time::max(): none is on its way.
  [[nodiscard]] Time next_due() const noexcept { return count_ == 0 ? Time::max() : flights_[first_].due_at; }

  [[nodiscard]] ImpairmentModel& model() noexcept { return model_; }
  [[nodiscard]] const ImpairmentCounts& counts() const noexcept { return model_.counts(); }

 private:
  struct Flight {
    Time sent_at{}, due_at{};
    std::uint16_t slot = 0, size = 0;
  };
  void add(std::span<const std::uint8_t> bytes, Time sent_at, Time due_at) noexcept;

  ImpairmentModel model_;
  std::size_t most_bytes_;
  std::unique_ptr<std::uint8_t[]> bytes_;  ///< kInFlight slots; pages that are never used take no memory.
  std::vector<std::uint16_t> free_;
  std::vector<Flight> flights_;  ///< Ring sorted by due_at, equal times in order of sending.
  std::size_t first_ = 0, count_ = 0, free_count_ = kInFlight;
};

class ImpairedLink {
 public:
  static constexpr std::size_t kInFlight = ImpairedPath::kInFlight;  ///< Per direction.

  /// @throws InputError where a probability is outside [0, 1] or a duration is negative.
  ImpairedLink(const LinkImpairment& a_to_b, const LinkImpairment& b_to_a, std::uint64_t seed);
  ImpairedLink(const ImpairedLink&) = delete;
  ImpairedLink& operator=(const ImpairedLink&) = delete;

  [[nodiscard]] Link& a() noexcept { return a_; }
  [[nodiscard]] Link& b() noexcept { return b_; }
  /// Sets the time: what is due by then can be received; what is sent from now on leaves at `now`.
  void advance(Time now) noexcept { now_ = now; }
  /// Loses everything sent while on, both ways;
  void cut(bool on) noexcept {
    a_.cut(on);
    b_.cut(on);
  }
  /// or only what b sends.
  void cut_b_to_a(bool on) noexcept { b_.cut(on); }
  /// Everything sent from now on takes so much longer, both ways.
  void slow_down(Duration by) noexcept {
    a_to_b_.model().slow_down(by);
    b_to_a_.model().slow_down(by);
  }
  /// Of what b sends from now on, this share more is lost.
  void lose_more_b_to_a(double share) noexcept { b_to_a_.model().lose_more(share); }
  [[nodiscard]] const ImpairmentCounts& a_to_b() const noexcept { return a_to_b_.counts(); }
  [[nodiscard]] const ImpairmentCounts& b_to_a() const noexcept { return b_to_a_.counts(); }

 private:
  class End final : public Link {
   public:
    End(ImpairedLink& link, ImpairedPath& out, ImpairedPath& in) noexcept : link_(link), out_(out), in_(in) {}
    bool send(std::span<const std::uint8_t> bytes) noexcept override;
    bool receive(Datagram& datagram) noexcept override;
    void cut(bool on) noexcept { cut_ = on; }

   private:
    ImpairedLink& link_;
    ImpairedPath& out_;
    ImpairedPath& in_;
    bool cut_ = false;
  };

  Time now_{};
  ImpairedPath a_to_b_, b_to_a_;
  End a_, b_;
};

}  // namespace knuckle
