#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "app/console/screens/screens.h"
#include "app/console/widgets/plots.h"
#include "machine/pilot_spool.h"
#include "machine/signal_units.h"

namespace knuckle::console::screens {
namespace {

/// A bar from the middle, for what has a sign.
void signed_row(const Ui& ui, Area area, const char* label, double share, std::string_view number, ImU32 colour) {
  const Theme& t = ui.theme;
  const Area name = area.cut_left(t.px(70));
  put_label(t, name, label);
  const Area value = area.cut_right(t.px(74), t.unit());
  put_text(t.fonts.mono_small, t.colours.text, value, Align::kRight, number);
  const Area track = area.inset(0, (area.height() - t.px(22)) / 2);
  bar(ui, track, 0.5F, 0.5F + 0.5F * static_cast<float>(std::clamp(share, -1.0, 1.0)), colour);
  const float x = track.centre().x;
  canvas().AddLine({x, track.min.y - t.px(4)}, {x, track.max.y + t.px(4)}, ink(t.colours.muted), t.px(1));
}

std::string signed_percent(double share) {
  return std::isfinite(share) ? fmt::format("{:+.1f} %", share * 100) : "- %";
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
  const Card card(ui, kTitles[joint], area, valves_freshness(view));
  Area rest = card.inside();
  Area bars = rest.cut_left(rest.width() * 0.46F, t.unit(2));
  const ImU32 command = t.colours.series[0], spool = t.colours.series[1], velocity = t.colours.series[2];
  const double speed_mps = cylinder_speed_mps(data.kinematics, view.machine, static_cast<int>(joint));
  const double fastest_mps = fastest_cylinder_mps(data.facts.machine, joint);
  const float height = std::min(t.px(56), bars.height() / 3);
  signed_row(ui, bars.cut_top(height), "command", view.status.valve_command[axis],
             signed_percent(view.status.valve_command[axis]), command);
  // Where nobody tells it, it is where the command should have driven it.
  const BusDescription& bus = data.facts.machine.bus;
  const char* const place = bus.by_frames() && !tells_pilots(bus, static_cast<int>(joint)) ? "model" : "spool";
  signed_row(ui, bars.cut_top(height), place, view.status.spool[axis], signed_percent(view.status.spool[axis]), spool);
  const bool moves_known = !measured_freshness(view).stale();
  signed_row(ui, bars.cut_top(height), "speed", moves_known ? speed_mps / fastest_mps : 0,
             moves_known ? ui.units.text(Quantity::kSpeed, speed_mps) : "-", velocity);
  using Sample = History::Sample;
  const std::array lines{Line{"command", command, [axis](const Sample& s) { return s.status.valve_command[axis]; }},
                         Line{place, spool, [axis](const Sample& s) { return s.status.spool[axis]; }},
                         Line{"speed", velocity, [&data, axis, fastest_mps](const Sample& s) {
                                return cylinder_speed_mps(data.kinematics, s.machine, static_cast<int>(axis)) /
                                       fastest_mps;
                              }}};
  history_plot(ui, rest, data.plots.history(), lines, {-1, 1, "-100 %", "+100 %, 10 s", History::kUnknown, true},
               data.plots.cursor());
}

void flow_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const MachineStatus& s = data.view.status;
  const HydraulicsDescription& h = data.facts.machine.hydraulics;
  const Card card(ui, "OIL", area, status_freshness(data.view));
  Area rest = card.inside();
  const auto gauge = [&](Quantity q, const char* label, double value, double full, ImU32 colour) {
    value_row(ui, rest.cut_top(t.px(24)), label, ui.units.number(q, value), ui.units.unit(q));
    bar(ui, rest.cut_top(t.px(10), t.px(2)), 0, static_cast<float>(value / full), colour);
    Area of = rest.cut_top(t.px(20), t.unit(0.5F));
    put_text(t.fonts.small, t.colours.muted, of, Align::kRight, fmt::format("of {}", ui.units.text(q, full)));
  };
  // Calculated from speeds and pressures by the machine's side, which sends zeros while it does not know them.
  const double known = measured_freshness(data.view).stale() ? std::numeric_limits<double>::quiet_NaN() : 1;
  gauge(Quantity::kFlow, "Flow to the cylinders", s.oil_flow_m3ps * known, h.pump_flow_m3ps, t.colours.series[0]);
  gauge(Quantity::kPower, "Hydraulic power", s.hydraulic_power_W * known, h.pump_power_W, t.colours.series[1]);
  if (data.view.simulated)
    gauge(Quantity::kPressure, "Pump (simulated)", data.view.truth.pump_Pa, h.main_relief_Pa, t.colours.series[2]);
  const bool untold = data.view.sensors_alone || (data.player != nullptr && valves_freshness(data.view).stale());
  const char* pilot = untold ? "Pilot pressure -" : s.pilot_on ? "Pilot pressure on" : "Pilot pressure off";
  lamp(ui, rest.cut_top(t.px(26)), pilot, s.pilot_on, t.colours.good);
}

/// What the machine file has of them.
std::vector<std::pair<const SignalInfo*, double>> readings_of(const ConsoleData& data) {
  std::vector<std::pair<const SignalInfo*, double>> all;
  int i = 0;
  MachineReadings::fields(data.view.readings, [&](const char*, double value) {
    const BroadcastField* const field = data.facts.machine.bus.broadcast(NodeRole::kReading, i++).field;
    if (field != nullptr) all.emplace_back(&field->info(), value);
  });
  return all;
}

void readings_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "MACHINE", area, status_freshness(data.view));
  Area rest = card.inside();
  for (const auto& [signal, value] : readings_of(data)) {
    std::string label = signal->name;
    std::replace(label.begin(), label.end(), '_', ' ');
    value_row(ui, rest.cut_top(t.px(24)), label, std::isfinite(value) ? value_text(*signal, value) : "not available",
              "");
  }
}

}  // namespace

DrawnScreen hydraulics_screen(const Ui& ui, const ConsoleData& data, UiState& /*state*/, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  Area right = area.cut_right(t.px(300), gap);
  flow_card(ui, data, right.cut_top(t.px(data.view.simulated ? 258.F : 200.F), gap));
  if (const std::size_t rows = readings_of(data).size(); rows > 0)
    readings_card(ui, data, right.cut_top(t.px(56 + 24 * static_cast<float>(rows)), gap));
  limits_card(ui, data, right);
  for (std::size_t j = 0; j < kJoints; ++j) axis_card(ui, data, j, area.row(static_cast<int>(j), kJoints, gap));
  return std::nullopt;
}

}  // namespace knuckle::console::screens
