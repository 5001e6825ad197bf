// Judges sensors, sides, stroke ends and valve of one axis from its motions. Pure functions of recorded samples.
#pragma once

#include <optional>
#include <string>

#include "app/bringup/commission_jog.h"
#include "app/bringup/doctor_finding.h"
#include "machine/description.h"

namespace knuckle::bringup {

/// What a person saw the cylinder do.
enum class Seen : std::uint8_t { kLonger, kShorter, kStill, kAnother };

/// Encoder and valve of an axis after a motion that was to extend, or retract, it.
[[nodiscard]] Finding judge_direction(const JogRun& run, Seen seen);

/// The axis at one end of its stroke, its valve still open.
struct StrokeEnd {
  double reading_m = 0;
  std::array<double, 6> rise_Pa{};  ///< Of every chamber, against before the motion.
};
/// nullopt where the run did not end at a stop.
[[nodiscard]] std::optional<StrokeEnd> stroke_end(const JogRun& run);
/// At a stop the driven chamber must have risen more than any other. @param extended which end.
[[nodiscard]] Finding judge_sides(const StrokeEnd& end, int joint, bool extended);

/// Between both stops. A linkage may stop before the cylinder does, but not inside the joint's working range; further
/// than the cylinder goes nothing does.
[[nodiscard]] Finding judge_stroke(double stroke_m, int joint, const MachineDescription& machine);

/// Dead band from a slow ramp: behind it flow grows with the opening, and the opening with time, so the way grows with
/// the square of the time since the edge: sqrt(way) is a line whose root is the edge. The spool lags the command by the
/// file's delay and its second order (2 zeta / omega).
/// @return fraction of stroke; nullopt where the ramp did not move it far enough.
[[nodiscard]] std::optional<double> dead_band(const JogRun& ramp, const ValveDescription& valve);

}  // namespace knuckle::bringup
