#include "transport/impaired_link.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <numeric>

namespace knuckle {

namespace {

constexpr double kMostNormal = 4, kMostPareto = 25;  // standard deviations
constexpr double kTail = 3;                          // exponent of the Pareto distribution
constexpr double kLongestPause_s = 1e9;              // between outages; far beyond any session, and well within a Time

/// Mean 0, variance 1. @param above probability of a larger value, in (0, 1].
double pareto(double above) noexcept {
  const double mean = kTail / (kTail - 1), deviation = std::sqrt(kTail / (kTail - 2)) / (kTail - 1);
  return std::min((std::pow(above, -1 / kTail) - mean) / deviation, kMostPareto);
}

double normal_above(double z) noexcept {
  return 0.5 * std::erfc(z / std::numbers::sqrt2);
}

/// A normal variate as one of the shape at the same quantile, of width 1.
double shaped(JitterShape shape, double z) noexcept {
  switch (shape) {
    case JitterShape::kUniform:
      return 1 - 2 * normal_above(z);
    case JitterShape::kPareto:
      return pareto(std::max(normal_above(z), 1e-12));
    case JitterShape::kNormal:
      break;
  }
  return std::clamp(z, -kMostNormal, kMostNormal);
}

/// Of a process with this correlation time: exact for any spacing of the datagrams.
double kept(Time since, Time now, Duration correlation_time) noexcept {
  return since == kNever ? 0.0 : std::exp(-to_seconds(now - since) / to_seconds(correlation_time));
}

}  // namespace

ImpairmentModel::ImpairmentModel(const LinkImpairment& impairment, std::uint64_t seed)
    : plan_(impairment), now_(&plan_) {
  check(plan_);
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  random_.seed(sequence);
}

ImpairmentModel::Fate ImpairmentModel::send(std::size_t bytes, Time now) noexcept {
  ++counts_.sent;
  follow_plan(now);
  Fate fate;
  if (now_->second_path > Duration::zero()) fate.add(now + now_->second_path);
  if (lost(now)) {
    ++counts_.lost;
    return fate;
  }
  Time leaves = now;
  if (now_->rate_Bps > 0) {
    const double queued_B = to_seconds(std::max(free_at_ - now, Duration::zero())) * now_->rate_Bps;
    if (queued_B + static_cast<double>(bytes) > static_cast<double>(now_->queue_B)) {
      ++counts_.queue_full;
      return fate;
    }
    leaves = free_at_ = std::max(free_at_, now) + from_seconds(static_cast<double>(bytes) / now_->rate_Bps);
  }
  Time at = leaves + travel_time(now);
  if (now_->in_order) at = newest_ = std::max(at, newest_);
  fate.add(at);
  if (now_->duplication > 0 && uniform() < now_->duplication) {
    ++counts_.duplicated;
    fate.add(at + Duration(static_cast<std::int64_t>(uniform() * static_cast<double>(now_->reorder_delay.count()))));
  }
  return fate;
}

void ImpairmentModel::follow_plan(Time now) noexcept {
  if (plan_.changes.empty()) return;
  const std::size_t count = plan_.changes_by(now);
  now_ = count == 0 ? &plan_ : &plan_.changes[count - 1].to;
}

bool ImpairmentModel::in_outage(Time now) noexcept {
  if (plan_.is_out(now)) return true;
  if (now_->bursts_per_s == 0) return false;
  const auto pause = [this] {
    return from_seconds(std::min(-std::log1p(-uniform()) / now_->bursts_per_s, kLongestPause_s));
  };
  if (burst_from_ == kNever) burst_from_ = now + pause();
  while (burst_from_ + now_->burst_length <= now) burst_from_ += now_->burst_length + pause();
  return now >= burst_from_;
}

bool ImpairmentModel::lost(Time now) noexcept {
  if (in_outage(now)) {
    ++counts_.lost_in_outage;
    return true;
  }
  if (lost_in_burst(now)) {
    ++counts_.lost_in_burst;
    return true;
  }
  if (more_loss_ > 0 && uniform() < more_loss_) return true;
  return now_->loss > 0 && uniform() < now_->loss;
}

/// E. N. Gilbert (1960), E. O. Elliott (1963), in continuous time: with rates g = 1/mean_good and b = 1/mean_bad, a
/// chain that was in a state relaxes to the share g / (g + b) of bad times with the rate g + b.
bool ImpairmentModel::lost_in_burst(Time now) noexcept {
  const LinkImpairment::BurstLoss& model = now_->burst_loss;
  if (model.mean_good == Duration::zero()) return false;
  const double good_s = to_seconds(model.mean_good), bad_s = to_seconds(model.mean_bad);
  const double share_bad = bad_s / (good_s + bad_s);
  const double keep = kept(bad_at_, now, from_seconds(good_s * share_bad));
  bad_ = uniform() < share_bad + ((bad_ ? 1 : 0) - share_bad) * keep;
  bad_at_ = now;
  return uniform() < (bad_ ? model.loss_in_bad : model.loss_in_good);
}

Duration ImpairmentModel::travel_time(Time now) noexcept {
  Duration delay = now_->delay + slower_;
  double extra_ns = 0;
  if (now_->jitter > Duration::zero()) extra_ns += jitter_ns();
  if (now_->slow_jitter > Duration::zero()) extra_ns += slow_jitter_ns(now);
  if (now_->reordering > 0 && uniform() < now_->reordering) {
    ++counts_.held_back;
    delay += now_->reorder_delay;
  }
  return std::max(Duration::zero(), delay + Duration(static_cast<std::int64_t>(extra_ns)));
}

double ImpairmentModel::jitter_ns() noexcept {
  const auto width_ns = static_cast<double>(now_->jitter.count());
  switch (now_->jitter_shape) {
    case JitterShape::kNormal:
      return shaped(JitterShape::kNormal, normal_(random_)) * width_ns;
    case JitterShape::kPareto:
      return pareto(1 - uniform()) * width_ns;
    case JitterShape::kUniform:
      break;
  }
  return (2 * uniform() - 1) * width_ns;
}

/// First-order Gauss-Markov process.
double ImpairmentModel::slow_jitter_ns(Time now) noexcept {
  const double keep = kept(queue_at_, now, now_->jitter_time);
  queue_ = keep * queue_ + std::sqrt(1 - keep * keep) * normal_(random_);
  queue_at_ = now;
  return shaped(now_->slow_jitter_shape, queue_) * static_cast<double>(now_->slow_jitter.count());
}

ImpairedPath::ImpairedPath(const LinkImpairment& impairment, std::uint64_t seed, std::size_t most_bytes)
    : model_(impairment, seed),
      most_bytes_(most_bytes),
      bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(kInFlight * most_bytes)),
      free_(kInFlight),
      flights_(kInFlight) {
  std::iota(free_.rbegin(), free_.rend(), std::uint16_t{0});
}

void ImpairedPath::send(std::span<const std::uint8_t> bytes, Time now) noexcept {
  const ImpairmentModel::Fate fate = model_.send(bytes.size(), now);
  for (std::size_t copy = 0; copy < fate.copies; ++copy) add(bytes, now, fate.arrivals[copy]);
}

void ImpairedPath::add(std::span<const std::uint8_t> bytes, Time sent_at, Time due_at) noexcept {
  if (free_count_ == 0) return model_.count_overflow();
  const std::uint16_t slot = free_[--free_count_];
  if (!bytes.empty()) std::memcpy(&bytes_[slot * most_bytes_], bytes.data(), bytes.size());
  std::size_t i = count_++;
  for (; i > 0 && flights_[(first_ + i - 1) % kInFlight].due_at > due_at; --i) {
    flights_[(first_ + i) % kInFlight] = flights_[(first_ + i - 1) % kInFlight];
  }
  flights_[(first_ + i) % kInFlight] = {sent_at, due_at, slot, static_cast<std::uint16_t>(bytes.size())};
}

std::optional<ImpairedPath::Arrival> ImpairedPath::front(Time now) const noexcept {
  if (next_due() > now || count_ == 0) return std::nullopt;
  const Flight& flight = flights_[first_];
  return Arrival{{&bytes_[flight.slot * most_bytes_], flight.size}, flight.sent_at, flight.due_at};
}

void ImpairedPath::pop() noexcept {
  free_[free_count_++] = flights_[first_].slot;
  first_ = (first_ + 1) % kInFlight;
  --count_;
}

ImpairedLink::ImpairedLink(const LinkImpairment& a_to_b, const LinkImpairment& b_to_a, std::uint64_t seed)
    : a_to_b_(a_to_b, 2 * seed, kMaxDatagram),
      b_to_a_(b_to_a, 2 * seed + 1, kMaxDatagram),
      a_(*this, a_to_b_, b_to_a_),
      b_(*this, b_to_a_, a_to_b_) {}

bool ImpairedLink::End::send(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() > kMaxDatagram) return false;
  if (cut_) {
    out_.model().lose();
  } else {
    out_.send(bytes, link_.now_);
  }
  return true;  // as with UDP: the sender does not learn of its fate
}

bool ImpairedLink::End::receive(Datagram& datagram) noexcept {
  const auto arrival = in_.front(link_.now_);
  if (!arrival) return false;
  datagram.size = static_cast<std::uint16_t>(arrival->bytes.size());
  datagram.waited = link_.now_ - arrival->due_at;
  std::memcpy(datagram.bytes.data(), arrival->bytes.data(), arrival->bytes.size());
  in_.pop();
  return true;
}

}  // namespace knuckle
