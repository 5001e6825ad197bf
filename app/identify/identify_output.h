// An identification for people at a terminal and for tools.
#pragma once

#include <ostream>
#include <string>

#include "app/identify/identify.h"

namespace knuckle::identify {

[[nodiscard]] std::string identify_summary(const IdentifyData& data, const Identified& result);

/// Keys: docs/identification.md.
void write_identify_json(const IdentifyData& data, const Identified& result, std::ostream& out);

/// "usable", or "usable: no" with the first reason.
[[nodiscard]] std::string verdict(const Identified& result);

/// Whether standard deviations can be believed.
[[nodiscard]] std::string sigma_text(const Identified& result);

}  // namespace knuckle::identify
