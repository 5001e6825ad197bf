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

/// The last ten seconds, newest on the right; a gap where nothing is known.
void history_plot(const Ui& ui, const Area& area, const History& history, std::span<const Line> lines,
                  const Axis& axis);

}  // namespace knuckle::console::widgets
