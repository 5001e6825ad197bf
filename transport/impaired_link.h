// A network between operator and machine on virtual time, as good or bad as asked: delay, jitter, loss, bursts,
// duplication, reordering, delay steps, cuts. Seeded: the same calls give the same fate to every datagram.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "core/time.h"
#include "transport/link.h"

namespace knuckle {

/// What one direction does to datagrams. Probabilities per datagram.
struct LinkImpairment {
  Duration delay{};        ///< One way, before jitter.
  Duration jitter{};       ///< Half-width of the delay's uniform, independent variation.
  Duration slow_jitter{};  ///< Half-width (2 sigma) of a variation correlated over jitter_time, as queues make.
  Duration jitter_time = 500ms;
  double loss = 0;
  double bursts_per_s = 0;  ///< Mean rate of outages of burst_length (Poisson).
  Duration burst_length = 50ms;
  double duplication = 0;  ///< The copy comes up to reorder_delay later.
  double reordering = 0;   ///< Held back by reorder_delay, so that later ones overtake.
  Duration reorder_delay = 10ms;
  /// A second path brings a copy of everything so much later, also of what the first one loses; zero: there is none.
  Duration second_path{};
  struct DelayStep {
    Time at = Time::max();
    Duration delay{};  ///< Replaces `delay` for what is sent from `at` on.
  };
  std::array<DelayStep, 4> steps{};                      ///< In order of time.
  Time cut_from = Time::max(), cut_until = Time::max();  ///< Everything sent in [from, until) is lost.
};

class ImpairedLink {
 public:
  static constexpr std::size_t kInFlight = 2048;  ///< Per direction; 4 s at 500 Hz. More are dropped and counted.

  struct Counts {
    std::uint64_t sent = 0, lost = 0, duplicated = 0, overflowed = 0;
  };

  /// @throws InputError where a probability is outside [0, 1] or a duration is negative.
  ImpairedLink(const LinkImpairment& a_to_b, const LinkImpairment& b_to_a, std::uint64_t seed);
  ImpairedLink(const ImpairedLink&) = delete;
  ImpairedLink& operator=(const ImpairedLink&) = delete;

  [[nodiscard]] Link& a() noexcept { return a_; }
  [[nodiscard]] Link& b() noexcept { return b_; }
  /// Sets the time: what is due by then can be received; what is sent from now on leaves at `now`.
  void advance(Time now) noexcept { now_ = now; }
  /// Loses everything sent while on, both ways;
  void cut(bool on) noexcept { a_.cut(on), b_.cut(on); }
  /// or only what b sends.
  void cut_b_to_a(bool on) noexcept { b_.cut(on); }
  /// Everything sent from now on takes so much longer, both ways.
  void slow_down(Duration by) noexcept { a_to_b_.slow_down(by), b_to_a_.slow_down(by); }
  /// Of what b sends from now on, this share more is lost.
  void lose_more_b_to_a(double share) noexcept { b_to_a_.lose_more(share); }
  [[nodiscard]] const Counts& a_to_b() const noexcept { return a_to_b_.counts(); }
  [[nodiscard]] const Counts& b_to_a() const noexcept { return b_to_a_.counts(); }

 private:
  class Direction {
   public:
    Direction(const LinkImpairment& impairment, std::uint64_t seed);
    void send(std::span<const std::uint8_t> bytes, Time now) noexcept;
    bool receive(Datagram& datagram, Time now) noexcept;
    void lose() noexcept { ++counts_.sent, ++counts_.lost; }
    void slow_down(Duration by) noexcept { slower_ = by; }
    void lose_more(double share) noexcept { more_loss_ = share; }
    [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

   private:
    struct Arrival {
      Time at{};
      std::uint16_t slot = 0;
    };
    bool lost(Time now) noexcept;
    Duration travel_time(Time now) noexcept;
    void schedule(std::span<const std::uint8_t> bytes, Time at) noexcept;
    double uniform() noexcept { return std::uniform_real_distribution<>()(random_); }

    LinkImpairment impairment_;
    Duration slower_{};
    double more_loss_ = 0;
    std::mt19937_64 random_;
    std::normal_distribution<> normal_;
    double queue_ = 0;  ///< Correlated variation, unit variance.
    Time queue_at_ = kNever;
    Time burst_from_ = kNever;     ///< Start of the current or next outage.
    std::vector<Datagram> slots_;  ///< Allocated once.
    std::vector<std::uint16_t> free_;
    std::vector<Arrival> arrivals_;  ///< Ring sorted by time, equal times in order of sending.
    std::size_t first_ = 0, count_ = 0, free_count_ = kInFlight;
    Counts counts_;
  };
  class End final : public Link {
   public:
    End(ImpairedLink& link, Direction& out, Direction& in) noexcept : link_(link), out_(out), in_(in) {}
    bool send(std::span<const std::uint8_t> bytes) noexcept override;
    bool receive(Datagram& datagram) noexcept override { return in_.receive(datagram, link_.now_); }
    void cut(bool on) noexcept { cut_ = on; }

   private:
    ImpairedLink& link_;
    Direction& out_;
    Direction& in_;
    bool cut_ = false;
  };

  Time now_{};
  Direction a_to_b_, b_to_a_;
  End a_, b_;
};

}  // namespace knuckle
