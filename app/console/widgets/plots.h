// Plots of the console: histograms and short histories. No library: a few hundred lines of shapes.
#pragma once

#include <functional>
#include <span>

#include "app/console/widgets/history.h"
#include "app/console/widgets/widgets.h"
#include "core/histogram.h"

namespace knuckle::console::widgets {

struct HistogramRange {
  Duration from{}, to{};  ///< Axis, logarithmic.
  double limit_s = 0;     ///< A mark, such as the period; 0: none.
  const char* limit_label = "";
};

/// Bars on a logarithmic time axis, with p50, p99 and the longest as words above.
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
};

/// Of a plot that surrounds a time of a recording, which is chosen by a click; linked in all plots.
struct PlotCursor {
  float share = 0.5F;               ///< Where that time is, of the plot's width.
  const History* beside = nullptr;  ///< The same window of another run, dashed; nullptr: there is none.
  const char* beside_name = "";
  float clicked = -1;  ///< Share where the mouse is held in this frame; negative: nowhere.
};

/// The last ten seconds, newest on the right; a gap where nothing is known. @param cursor nullptr: time runs.
void history_plot(const Ui& ui, const Area& area, const History& history, std::span<const Line> lines, const Axis& axis,
                  PlotCursor* cursor = nullptr);

}  // namespace knuckle::console::widgets
