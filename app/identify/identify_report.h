// One self-contained HTML page about an identification: verdict, measured against estimated torque, residuals,
// parameters against the drawing, friction, geometry, held-out errors, what was found in the data.
#pragma once

#include <ostream>

#include "app/identify/identify.h"

namespace knuckle::identify {

/// @throws InputError where gnuplot is missing.
void check_identify_report_tools();

/// @throws InputError where gnuplot fails.
void write_identify_report(const IdentifyData& data, const Identified& result, std::ostream& out);

}  // namespace knuckle::identify
