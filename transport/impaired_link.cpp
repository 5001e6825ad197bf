#include "transport/impaired_link.h"

#include <cstring>
#include <numeric>

namespace knuckle {

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
