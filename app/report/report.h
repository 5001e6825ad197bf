// One self-contained HTML page about a session: verdict, plots (gnuplot), filmstrip. No script, nothing fetched.
#pragma once

#include <ostream>
#include <string>

#include "app/session/session_result.h"

namespace knuckle::report {

/// Where a page comes from; both are given by the caller, so that the same session makes the same page.
struct Origin {
  std::string command_line;  ///< As it can be typed again; empty: unknown.
  std::string date_utc;      ///< Of writing, ISO 8601; empty: unknown.
};

/// @throws InputError where gnuplot fails.
void write_report(const session::Judged& judged, const Origin& origin, std::ostream& out);

}  // namespace knuckle::report
