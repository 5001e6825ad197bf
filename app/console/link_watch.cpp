#include "app/console/link_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

void LinkWatch::show(LinkSide& link) const noexcept {
  link.round_trip = round_trip();
  link.arrival_jitter = arrival_jitter();
  link.hand_to_valve = hand_to_valve();
  link.loss = loss();
}

namespace {

LinkQuality quality_of(double value, const QualityBounds& bounds) {
  if (!(value <= bounds.bad)) return LinkQuality::kBad;
  if (value > bounds.poor) return LinkQuality::kPoor;
  return value > bounds.fair ? LinkQuality::kFair : LinkQuality::kGood;
}

}  // namespace

const char* name(LinkQuality quality) noexcept {
  constexpr std::array<const char*, 4> kNames{"good", "fair", "poor", "bad"};
  return kNames[static_cast<std::size_t>(quality)];
}

std::optional<LinkVerdict> link_verdict(const LinkSide& link, double later_s) {
  if (!link.heard || !std::isfinite(link.loss)) return std::nullopt;
  const double round_trip_s = to_seconds(link.round_trip.quantile(0.5));
  const double jitter_s = to_seconds(link.arrival_jitter.quantile(0.95));
  const double silence_s = link.silence_s + later_s;
  const double used = link.neutral_after_s > 0 ? silence_s / link.neutral_after_s : 0;
  // The round trip is what is said where all is well.
  LinkVerdict verdict{quality_of(round_trip_s, kRoundTripBounds_s),
                      fmt::format("{:.0f} ms round trip", round_trip_s * 1e3)};
  const auto worse = [&verdict](double value, const QualityBounds& bounds, const std::string& text) {
    if (const LinkQuality quality = quality_of(value, bounds); quality > verdict.quality) verdict = {quality, text};
  };
  worse(link.loss, kLossBounds, fmt::format("{:.0f} % lost", link.loss * 100));
  worse(jitter_s, kJitterBounds_s, fmt::format("{:.0f} ms jitter", jitter_s * 1e3));
  worse(used, kSilenceBounds, fmt::format("silent for {:.0f} ms", silence_s * 1e3));
  if (link.round_trip.count() == 0 && verdict.quality != LinkQuality::kBad)
    return LinkVerdict{LinkQuality::kBad, "round trip not known"};
  return verdict;
}

const QualityBounds& bounds_of(LinkMeasure measure) noexcept {
  static constexpr std::array<const QualityBounds*, kLinkMeasures> kBounds{
      &kRoundTripBounds_s, &kLossBounds, &kJitterBounds_s, &kSilenceBounds, &kRoundTripBounds_s};
  return *kBounds[static_cast<std::size_t>(measure)];
}

std::optional<LinkValues> link_values(const LinkSide& link) noexcept {
  if (!link.heard || !std::isfinite(link.loss)) return std::nullopt;
  constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
  const double used = link.neutral_after_s > 0 ? link.silence_s / link.neutral_after_s : 0;
  LinkValues values{kUnknown, static_cast<float>(link.loss), kUnknown, static_cast<float>(used), kUnknown};
  // What came last is no measure of a link on which nothing comes any more.
  if (used > kSilenceBounds.bad) return values;
  const auto put = [&values](LinkMeasure measure, double value) {
    values[static_cast<std::size_t>(measure)] = static_cast<float>(value);
  };
  if (link.round_trip.count() > 0) put(LinkMeasure::kRoundTrip, to_seconds(link.round_trip.quantile(0.5)));
  put(LinkMeasure::kJitter, to_seconds(link.arrival_jitter.quantile(0.95)));
  put(LinkMeasure::kNewestRoundTrip, link.round_trip_s);
  return values;
}

void LinkHistory::watch(const ConsoleView& view) noexcept {
  pass(view.now);
  if (const auto values = link_values(view.link)) add(*values);
}

void LinkHistory::pass(Time now) noexcept {
  const std::int64_t second = now.time_since_epoch() / Duration(1s);
  if (second_ && second < *second_) *this = {};
  const std::int64_t passed = !second_ ? 1 : std::min(second - *second_, static_cast<std::int64_t>(kSeconds));
  for (std::int64_t i = 0; i < passed; ++i) {
    newest_ = (newest_ + 1) % kSeconds;
    seconds_[newest_] = {};
    count_ = std::min(count_ + 1, kSeconds);
  }
  second_ = second;
}

void LinkHistory::add(const LinkValues& values) noexcept {
  for (std::size_t i = 0; i < kLinkMeasures; ++i) {
    Range& range = seconds_[newest_][i];
    range.least = std::fmin(range.least, values[i]);
    range.most = std::fmax(range.most, values[i]);
  }
}

}  // namespace knuckle::console
