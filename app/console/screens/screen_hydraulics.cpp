#include <array>
#include <cmath>
#include <limits>

#include "app/console/screens/screens.h"
#include "app/console/widgets/plots.h"

namespace knuckle::console::screens {
namespace {

/// A bar from the middle, for what has a sign.
void signed_row(const widgets::Ui& ui, widgets::Area area, const char* label, double share, const char* number,
                ImU32 colour) {
  const widgets::Theme& t = ui.theme;
  const widgets::Area name = area.cut_left(t.px(70));
  widgets::put_label(t, name, label);
  const widgets::Area value = area.cut_right(t.px(74), t.unit());
  widgets::put_text(t.fonts.mono_small, t.colours.text, {value.max.x, value.centre().y}, widgets::Align::kRight,
                    number);
  const widgets::Area track = area.inset(0, (area.height() - t.px(22)) / 2);
  widgets::bar(ui, track, 0.5F, 0.5F + 0.5F * static_cast<float>(std::clamp(share, -1.0, 1.0)), colour);
  const float x = track.centre().x;
  widgets::canvas().AddLine({x, track.min.y - t.px(4)}, {x, track.max.y + t.px(4)}, widgets::ink(t.colours.muted),
                            t.px(1));
}

widgets::Shown signed_percent(double share) {
  return std::isfinite(share) ? widgets::shown("%+.1f %%", share * 100) : widgets::shown("- %%");
}

/// With the whole pump on its head side.
double fastest_cylinder_mps(const MachineDescription& machine, std::size_t joint) {
  return machine.hydraulics.pump_flow_m3ps / machine.cylinders[joint].head_area_m2();
}

void axis_card(const widgets::Ui& ui, const ConsoleData& data, std::size_t joint, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const ConsoleView& view = data.view;
  const auto axis = static_cast<Eigen::Index>(joint);
  constexpr std::array<const char*, kJoints> kTitles{"BOOM", "ARM", "BUCKET"};
  const widgets::Card card(ui, kTitles[joint], area, valves_freshness(view));
  widgets::Area rest = card.inside();
  widgets::Area bars = rest.cut_left(rest.width() * 0.46F, t.unit(2));
  const ImU32 command = t.colours.series[0], spool = t.colours.series[1], velocity = t.colours.series[2];
  const double speed_mps = widgets::cylinder_speed_mps(data.kinematics, view.machine, static_cast<int>(joint));
  const double fastest_mps = fastest_cylinder_mps(data.facts.machine, joint);
  const float height = std::min(t.px(56), bars.height() / 3);
  signed_row(ui, bars.cut_top(height), "command", view.status.valve_command[axis],
             signed_percent(view.status.valve_command[axis]).c_str(), command);
  signed_row(ui, bars.cut_top(height), "spool", view.status.spool[axis],
             signed_percent(view.status.spool[axis]).c_str(), spool);
  const bool moves_known = !measured_freshness(view).stale();
  signed_row(ui, bars.cut_top(height), "speed", moves_known ? speed_mps / fastest_mps : 0,
             moves_known ? ui.units.text(widgets::Quantity::kSpeed, speed_mps).c_str() : "-", velocity);
  using Sample = widgets::History::Sample;
  const std::array lines{
      widgets::Line{"command", command, [axis](const Sample& s) { return s.status.valve_command[axis]; }},
      widgets::Line{"spool", spool, [axis](const Sample& s) { return s.status.spool[axis]; }},
      widgets::Line{"speed", velocity, [&data, axis, fastest_mps](const Sample& s) {
                      return widgets::cylinder_speed_mps(data.kinematics, s.machine, static_cast<int>(axis)) /
                             fastest_mps;
                    }}};
  widgets::history_plot(ui, rest, data.plots.history(), lines,
                        {-1, 1, "-100 %", "+100 %, 10 s", widgets::History::kUnknown, true}, data.plots.cursor());
}

void flow_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const MachineStatus& s = data.view.status;
  const HydraulicsDescription& h = data.facts.machine.hydraulics;
  const widgets::Card card(ui, "OIL", area, status_freshness(data.view));
  widgets::Area rest = card.inside();
  const auto gauge = [&](widgets::Quantity q, const char* label, double value, double full, ImU32 colour) {
    widgets::value_row(ui, rest.cut_top(t.px(24)), label, ui.units.number(q, value).c_str(), ui.units.unit(q));
    widgets::bar(ui, rest.cut_top(t.px(10), t.px(2)), 0, static_cast<float>(value / full), colour);
    widgets::Area of = rest.cut_top(t.px(20), t.unit(0.5F));
    widgets::put_text(t.fonts.small, t.colours.muted, {of.max.x, of.centre().y}, widgets::Align::kRight,
                      widgets::shown("of %s", ui.units.text(q, full).c_str()).c_str());
  };
  // Calculated from speeds and pressures by the machine's side, which sends zeros while it does not know them.
  const double known = measured_freshness(data.view).stale() ? std::numeric_limits<double>::quiet_NaN() : 1;
  gauge(widgets::Quantity::kFlow, "Flow to the cylinders", s.oil_flow_m3ps * known, h.pump_flow_m3ps,
        t.colours.series[0]);
  gauge(widgets::Quantity::kPower, "Hydraulic power", s.hydraulic_power_W * known, h.pump_power_W, t.colours.series[1]);
  if (data.view.simulated)
    gauge(widgets::Quantity::kPressure, "Pump (simulated)", data.view.truth.pump_Pa, h.main_relief_Pa,
          t.colours.series[2]);
  const bool untold = data.view.sensors_alone || (data.player != nullptr && valves_freshness(data.view).stale());
  const char* pilot = untold ? "Pilot pressure -" : s.pilot_on ? "Pilot pressure on" : "Pilot pressure off";
  widgets::lamp(ui, rest.cut_top(t.px(26)), pilot, s.pilot_on, t.colours.good);
}

}  // namespace

DrawnScreen hydraulics_screen(const widgets::Ui& ui, const ConsoleData& data, UiState& /*state*/, widgets::Area area) {
  const widgets::Theme& t = ui.theme;
  const float gap = t.px(10);
  widgets::Area right = area.cut_right(t.px(300), gap);
  flow_card(ui, data, right.cut_top(t.px(data.view.simulated ? 258.F : 200.F), gap));
  {
    const widgets::Card card(ui, "ACTIVE LIMITS", right, machine_freshness(data.view));
    if (!limit_chips(ui, data, card.inside()))
      widgets::put_text(t.fonts.body, t.colours.muted, {card.inside().min.x, card.inside().min.y + t.px(13)},
                        widgets::Align::kLeft, limits_not_recorded(data) ? "-" : "none");
  }
  for (std::size_t j = 0; j < kJoints; ++j) axis_card(ui, data, j, area.row(static_cast<int>(j), kJoints, gap));
  return std::nullopt;
}

}  // namespace knuckle::console::screens
