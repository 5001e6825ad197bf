// The session as a table, one row per slave step: units in the headers, simulated truth in columns named truth_...
#pragma once

#include <ostream>

#include "app/session/session_record.h"

namespace knuckle::report {

/// Comma-separated, one header line; numbers with 10 significant digits, flags as 0 or 1, modes and reasons by name.
void write_csv(const session::SessionRecord& record, std::ostream& out);

}  // namespace knuckle::report
