// A survey as a table that a surveyor fills in: one pose a row. Format: docs/from-nothing-to-a-real-machine.md.
#pragma once

#include <ostream>
#include <string>

#include "estimation/identification/survey.h"

namespace knuckle::identify {

/// Columns `boom_encoder_m`, `arm_encoder_m`, `bucket_encoder_m` and, as pairs, any of `arm_pin_x_m`, `arm_pin_z_m`,
/// `bucket_pin_x_m`, ..., `tip_z_m`; in any order, each in m or, ending in `_mm`, in mm. An empty pair of cells is a
/// point that was not measured.
/// @param point_sigma_m standard deviation of one coordinate.
/// @throws InputError with file, row and column for anything else.
[[nodiscard]] estimation::Survey read_survey(const std::string& path, double point_sigma_m);

/// In m, to 0.01 mm; what read_survey reads.
void write_survey(const estimation::Survey& survey, std::ostream& out);

}  // namespace knuckle::identify
