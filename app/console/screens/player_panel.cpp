#include "app/console/screens/player_panel.h"

#include <algorithm>
#include <utility>

#include "app/console/screens/console_data.h"

namespace knuckle::console::screens {
namespace {

constexpr std::size_t kMostEvents = 20'000;
constexpr std::int64_t kHalf = widgets::History::kSamples / 2;

Time of_step(std::int64_t step) {
  return Time(step * from_seconds(widgets::History::kStep_s));
}

}  // namespace

PlayerPanel::PlayerPanel(player::Played played, std::optional<Beside> beside)
    : played_(std::move(played)),
      beside_(std::move(beside)),
      kinematics_(played_.machine),
      timeline_(played_.run, played_.events),
      events_(kMostEvents) {
  for (const EventRow& row : played_.events) events_.add(row.at, 1, row.severity, row.code, row.text);
  events_.acknowledge(EventFilter{});
  sum_payload();
  if (beside_) {
    plot_cursor_.beside = &beside_history_;
    plot_cursor_.beside_name = beside_->name.c_str();
  }
  pass(0);
}

/// As the console that was watched from the recording's beginning on counted it.
void PlayerPanel::sum_payload() {
  PayloadTotal total(kLeastLoad * played_.machine.payload_full_scale_kg);
  carried_.push_back({played_.run.first(), total});
  constexpr Duration kLook = 20ms;
  for (Time at = played_.run.first(); at <= played_.run.last(); at += kLook) {
    const player::MachineStep* step = played_.run.machine_at(at);
    if (step == nullptr) continue;
    const ConsoleView view = played_.run.view(at);
    if (measured_freshness(view).stale()) continue;
    total.watch(view.machine, at);
    if (total.loads() != carried_.back().total.loads()) carried_.push_back({at, total});
  }
}

void PlayerPanel::pass(double seconds) {
  if (plot_cursor_.clicked >= 0) {
    constexpr double kSpan_s = widgets::History::kSpan_s;
    timeline_.seek(of_step(window_) + from_seconds((static_cast<double>(plot_cursor_.clicked) - 0.5) * kSpan_s));
    plot_cursor_.clicked = -1;
  } else {
    timeline_.pass(seconds);
  }
  const Time at = timeline_.cursor();
  if (shown_ == at) return;
  shown_ = at;
  view_ = played_.run.view(at);
  played_.run.show_link(at, view_.link);
  if (beside_) {
    const Time there = at + beside_->later;
    beside_here_ = there >= beside_->run.first() && there <= beside_->run.last();
    beside_view_ = beside_->run.view(there);
  }
  const std::int64_t window = at.time_since_epoch() / from_seconds(widgets::History::kStep_s);
  plot_cursor_.share = static_cast<float>(0.5 + to_seconds(at - of_step(window)) / widgets::History::kSpan_s);
  if (std::exchange(window_, window) == window) return;
  fill(history_, played_.run, {});
  if (beside_) fill(beside_history_, beside_->run, beside_->later);
}

void PlayerPanel::fill(widgets::History& history, const player::Run& run, Duration later) const {
  std::array<widgets::History::Sample, widgets::History::kSamples> samples;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Time at = of_step(window_ - kHalf + static_cast<std::int64_t>(i)) + later;
    if (!run.recorded(at)) continue;
    const ConsoleView view = run.view(at);
    samples[i] = widgets::History::sample_of(view, kinematics_, !measured_freshness(view).stale(),
                                             !valves_freshness(view).stale());
  }
  history.set(samples);
}

const PayloadTotal& PlayerPanel::payload() const noexcept {
  const auto later = std::upper_bound(carried_.begin(), carried_.end(), timeline_.cursor(),
                                      [](Time at, const Carried& row) { return at < row.at; });
  return later == carried_.begin() ? carried_.front().total : std::prev(later)->total;
}

bool PlayerPanel::in_gap() const noexcept {
  return !played_.run.recorded(timeline_.cursor());
}

}  // namespace knuckle::console::screens
