// Which ten seconds plots show: those around a time that somebody has chosen, or the last ones.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "app/console/event_book.h"
#include "app/console/widgets/plots.h"

namespace knuckle::console::screens {

/// "3 min 12 s ago"
[[nodiscard]] std::string ago_text(Duration ago);
/// Of the events of a session up to this time the newest; nullptr: none.
[[nodiscard]] const EventRow* event_at(const EventBook& events, std::uint32_t run, Time at);

/// The window of plots, with their cursor.
class PlotWindow {
 public:
  using SampleAt = std::function<History::Sample(std::int64_t step)>;

  PlotWindow() = default;
  PlotWindow(const PlotWindow&) = delete;
  PlotWindow& operator=(const PlotWindow&) = delete;

  /// Puts this time into the middle. @return whether the samples have to be filled in again.
  [[nodiscard]] bool show(Time middle);
  void fill(const SampleAt& sample_at) { fill(history_, sample_at); }
  /// Another run's, dashed in the plots. @param name outlives this.
  void fill_beside(const char* name, const SampleAt& sample_at);
  /// The time that was clicked since the last call.
  [[nodiscard]] std::optional<Time> clicked();

  [[nodiscard]] const History& history() const noexcept { return history_; }
  [[nodiscard]] PlotCursor& cursor() noexcept { return cursor_; }
  /// Where a time is, of the plots' width; beyond [0, 1] it is not in the window.
  [[nodiscard]] float share(Time at) const noexcept;

 private:
  void fill(History& history, const SampleAt& sample_at) const;

  History history_, beside_;
  PlotCursor cursor_;
  std::int64_t middle_ = -1'000'000'000;  ///< In steps of the history; nothing was shown before.
};

/// The plots of a session that runs: the last ten seconds, or those around a chosen time. Of a time before the minutes
/// that are kept nothing is plotted.
class LivePlots {
 public:
  static constexpr Duration kKept = 10min;

  /// As History::watch().
  void watch(const ConsoleView& view, bool machine_known, bool status_known);
  /// Once a frame, before the plots are drawn.
  void update(const ConsoleView& view);
  /// Shows the seconds around this time, from now on; without one, the last ones.
  void choose(std::optional<Time> at) { chosen_ = at; }
  /// To the next event, or to the one before.
  void jump(bool later, const EventBook& events, const ConsoleView& view);
  [[nodiscard]] const std::optional<Time>& chosen() const noexcept { return chosen_; }
  [[nodiscard]] PlotWindow& window() noexcept { return window_; }

 private:
  History kept_{static_cast<std::size_t>(kKept / from_seconds(History::kStep_s))};
  PlotWindow window_;
  std::optional<Time> chosen_;
  bool whole_ = false;  ///< Filled since the last second shown was over.
  std::uint32_t run_ = 0;
};

}  // namespace knuckle::console::screens
