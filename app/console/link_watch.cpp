#include "app/console/link_watch.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace knuckle::console {
namespace {

constexpr Duration kWindow = 10s;
constexpr Duration kBelieved = 5s;   // no honest latency is longer
constexpr Duration kSilent = 200ms;  // what has not come by then is no longer taken to be merely late

std::int64_t second_of(Time at) noexcept {
  return at.time_since_epoch() / Duration(1s);
}

}  // namespace

void NumbersSeen::begin(std::uint32_t number) noexcept {
  came_.reset();
  came_.set(index(number));
  newest_ = number;
  known_ = 1;
}

NumbersSeen::Arrival NumbersSeen::add(std::uint32_t number) noexcept {
  if (newer(number, newest_)) {
    const std::uint32_t ahead = std::min(number - newest_, kKept);
    for (std::uint32_t i = 0; i < ahead; ++i) came_.reset(index(number - i));
    came_.set(index(number));
    newest_ = number;
    known_ = std::min(known_ + ahead, kKept);
    return Arrival::kNewest;
  }
  if (newest_ - number >= known_ || came_.test(index(number))) return Arrival::kAgain;
  came_.set(index(number));
  return Arrival::kLate;
}

double NumbersSeen::missing(std::uint32_t window, std::uint32_t due) const noexcept {
  if (known_ == 0) return 0;
  due = std::min(due, window);
  const std::uint32_t sent = std::min(known_, window - due);
  std::uint32_t came = 0;
  for (std::uint32_t i = 0; i < sent; ++i) came += came_.test(index(newest_ - i)) ? 1U : 0U;
  return 1 - static_cast<double>(came) / static_cast<double>(sent + due);
}

void LinkWatch::note(const SlaveMessage& message) noexcept {
  const std::uint32_t sequence = message.stamp.sequence, ahead = sequence - numbers_.newest();
  const bool begun_anew = std::exchange(session_, message.stamp.session) != message.stamp.session;
  if (numbers_.known() == 0 || begun_anew) {
    numbers_.begin(sequence);
    newest_at_ = now_;
  } else {
    const NumbersSeen::Arrival arrival = numbers_.add(sequence);
    if (arrival == NumbersSeen::Arrival::kAgain) return;
    if (arrival == NumbersSeen::Arrival::kNewest) {
      jitter_.add(now_, Duration(std::abs((now_ - newest_at_ - ahead * period_).count())));
      newest_at_ = now_;
    }
  }
  note_round_trip(now_ - message.stamp.echoed);
}

void LinkWatch::note_round_trip(Duration took) noexcept {
  if (took < Duration::zero() || took >= kBelieved) return;
  round_trip_.add(now_, took);
  const std::int64_t second = second_of(now_);
  Slice& slice = quickest_[static_cast<std::size_t>(second) % kSlices];
  if (slice.second != second) slice = {.second = second};
  slice.quickest = std::min(slice.quickest, took);
}

Duration LinkWatch::quickest() const noexcept {
  Duration quickest = Duration::max();
  for (const Slice& slice : quickest_) {
    const bool recent = slice.second >= 0 && slice.second > second_of(now_) - static_cast<std::int64_t>(kSlices);
    if (recent) quickest = std::min(quickest, slice.quickest);
  }
  return quickest;
}

void LinkWatch::note(const MachineStatus& status) noexcept {
  if (status.acted_report_at == kNever || quickest() == Duration::max()) return;
  const Duration took = now_ - status.acted_report_at - status.acted_ago - quickest() / 2;
  if (took >= Duration::zero() && took < kBelieved) hand_to_valve_.add(now_, took);
}

double LinkWatch::loss() const noexcept {
  const auto window = static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(kWindow / period_, 1, static_cast<std::int64_t>(NumbersSeen::kKept)));
  const Duration silence = now_ - newest_at_;
  const auto due = static_cast<std::uint32_t>(
      silence < kSilent ? 0 : std::min<std::int64_t>(silence / period_, static_cast<std::int64_t>(window)));
  return numbers_.missing(window, due);
}

}  // namespace knuckle::console
