// A battery's rows in figures: all together, and by what was drawn.
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/battery/rows.h"

namespace knuckle::battery {

/// One figure of a group: a share of its sessions, or a quantile of a metric over those that have it.
struct Figure {
  std::string name;             ///< "stable", "hold_error_N p95", ...
  std::optional<double> value;  ///< Nothing where no session of the group has it: shown as such.
  std::uint64_t of = 0;         ///< How many sessions it is over.
  [[nodiscard]] std::string text() const;
};

struct Group {
  std::string by, value;  ///< "limb", "light_grip"; "all", "" for everything.
  std::uint64_t drawn = 0, refused = 0;
  std::vector<Figure> figures;
};

// By the criteria of a drawn press (feel_cell.cpp).
/// A press that was held to its end, without a fault, with few losses of contact and little swing in the hand.
[[nodiscard]] bool steady_in_the_hand(const Row& row);
/// That, and little swing of the true force.
[[nodiscard]] bool stable(const Row& row);
/// That, and what was felt was the scaled true force.
[[nodiscard]] bool stable_and_right(const Row& row);
/// Nothing of the truth was kept from the hand for long (metric unfelt_s).
[[nodiscard]] bool nothing_unfelt(const Row& row);

/// By round trip, limb and what else the battery draws in classes; numbers that are drawn continuously by decade.
[[nodiscard]] std::vector<Group> groups_of(const Rows& rows, Kind kind);

// A battery as a page: its table, and maps of what was stable and what was felt.

/// @throws InputError where gnuplot is missing or refuses.
void write_page(std::ostream& out, const Settings& settings, const Rows& rows);

}  // namespace knuckle::battery
