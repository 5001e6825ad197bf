// Plots of the console: histograms and short histories. No library: a few hundred lines of shapes.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "app/console/widgets/history.h"
#include "app/console/widgets/widgets.h"
#include "core/histogram.h"

namespace knuckle::console::widgets {

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
  std::function<float(const History::Sample&)> value;
};

struct Axis {
  float low = -1, high = 1;
  const char* low_label = "";
  const char* high_label = "";
  float mark = History::kUnknown;  ///< A line across, such as a limit; unknown: none.
  bool legend = false;             ///< The lines' names are written into the plot; else they stand beside it.
};

/// The time that plots surround, once it was chosen by a click; linked in all plots.
struct PlotCursor {
  bool chosen = false;              ///< Else time runs, and the newest is on the right.
  float share = 0.5F;               ///< Where the chosen time is, of the plot's width.
  const History* beside = nullptr;  ///< The same window of another run, dashed; nullptr: there is none.
  const char* beside_name = "";
  std::string words;   ///< Beside its line, such as how long ago; empty: nothing.
  float clicked = -1;  ///< Share where the mouse is held in this frame; negative: nowhere.
};

/// Ten seconds of a history; a gap where nothing is known.
void history_plot(const Ui& ui, const Area& area, const History& history, std::span<const Line> lines, const Axis& axis,
                  PlotCursor& cursor);

/// Values of the last minutes over bands of quality, each as high as the others; the newest on the right.
struct Bands {
  std::array<float, 3> bounds;                                            ///< Between them.
  std::array<const char*, 4> names;                                       ///< Of the bands, from below.
  std::array<std::string, 3> bound_words;                                 ///< With unit.
  std::size_t columns = 0, of = 1;                                        ///< How many there are, and have room.
  using Range = std::function<std::pair<float, float>(std::size_t ago)>;  ///< Least and most; no numbers: not known.
  Range range;                                                            ///< In the colours of the bands.
  Range behind{};                                                         ///< Another one, pale; empty: none.
  const char* span_words = "";                                            ///< What the whole width is.
};
void band_plot(const Ui& ui, const Area& area, const Bands& bands);

}  // namespace knuckle::console::widgets
