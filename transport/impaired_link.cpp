#include "transport/impaired_link.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <string>

#include "core/error.h"

namespace knuckle {
namespace {

void check(const LinkImpairment& impairment) {
  const auto probability = [](const char* key, double value) {
    if (!(value >= 0 && value <= 1)) {
      throw InputError(std::string("link: ") + key + " = " + std::to_string(value) + " is outside [0, 1]");
    }
  };
  probability("loss", impairment.loss);
  probability("duplication", impairment.duplication);
  probability("reordering", impairment.reordering);
  const auto duration = [](const char* key, Duration value) {
    if (value < Duration::zero()) throw InputError(std::string("link: ") + key + " is below 0");
  };
  duration("delay", impairment.delay);
  duration("jitter", impairment.jitter);
  duration("slow_jitter", impairment.slow_jitter);
  duration("reorder_delay", impairment.reorder_delay);
  duration("burst_length", impairment.burst_length);
  duration("second_path", impairment.second_path);
  for (const auto& step : impairment.steps) duration("steps.delay", step.delay);
  if (impairment.jitter_time <= Duration::zero()) throw InputError("link: jitter_time must be above 0");
  if (!(impairment.bursts_per_s >= 0)) throw InputError("link: bursts_per_s is below 0");
}

}  // namespace

ImpairedLink::ImpairedLink(const LinkImpairment& a_to_b, const LinkImpairment& b_to_a, std::uint64_t seed)
    : a_to_b_(a_to_b, 2 * seed),
      b_to_a_(b_to_a, 2 * seed + 1),
      a_(*this, a_to_b_, b_to_a_),
      b_(*this, b_to_a_, a_to_b_) {}

bool ImpairedLink::End::send(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() > kMaxDatagram) return false;
  if (cut_) {
    out_.lose();
  } else {
    out_.send(bytes, link_.now_);
  }
  return true;  // as with UDP: the sender does not learn of its fate
}

ImpairedLink::Direction::Direction(const LinkImpairment& impairment, std::uint64_t seed)
    : impairment_(impairment), slots_(kInFlight), free_(kInFlight), arrivals_(kInFlight) {
  check(impairment);
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  random_.seed(sequence);
  std::iota(free_.rbegin(), free_.rend(), std::uint16_t{0});
}

void ImpairedLink::Direction::send(std::span<const std::uint8_t> bytes, Time now) noexcept {
  ++counts_.sent;
  if (impairment_.second_path > Duration::zero()) schedule(bytes, now + impairment_.second_path);
  if (lost(now)) {
    ++counts_.lost;
    return;
  }
  const Time at = now + travel_time(now);
  schedule(bytes, at);
  if (impairment_.duplication > 0 && uniform() < impairment_.duplication) {
    ++counts_.duplicated;
    schedule(bytes, at + Duration(static_cast<std::int64_t>(uniform() *
                                                            static_cast<double>(impairment_.reorder_delay.count()))));
  }
}

bool ImpairedLink::Direction::lost(Time now) noexcept {
  if (now >= impairment_.cut_from && now < impairment_.cut_until) return true;
  if (impairment_.bursts_per_s > 0) {
    const auto pause = [this] { return from_seconds(-std::log1p(-uniform()) / impairment_.bursts_per_s); };
    if (burst_from_ == kNever) burst_from_ = now + pause();
    while (burst_from_ + impairment_.burst_length <= now) burst_from_ += impairment_.burst_length + pause();
    if (now >= burst_from_) return true;
  }
  if (more_loss_ > 0 && uniform() < more_loss_) return true;
  return impairment_.loss > 0 && uniform() < impairment_.loss;
}

Duration ImpairedLink::Direction::travel_time(Time now) noexcept {
  const LinkImpairment& i = impairment_;
  Duration delay = i.delay;
  for (const auto& step : i.steps) {
    if (now >= step.at) delay = step.delay;
  }
  delay += slower_;
  double extra_ns = 0;
  if (i.jitter > Duration::zero()) extra_ns += (2 * uniform() - 1) * static_cast<double>(i.jitter.count());
  if (i.slow_jitter > Duration::zero()) {
    // First-order Gauss-Markov process, exact for any spacing of the datagrams.
    const double keep = queue_at_ == kNever ? 0.0 : std::exp(-to_seconds(now - queue_at_) / to_seconds(i.jitter_time));
    queue_ = keep * queue_ + std::sqrt(1 - keep * keep) * normal_(random_);
    queue_at_ = now;
    extra_ns += std::clamp(queue_ / 2, -1.0, 1.0) * static_cast<double>(i.slow_jitter.count());
  }
  if (i.reordering > 0 && uniform() < i.reordering) delay += i.reorder_delay;
  return std::max(Duration::zero(), delay + Duration(static_cast<std::int64_t>(extra_ns)));
}

void ImpairedLink::Direction::schedule(std::span<const std::uint8_t> bytes, Time at) noexcept {
  if (free_count_ == 0) {
    ++counts_.overflowed;
    return;
  }
  const std::uint16_t slot = free_[--free_count_];
  slots_[slot].size = static_cast<std::uint16_t>(bytes.size());
  if (!bytes.empty()) std::memcpy(slots_[slot].bytes.data(), bytes.data(), bytes.size());
  std::size_t i = count_++;
  for (; i > 0 && arrivals_[(first_ + i - 1) % kInFlight].at > at; --i) {
    arrivals_[(first_ + i) % kInFlight] = arrivals_[(first_ + i - 1) % kInFlight];
  }
  arrivals_[(first_ + i) % kInFlight] = {at, slot};
}

bool ImpairedLink::Direction::receive(Datagram& datagram, Time now) noexcept {
  if (count_ == 0 || arrivals_[first_].at > now) return false;
  const Datagram& stored = slots_[arrivals_[first_].slot];
  datagram.size = stored.size;
  datagram.waited = now - arrivals_[first_].at;
  std::memcpy(datagram.bytes.data(), stored.bytes.data(), stored.size);
  free_[free_count_++] = arrivals_[first_].slot;
  first_ = (first_ + 1) % kInFlight;
  --count_;
  return true;
}

}  // namespace knuckle
