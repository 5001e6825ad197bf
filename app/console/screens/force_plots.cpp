#include "app/console/screens/force_plots.h"

#include <array>
#include <cmath>

namespace knuckle::console::screens {
namespace {

/// The next of 1, 2, 5, 10, ...
double round_above(double value) {
  const double decade = std::pow(10, std::floor(std::log10(value)));
  for (const double times : {1.0, 2.0, 5.0})
    if (times * decade >= value) return times * decade;
  return 10 * decade;
}

}  // namespace

void force_plot(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area, float mark_N) {
  widgets::PlotCursor& cursor = data.plots.cursor();
  float most = std::isfinite(mark_N) ? mark_N : 1;
  for (const widgets::History* history : {&data.plots.history(), cursor.beside}) {
    for (std::size_t i = 0; history != nullptr && i < history->size(); ++i)
      if (const float force = history->ago(i).tip_force_N; force > most) most = force;
  }
  // Round in the unit that is read.
  const double per_N = ui.units.convert(widgets::Quantity::kForce, 1);
  const double top_N = round_above(static_cast<double>(most) * per_N) / per_N;
  const std::array lines{
      widgets::Line{"force", ui.theme.colours.force, [](const widgets::History::Sample& s) { return s.tip_force_N; }}};
  widgets::history_plot(
      ui, area, data.plots.history(), lines,
      {0, static_cast<float>(top_N), "0", ui.units.text(widgets::Quantity::kForce, top_N).c_str(), mark_N}, cursor);
}

std::array<ImU32, 2> side_colours(const widgets::Theme& theme) {
  return {theme.colours.series[0], theme.colours.series[1]};
}

double lower_relief_Pa(const HydraulicsDescription& hydraulics) noexcept {
  return std::min(hydraulics.main_relief_Pa, hydraulics.port_relief_Pa);
}

void pressure_plot(const widgets::Ui& ui, const ConsoleData& data, std::size_t joint, const widgets::Area& area) {
  const std::array<ImU32, 2> colours = side_colours(ui.theme);
  const HydraulicsDescription& h = data.facts.machine.hydraulics;
  const auto side = [joint](std::size_t i) {
    return [i, joint](const widgets::History::Sample& s) { return s.pressure_Pa[2 * joint + i]; };
  };
  const std::array lines{widgets::Line{"head", colours[0], side(0)}, widgets::Line{"rod", colours[1], side(1)}};
  const double top_Pa = 1.1 * std::max(h.port_relief_Pa, h.main_relief_Pa);
  widgets::history_plot(
      ui, area, data.plots.history(), lines,
      {0, static_cast<float>(top_Pa), "0", ui.units.text(widgets::Quantity::kPressure, top_Pa).c_str(),
       static_cast<float>(lower_relief_Pa(h))},
      data.plots.cursor());
}

}  // namespace knuckle::console::screens
