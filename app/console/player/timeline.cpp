#include "app/console/player/timeline.h"

#include <algorithm>

namespace knuckle::console::player {

double Timeline::share(Time at) const noexcept {
  const Duration whole = run_.last() - run_.first();
  return whole > Duration::zero() ? to_seconds(at - run_.first()) / to_seconds(whole) : 0;
}

Time Timeline::at_share(double share) const noexcept {
  return run_.first() + from_seconds(std::clamp(share, 0.0, 1.0) * to_seconds(run_.last() - run_.first()));
}

void Timeline::pass(double seconds) noexcept {
  if (!playing_) return;
  const Time to = cursor_ + from_seconds(seconds * speed());
  seek(to);
  playing_ = to < run_.last();
}

void Timeline::toggle() noexcept {
  if (!playing_ && cursor_ >= run_.last()) cursor_ = run_.first();
  playing_ = !playing_;
}

void Timeline::seek(Time to) noexcept {
  cursor_ = std::clamp(to, run_.first(), run_.last());
  playing_ = false;
}

void Timeline::step(bool forth) noexcept {
  const auto to = forth ? run_.step_after(cursor_) : run_.step_before(cursor_);
  seek(to.value_or(cursor_));
}

void Timeline::jump(bool forth) noexcept {
  playing_ = false;
  const auto later = [](Time at, const EventRow& row) { return at < row.at; };
  const auto earlier = [](const EventRow& row, Time at) { return row.at < at; };
  if (forth) {
    const auto next = std::upper_bound(events_.begin(), events_.end(), cursor_, later);
    if (next != events_.end()) seek(next->at);
  } else {
    const auto here = std::lower_bound(events_.begin(), events_.end(), cursor_, earlier);
    if (here != events_.begin()) seek(std::prev(here)->at);
  }
}

}  // namespace knuckle::console::player
