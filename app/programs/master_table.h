// What the operator's side knew and did, as a table.
#pragma once

#include <ostream>

#include "master/master_state.h"

namespace knuckle::programs {

void write_master_header(std::ostream& out);
void write_master_row(std::ostream& out, const master::MasterState& row);

}  // namespace knuckle::programs
