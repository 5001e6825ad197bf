// A battery as a page: its table, and maps of what was stable and what was felt.
#pragma once

#include <ostream>

#include "app/battery/table.h"

namespace knuckle::battery {

/// @throws InputError where gnuplot is missing or refuses.
void write_page(std::ostream& out, const Settings& settings, const Rows& rows);

}  // namespace knuckle::battery
