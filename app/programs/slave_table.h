// What the machine's side knew and did, as a table: one row each step. The columns of its sensors are those of
// Knuckle's recordings, so that `knuckle identify` reads the same file.
#pragma once

#include <ostream>

#include "slave/slave_state.h"

namespace knuckle::programs {

void write_slave_header(std::ostream& out);
/// @param row measured: its sensors are known.
void write_slave_row(std::ostream& out, const slave::SlaveState& row);

}  // namespace knuckle::programs
