// Plots of the console: histograms and short histories. No library: a few hundred lines of shapes.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/console/console_view.h"
#include "app/console/widgets/widgets.h"
#include "core/histogram.h"
#include "machine/kinematics.h"

namespace knuckle::console {

// A few signals of late, for plots: ten seconds of them, or all that is kept of a session that runs.

/// Speed at which a joint's cylinder extends; no number where it is not known.
[[nodiscard]] double cylinder_speed_mps(const Kinematics& kinematics, const SlaveMessage& machine, int joint) noexcept;
/// The force on the tip; no number while nothing of it is known.
[[nodiscard]] double known_force_N(const SlaveMessage& machine) noexcept;

/// Fixed room; sampled on the loops' own time, so it stops with a paused session.
class History {
 public:
  /// @param kept samples.
  explicit History(std::size_t kept = kSamples) : samples_(kept) {}

  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  static constexpr double kSpan_s = 10, kStep_s = 0.05;
  static constexpr std::size_t kSamples = 201;

  /// What is known at one time: plots take their values from it. What is not known is NaN.
  struct Sample {
    Sample() noexcept;
    SlaveMessage machine;
    MachineStatus status;
    double hand_energy_J = kUnknown;
  };

  /// Takes a sample when one is due; restarts with the session. What is not received, or was not looked at, is
  /// unknown.
  /// @param machine_known, @param status_known whether the view's machine and status are fresh.
  void watch(const ConsoleView& view, bool machine_known, bool status_known);
  /// One sample of a view, whether or not one is due.
  [[nodiscard]] static Sample sample_of(const ConsoleView& view, bool machine_known, bool status_known);
  /// These instead of what was there; the oldest first.
  void set(const std::array<Sample, kSamples>& samples) noexcept;
  /// Of this step of kStep_s since the session began; nullptr: not kept.
  [[nodiscard]] const Sample* of_step(std::int64_t step) const noexcept;
  [[nodiscard]] static std::int64_t step_of(Time at) noexcept { return at.time_since_epoch() / from_seconds(kStep_s); }
  [[nodiscard]] static Time time_of(std::int64_t step) noexcept { return Time(step * from_seconds(kStep_s)); }
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// 0: the newest.
  [[nodiscard]] const Sample& ago(std::size_t steps) const noexcept {
    return samples_[(next_ + samples_.size() - 1 - steps) % samples_.size()];
  }

 private:
  void add(const Sample& sample) noexcept;

  std::vector<Sample> samples_;
  std::size_t next_ = 0, count_ = 0;
  std::int64_t last_ = -1;  ///< Number of the newest sample's step since the session began.
};

struct HistogramRange {
  Duration from{}, to{};  ///< Axis, logarithmic.
  double limit_s = 0;     ///< A mark, such as the period; 0: none.
  const char* limit_label = "";
};

/// Bars on a logarithmic time axis, with the median, what 99 % are below and the longest as words above.
void histogram_plot(const Ui& ui, const Area& area, const char* label, const Histogram& histogram,
                    const HistogramRange& range, ImU32 colour);

struct Line {
  const char* label;
  ImU32 colour;
  std::function<double(const History::Sample&)> value;
};

struct Axis {
  double low = -1, high = 1;
  std::string low_label, high_label;
  double mark = History::kUnknown;  ///< A line across, such as a limit; unknown: none.
  bool legend = false;              ///< The lines' names are written into the plot; else they stand beside it.
};

/// The time that plots surround, once it was chosen by a click; linked in all plots.
struct PlotCursor {
  bool chosen = false;              ///< Else time runs, and the newest is on the right.
  float share = 0.5F;               ///< Where the chosen time is, of the plot's width.
  const History* beside = nullptr;  ///< The same window of another run, dashed; nullptr: there is none.
  const char* beside_name = "";
  std::string text;    ///< Beside its line, such as how long ago; empty: nothing.
  float clicked = -1;  ///< Share where the mouse is held in this frame; negative: nowhere.
};

/// Ten seconds of a history; a gap where nothing is known.
void history_plot(const Ui& ui, const Area& area, const History& history, std::span<const Line> lines, const Axis& axis,
                  PlotCursor& cursor);

/// Values of the last minutes over bands of quality, each as high as the others; the newest on the right.
struct Bands {
  std::array<float, 3> bounds;                                            ///< Between them.
  std::array<const char*, 4> names;                                       ///< Of the bands, from below.
  std::array<std::string, 3> bound_text;                                  ///< With unit.
  std::size_t columns = 0, of = 1;                                        ///< How many there are, and have room.
  using Range = std::function<std::pair<float, float>(std::size_t ago)>;  ///< Least and most; no numbers: not known.
  Range range;                                                            ///< In the colours of the bands.
  Range behind{};                                                         ///< Another one, pale; empty: none.
  const char* span_text = "";                                             ///< What the whole width is.
};
void band_plot(const Ui& ui, const Area& area, const Bands& bands);

}  // namespace knuckle::console
