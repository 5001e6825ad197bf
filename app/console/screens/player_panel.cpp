#include "app/console/screens/player_panel.h"

#include <utility>

#include "app/console/screens/console_data.h"

namespace knuckle::console::screens {
namespace {

constexpr std::size_t kMostEvents = 20'000;

}  // namespace

PlayerPanel::PlayerPanel(player::Played played, std::optional<Beside> beside)
    : played_(std::move(played)),
      beside_(std::move(beside)),
      kinematics_(played_.machine),
      timeline_(played_.run, played_.events),
      events_(kMostEvents),
      kept_(played_.run, played_.machine, kinematics_) {
  for (const EventRow& row : played_.events) events_.add(row.at, 1, row.severity, row.code, row.text);
  events_.acknowledge(EventFilter{});
  plots_.cursor().chosen = true;
  pass(0);
}

void PlayerPanel::pass(double seconds) {
  if (const auto clicked = plots_.clicked())
    timeline_.seek(*clicked);
  else
    timeline_.pass(seconds);
  const Time at = timeline_.cursor();
  if (shown_ == at) return;
  shown_ = at;
  view_ = played_.run.view(at);
  played_.run.show_link(at, view_.link);
  kept_.show(at);
  show_loads(at);
  if (beside_) {
    const Time there = at + beside_->later;
    beside_here_ = there >= beside_->run.first() && there <= beside_->run.last();
    beside_view_ = beside_->run.view(there);
  }
  if (!plots_.show(at)) return;
  const auto of_step = [](std::int64_t step) { return Time(step * from_seconds(widgets::History::kStep_s)); };
  plots_.fill([&](std::int64_t step) { return sample(played_.run, of_step(step)); });
  if (beside_)
    plots_.fill_beside(beside_->name.c_str(),
                       [&](std::int64_t step) { return sample(beside_->run, of_step(step) + beside_->later); });
}

void PlayerPanel::show_loads(Time at) {
  PushWatch watch;
  for (Time look = at - PushWatch::kLasts; look <= at; look += PushWatch::kLasts / 10) {
    loads_ = measured_loads(played_.run.view(look), played_.machine, kinematics_);
    watch.watch(loads_, look);
  }
}

widgets::History::Sample PlayerPanel::sample(const player::Run& run, Time at) const {
  if (!run.recorded(at)) return {};
  const ConsoleView view = run.view(at);
  return widgets::History::sample_of(view, kinematics_, !measured_freshness(view).stale(),
                                     !valves_freshness(view).stale());
}

bool PlayerPanel::in_gap() const noexcept {
  return !played_.run.recorded(timeline_.cursor());
}

}  // namespace knuckle::console::screens
