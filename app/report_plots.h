// The plots of a report, as gnuplot figures made from the session record.
#pragma once

#include <string>
#include <vector>

#include "app/gnuplot.h"
#include "app/simulate.h"

namespace knuckle::app {

struct ReportPlot {
  std::string title, caption;
  Figure figure;
};

/// Curves are thinned to what the eye can see, keeping every peak.
[[nodiscard]] std::vector<ReportPlot> report_plots(const SessionResult& session);

}  // namespace knuckle::app
