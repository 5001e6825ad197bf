// The plots of a report, as gnuplot figures made from the session record.
#pragma once

#include <vector>

#include "app/report/html.h"
#include "app/session/session_result.h"

namespace knuckle::report {

/// Curves are thinned to what the eye can see, keeping every peak.
[[nodiscard]] std::vector<PageFigure> report_plots(const session::SessionResult& session);

}  // namespace knuckle::report
