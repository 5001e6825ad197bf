// The plots of a report, as gnuplot figures made from the session record.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/report/html.h"
#include "app/session/session_result.h"

namespace knuckle::report {

/// A moment that the page names.
struct PlotMark {
  double t_s = 0;
  std::string label;
};

/// Curves are thinned to what the eye can see, keeping every peak.
/// @param marks are drawn into every plot over time.
[[nodiscard]] std::vector<PageFigure> report_plots(const session::SessionResult& session,
                                                   const std::vector<PlotMark>& marks = {});

/// Title of the plot over time in which a metric is best seen.
[[nodiscard]] std::string plot_showing(std::string_view metric);

}  // namespace knuckle::report
