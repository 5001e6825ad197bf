// Force and oil pressures over time, for the screens that show them.
#pragma once

#include "app/console/screens/console_data.h"
#include "app/console/widgets/plots.h"

namespace knuckle::console::screens {

/// @param mark_N a line across it; unknown: none.
void force_plot(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area,
                float mark_N = widgets::History::kUnknown);
/// Both sides of one cylinder.
void pressure_plot(const widgets::Ui& ui, const ConsoleData& data, std::size_t joint, const widgets::Area& area);
/// Of head and rod side.
[[nodiscard]] std::array<ImU32, 2> side_colours(const widgets::Theme& theme);

/// At which the oil of a cylinder escapes.
[[nodiscard]] double lower_relief_Pa(const HydraulicsDescription& hydraulics) noexcept;

}  // namespace knuckle::console::screens
