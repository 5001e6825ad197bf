#include <array>
#include <cmath>

#include "app/window/plots.h"
#include "app/window/screens.h"

namespace knuckle::app {
namespace {

/// A bar from the middle, for what has a sign.
void signed_row(const Ui& ui, Area area, const char* label, double share, const char* number, ImU32 colour) {
  const Theme& t = ui.theme;
  const Area name = area.cut_left(t.px(70));
  put_text(t.fonts.small, t.colours.muted, {name.min.x, name.centre().y}, Align::kLeft, label);
  const Area value = area.cut_right(t.px(74), t.unit());
  put_text(t.fonts.mono_small, t.colours.text, {value.max.x, value.centre().y}, Align::kRight, number);
  const Area track = area.inset(0, (area.height() - t.px(22)) / 2);
  bar(ui, track, 0.5F, 0.5F + 0.5F * static_cast<float>(std::clamp(share, -1.0, 1.0)), colour);
  const float x = track.centre().x;
  ImGui::GetWindowDrawList()->AddLine({x, track.min.y - t.px(4)}, {x, track.max.y + t.px(4)}, ink(t.colours.muted),
                                      t.px(1));
}

/// With the whole pump on its head side.
double fastest_cylinder_mps(const MachineDescription& machine, std::size_t joint) {
  return machine.hydraulics.pump_flow_m3ps / machine.cylinders[joint].head_area_m2();
}

void axis_card(const Ui& ui, const ConsoleData& data, std::size_t joint, const Area& area) {
  const Theme& t = ui.theme;
  const ConsoleView& view = data.view;
  const auto axis = static_cast<Eigen::Index>(joint);
  constexpr std::array<const char*, kJoints> kTitles{"BOOM", "ARM", "BUCKET"};
  const Card card(ui, kTitles[joint], area, status_freshness(view));
  Area rest = card.inside();
  Area bars = rest.cut_left(rest.width() * 0.46F, t.unit(2));
  const ImU32 command = t.colours.series[0], spool = t.colours.series[1], velocity = t.colours.series[2];
  const double speed_mps = cylinder_speed_mps(data.kinematics, view.machine, static_cast<int>(joint));
  const double fastest_mps = fastest_cylinder_mps(data.facts.machine, joint);
  const float height = std::min(t.px(56), bars.height() / 3);
  signed_row(ui, bars.cut_top(height), "command", view.status.valve_command[axis],
             shown("%+.1f %%", view.status.valve_command[axis] * 100).c_str(), command);
  signed_row(ui, bars.cut_top(height), "spool", view.status.spool[axis],
             shown("%+.1f %%", view.status.spool[axis] * 100).c_str(), spool);
  signed_row(ui, bars.cut_top(height), "speed", speed_mps / fastest_mps,
             ui.units.text(Quantity::kSpeed, speed_mps).c_str(), velocity);
  const std::array lines{Line{"command", command, [joint](const History::Sample& s) { return s.command[joint]; }},
                         Line{"spool", spool, [joint](const History::Sample& s) { return s.spool[joint]; }},
                         Line{"speed", velocity, [joint, fastest_mps](const History::Sample& s) {
                                return s.cylinder_mps[joint] / static_cast<float>(fastest_mps);
                              }}};
  history_plot(ui, rest, data.history, lines, {-1, 1, "-100 %", "+100 %, 10 s"});
}

void flow_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const MachineStatus& s = data.view.status;
  const HydraulicsDescription& h = data.facts.machine.hydraulics;
  const Card card(ui, "OIL", area, status_freshness(data.view));
  Area rest = card.inside();
  const auto gauge = [&](Quantity q, const char* label, double value, double full, ImU32 colour) {
    value_row(ui, rest.cut_top(t.px(24)), label, ui.units.number(q, value).c_str(), ui.units.unit(q));
    bar(ui, rest.cut_top(t.px(10), t.px(2)), 0, static_cast<float>(value / full), colour);
    Area of = rest.cut_top(t.px(20), t.unit(0.5F));
    put_text(t.fonts.small, t.colours.muted, {of.max.x, of.centre().y}, Align::kRight,
             shown("of %s", ui.units.text(q, full).c_str()).c_str());
  };
  gauge(Quantity::kFlow, "Flow to the cylinders", s.oil_flow_m3ps, h.pump_flow_m3ps, t.colours.series[0]);
  gauge(Quantity::kPower, "Hydraulic power", s.hydraulic_power_W, h.pump_power_W, t.colours.series[1]);
  if (data.view.simulated)
    gauge(Quantity::kPressure, "Pump (simulated)", data.view.truth.pump_Pa, h.main_relief_Pa, t.colours.series[2]);
  lamp(ui, rest.cut_top(t.px(26)), s.pilot_on ? "Pilot pressure on" : "Pilot pressure off", s.pilot_on, t.colours.good);
}

}  // namespace

void hydraulics_screen(const Ui& ui, const ConsoleData& data, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  Area right = area.cut_right(t.px(300), gap);
  flow_card(ui, data, right.cut_top(t.px(data.view.simulated ? 258.F : 200.F), gap));
  {
    const Card card(ui, "LIMITS BEING HIT", right, machine_freshness(data.view));
    if (!limit_chips(ui, data.view.machine.limits, card.inside()))
      put_text(t.fonts.body, t.colours.muted, {card.inside().min.x, card.inside().min.y + t.px(13)}, Align::kLeft,
               "none");
  }
  for (std::size_t j = 0; j < kJoints; ++j) axis_card(ui, data, j, area.row(static_cast<int>(j), kJoints, gap));
}

}  // namespace knuckle::app
