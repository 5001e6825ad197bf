#include "app/console/link_watch.h"

#include <algorithm>
#include <cstdlib>

namespace knuckle::app {
namespace {

constexpr Duration kRestartSilence = 1s;  // as the master loop has it: then any number is news
constexpr Duration kBelieved = 5s;        // no honest latency is longer

std::int64_t second_of(Time at) noexcept {
  return at.time_since_epoch() / Duration(1s);
}

}  // namespace

bool LinkWatch::receive(Datagram& datagram) noexcept {
  if (!link_.receive(datagram)) return false;
  if (const auto message = decode_slave(datagram.view())) note(*message);
  return true;
}

LinkWatch::Slice& LinkWatch::slice() noexcept {
  const std::int64_t second = second_of(now_);
  Slice& slice = slices_[static_cast<std::size_t>(second) % kSlices];
  if (slice.second != second) slice = {.second = second};
  return slice;
}

void LinkWatch::note(const SlaveMessage& message) noexcept {
  Slice& counts = slice();
  const Duration round_trip = now_ - message.echoed_master_time;
  if (message.echoed_master_time > Time{} && round_trip >= Duration::zero() && round_trip < kBelieved) {
    round_trip_.add(now_, round_trip);
    counts.quickest = std::min(counts.quickest, round_trip);
  }
  ++counts.came;
  if (!newest_ || now_ - newest_at_ >= kRestartSilence) {
    ++counts.sent;
  } else if (newer(message.sequence, *newest_)) {
    const std::uint32_t ahead = message.sequence - *newest_;
    counts.sent += ahead;
    jitter_.add(now_, Duration(std::abs((now_ - newest_at_ - ahead * period_).count())));
  } else {
    return;  // late: it was counted as sent when a newer one came
  }
  newest_ = message.sequence;
  newest_at_ = now_;
}

bool LinkWatch::recent(const Slice& slice) const noexcept {
  return slice.second >= 0 && slice.second > second_of(now_) - static_cast<std::int64_t>(kSlices);
}

Duration LinkWatch::quickest() const noexcept {
  Duration quickest = Duration::max();
  for (const Slice& slice : slices_)
    if (recent(slice)) quickest = std::min(quickest, slice.quickest);
  return quickest;
}

void LinkWatch::note(const MachineStatus& status) noexcept {
  if (status.acted_report_at == kNever || quickest() == Duration::max()) return;
  const Duration took = now_ - status.acted_report_at - status.acted_ago - quickest() / 2;
  if (took >= Duration::zero() && took < kBelieved) hand_to_valve_.add(now_, took);
}

double LinkWatch::loss() const noexcept {
  std::uint64_t sent = 0, came = 0;
  for (const Slice& slice : slices_) {
    if (!recent(slice)) continue;
    sent += slice.sent;
    came += slice.came;
  }
  return sent == 0 ? 0 : std::max(0.0, 1 - static_cast<double>(came) / static_cast<double>(sent));
}

}  // namespace knuckle::app
