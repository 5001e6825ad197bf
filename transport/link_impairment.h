// What a network does to datagrams, one direction of it: the settings of ImpairmentModel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/time.h"

namespace knuckle {

/// How delays spread around their mean. Width: of kUniform half the range; of the others the standard deviation.
enum class JitterShape : std::uint8_t {
  kUniform,
  kNormal,  ///< Cut at 4 standard deviations.
  kPareto,  ///< Long tail to one side: exponent 3, as netem's; at least 0.58, cut at 25 standard deviations.
};

/// Probabilities are per datagram. By default nothing happens to any.
struct LinkImpairment {
  Duration delay{};   ///< One way, the mean.
  Duration jitter{};  ///< Width of a variation that each datagram has for itself.
  JitterShape jitter_shape = JitterShape::kUniform;
  Duration slow_jitter{};  ///< Width of a variation that is correlated over jitter_time, as queues make it.
  JitterShape slow_jitter_shape = JitterShape::kNormal;
  Duration jitter_time = 500ms;  ///< After which the correlation has fallen to 1/e.
  bool in_order = false;         ///< None overtakes: it waits for those before it, as a queue makes it.

  double loss = 0;  ///< Each by itself.
  /// Gilbert-Elliott: the path is good or bad, for exponentially distributed times. Per unit of time and not per
  /// datagram, so that one path is the same for all rates of sending; docs/network.md has the conversion.
  struct BurstLoss {
    Duration mean_good{};  ///< Zero: always good.
    Duration mean_bad = 50ms;
    double loss_in_good = 0, loss_in_bad = 1;
  } burst_loss{};
  double bursts_per_s = 0;  ///< Mean rate of outages of burst_length (Poisson).
  Duration burst_length = 50ms;
  /// Everything sent in [from, from + length) is lost; again after each `every`, unless that is zero.
  struct Outage {
    Time from{};
    Duration length = Duration::max();
    Duration every{};
  };
  std::vector<Outage> outages{};

  double duplication = 0;  ///< The copy comes up to reorder_delay later.
  double reordering = 0;   ///< Held back by reorder_delay, so that later ones overtake.
  Duration reorder_delay = 10ms;
  /// A second path brings a copy of everything so much later, also of what the first one loses; zero: there is none.
  Duration second_path{};

  double rate_Bps = 0;      ///< Bytes per second, headers not counted; 0: no limit.
  std::size_t queue_B = 0;  ///< Room before the limit; what does not fit is dropped.

  /// From `at` on, everything above but outages is as in `to`, whose own outages, changes and address changes are
  /// empty.
  struct Change;
  std::vector<Change> changes;  ///< In order of time. No `{}`: Change is not complete here, and clang asks that it is.
  /// When the address changes that datagrams of this direction come from. On virtual time there are none.
  std::vector<Time> address_changes{};

  [[nodiscard]] bool is_out(Time now) const noexcept;
  /// Index + 1 of the newest change by then; 0: none yet.
  [[nodiscard]] std::size_t changes_by(Time now) const noexcept;
};

struct LinkImpairment::Change {
  Time at{};
  LinkImpairment to;
};

/// @throws InputError where a probability is outside [0, 1], a duration negative, or settings contradict each other.
void check(const LinkImpairment& impairment);

}  // namespace knuckle
