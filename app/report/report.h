// One self-contained HTML page about a session: verdict, plots (gnuplot), filmstrip. No script, nothing fetched.
#pragma once

#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "app/cli/json.h"
#include "app/report/html.h"
#include "app/session/session_record.h"
#include "app/session/session_result.h"

namespace knuckle::report {

/// Where a page comes from; both are given by the caller, so that the same session makes the same page.
struct Origin {
  std::string command_line;  ///< As it can be typed again; empty: unknown.
  std::string date_utc;      ///< Of writing, ISO 8601; empty: unknown.
};

/// @throws InputError where gnuplot fails.
void write_report(const session::Judged& judged, const Origin& origin, std::ostream& out);

// The plots of a report, as gnuplot figures made from the session record.

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

// The machine-readable result of a session. docs/scenarios.md documents every key.

/// Changes when a key changes its meaning or goes; new keys leave it as it is.
inline constexpr const char* kResultSchema = "knuckle-session/2";

/// Every documented key is there, null where the session has no value; all numbers are finite.
[[nodiscard]] cli::Json result_json(const session::Judged& judged);

// The session as a table, one row per slave step: units in the headers, simulated truth in columns named truth_...

/// Comma-separated, one header line; numbers with 10 significant digits, flags as 0 or 1, modes and reasons by name.
void write_csv(const session::SessionRecord& record, std::ostream& out);

}  // namespace knuckle::report
