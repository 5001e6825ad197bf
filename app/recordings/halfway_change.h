// Columns whose meaning changes half-way, as where a logger was set up anew: the unit (bar after Pa), or two channels
// that exchange their values.
#pragma once

#include "app/recordings/csv_reader.h"

namespace knuckle::recordings {

/// Pressures (..._Pa), lengths (..._m) and angles (..._rad) do not jump from one row to the next by the ratio of two
/// units, or to each other's value, and stay there. What changes while they move fast, or by less than they move within
/// some rows, cannot be told from motion; nor can what changes near zero, as in a chamber that is open to the tank.
/// One pressure alone may jump so by less than hundreds, as where a held load is let down: that is only noted.
/// @throws InputError naming columns, row and values.
void refuse_halfway_changes(MappedTable& table);

}  // namespace knuckle::recordings
