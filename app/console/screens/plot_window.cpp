#include "app/console/screens/plot_window.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace knuckle::console::screens {
namespace {

constexpr std::int64_t kHalf = History::kSamples / 2;

}  // namespace

std::string ago_text(Duration ago) {
  const auto seconds = ago / Duration(1s);
  return seconds < 60 ? fmt::format("{} s ago", seconds) : fmt::format("{} min {} s ago", seconds / 60, seconds % 60);
}

const EventRow* event_at(const EventBook& events, std::uint32_t run, Time at) {
  const auto& rows = events.rows();
  const auto found =
      std::find_if(rows.rbegin(), rows.rend(), [&](const EventRow& row) { return row.run == run && row.at <= at; });
  return found == rows.rend() ? nullptr : &*found;
}

bool PlotWindow::show(Time middle) {
  const std::int64_t step = History::step_of(middle);
  cursor_.share = static_cast<float>(0.5 + to_seconds(middle - History::time_of(step)) / History::kSpan_s);
  return std::exchange(middle_, step) != step;
}

float PlotWindow::share(Time at) const noexcept {
  return static_cast<float>(0.5 + to_seconds(at - History::time_of(middle_)) / History::kSpan_s);
}

std::optional<Time> PlotWindow::clicked() {
  const float share = std::exchange(cursor_.clicked, -1.F);
  if (share < 0) return std::nullopt;
  return History::time_of(middle_) + from_seconds((static_cast<double>(share) - 0.5) * History::kSpan_s);
}

void PlotWindow::fill(History& history, const SampleAt& sample_at) const {
  std::array<History::Sample, History::kSamples> samples;
  for (std::size_t i = 0; i < samples.size(); ++i)
    samples[i] = sample_at(middle_ - kHalf + static_cast<std::int64_t>(i));
  history.set(samples);
}

void PlotWindow::fill_beside(const char* name, const SampleAt& sample_at) {
  fill(beside_, sample_at);
  cursor_.beside = &beside_;
  cursor_.beside_name = name;
}

void LivePlots::watch(const ConsoleView& view, bool machine_known, bool status_known) {
  if (std::exchange(run_, view.run) != view.run) chosen_.reset();
  kept_.watch(view, machine_known, status_known);
}

void LivePlots::update(const ConsoleView& view) {
  if (const auto at = window_.clicked()) chosen_ = at;
  if (chosen_ && *chosen_ > view.now) chosen_.reset();
  window_.cursor().chosen = chosen_.has_value();
  window_.cursor().text = chosen_ ? ago_text(view.now - *chosen_) + " - End: now" : "";
  const Time newest = view.now - kHalf * from_seconds(History::kStep_s);
  // The seconds behind a chosen time may still be to come.
  const bool moved = window_.show(chosen_.value_or(newest)), passed = window_.share(view.now) > 1;
  if (!moved && passed && std::exchange(whole_, true)) return;
  whole_ = passed;
  window_.fill([this](std::int64_t step) {
    const History::Sample* sample = kept_.of_step(step);
    return sample != nullptr ? *sample : History::Sample{};
  });
}

void LivePlots::jump(bool later, const EventBook& events, const ConsoleView& view) {
  const Time from = chosen_.value_or(view.now);
  const auto& rows = events.rows();
  std::optional<Time> to;
  for (const EventRow& row : rows) {
    if (row.run != view.run || (later ? row.at <= from : row.at >= from)) continue;
    if (!to || (later ? row.at < *to : row.at > *to)) to = row.at;
  }
  if (to || later) chosen_ = to;  // after the newest event comes now
}

}  // namespace knuckle::console::screens
