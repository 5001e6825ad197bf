// What follows a quick touch: the bucket goes at a wall at full speed, the set-point stops a little behind the face.
#pragma once

#include <ostream>
#include <vector>

#include "app/studies/contact_table.h"

namespace knuckle::studies {

struct Impact {
  ContactCell cell;
  double speed_mps = 0, press_N = 0;
  double peak_N = 0;
  double lift_off_m = 0;  ///< The furthest off the wall after the first touch.
  int bounces = 0;        ///< Losses of contact of 50 ms and more.
  double return_mps = 0;  ///< Fastest touch after such a loss.
  double settled_s = 0;   ///< From the touch until the push stays within 15 % of what it comes to.
  double swing_N = 0;     ///< Peak to peak over the last 1.5 s.
};
/// @param press_N asked for by where the set-point stops. Six seconds are looked at.
[[nodiscard]] Impact run_impact(const MachineDescription& machine, const ContactCell& cell, double speed_mps,
                                double press_N, std::uint64_t seed);
void print_impacts(const std::vector<Impact>& impacts, std::ostream& out);

}  // namespace knuckle::studies
