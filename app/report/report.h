// One self-contained HTML page about a session: verdict, plots (gnuplot), filmstrip. No script, nothing fetched.
#pragma once

#include <ostream>

#include "app/session/session_result.h"

namespace knuckle::report {

/// @throws InputError where gnuplot is missing.
void check_report_tools();

/// @throws InputError where gnuplot fails.
void write_report(const session::Judged& judged, std::ostream& out);

}  // namespace knuckle::report
