// The plots of a report, as gnuplot figures made from the session record.
#pragma once

#include <vector>

#include "app/html.h"
#include "app/session_result.h"

namespace knuckle::app {

/// Curves are thinned to what the eye can see, keeping every peak.
[[nodiscard]] std::vector<PageFigure> report_plots(const SessionResult& session);

}  // namespace knuckle::app
