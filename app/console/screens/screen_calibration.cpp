#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>

#include "app/console/screens/screens.h"

namespace knuckle::console::screens {
namespace {

using Cells = std::array<std::string, kJoints>;

template <typename Cell>
Cells of_joints(Cell cell) {
  return {cell(0), cell(1), cell(2)};
}

/// As many lines as it takes, from the top of what is left.
void paragraph(const Theme& t, const ImFont* font, ImU32 colour, Area& rest, const std::string& text) {
  put_lines(font, colour, rest.cut_top(text_height(font, rest.width(), text), t.unit()), text);
}

/// Where the machine's side works by another file than this console was started with.
bool sides_differ(const ConsoleData& data) {
  return data.view.status_heard && data.view.status.calibrated != data.facts.machine.dynamics_calibration.has_value();
}

void origin_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const MachineDescription& machine = data.facts.machine;
  const Card card(ui, "CALIBRATION IN FORCE", area);
  Area rest = card.inside();
  const auto line = [&](const char* what, const std::string& text) {
    Area row = rest.cut_top(t.px(26));
    const Area name = row.cut_left(t.px(110));
    put_label(t, name, what);
    put_fitted(t.fonts.body, t.colours.text, row, text);
  };
  line("machine", machine.name);
  line("file", machine.source);
  if (const auto& from = machine.calibration_provenance) {
    line("identified", from->date + ", method " + from->method + ", by " + from->program);
    line("recordings", from->data_source);
    line("their SHA-256", from->data_sha256.substr(0, 16));
  }
  rest.cut_top(t.unit());
  if (!machine.dynamics_calibration)
    paragraph(t, t.fonts.body_bold, t.colours.notice, rest,
              "Never identified: masses, friction and forces are those of a drawing.");
  if (sides_differ(data))
    paragraph(t, t.fonts.body_bold, t.colours.notice, rest,
              data.view.status.calibrated
                  ? "The machine's side is calibrated, this console's machine file is not: give both the same file."
                  : "The machine's side is not calibrated, this console's machine file is: give both the same file.");
  paragraph(t, t.fonts.body, t.colours.muted, rest,
            "knuckle commission records a machine, knuckle identify makes a calibrated machine file of the recordings, "
            "and --machine FILE puts it in force.");
}

void table_row(const Ui& ui, Area& rest, const char* what, const Cells& cells, const ImFont* font) {
  const Theme& t = ui.theme;
  const Area row = rest.cut_top(t.px(28));
  put_fitted(t.fonts.body, t.colours.text, {row.min, {row.min.x + 0.4F * row.width(), row.max.y}}, what);
  for (int j = 0; j < kJoints; ++j) {
    const float x = row.min.x + row.width() * (0.6F + 0.2F * static_cast<float>(j));
    put_text(font, t.colours.text, {x, row.centre().y}, Align::kRight, cells[static_cast<std::size_t>(j)]);
  }
}

/// With the half-width of its 95 % interval.
std::string force_within(const Ui& ui, const DynamicsCalibration& dynamics, int joint, FrictionIndex which) {
  constexpr double kTwoSided95 = 1.96;
  const int at = friction_index(joint, which);
  const double within_N = kTwoSided95 * std::sqrt(std::max(0.0, dynamics.covariance(at, at)));
  return ui.units.text(Quantity::kForce, dynamics.parameters[at]) + " ± " + ui.units.text(Quantity::kForce, within_N);
}

void accuracy_card(const Ui& ui, const MachineDescription& machine, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "HOW SURE IT IS", area);
  Area rest = card.inside();
  const auto row = [&](const char* what, const Cells& cells) { table_row(ui, rest, what, cells, t.fonts.mono_small); };
  table_row(ui, rest, "", {"boom", "arm", "bucket"}, t.fonts.small);
  if (const auto& dynamics = machine.dynamics_calibration) {
    row("torque left over, held-out motion",
        of_joints([&](int j) { return fmt::format("{:.0f} N m", dynamics->residual_rms_Nm[j]); }));
    row("friction, extending", of_joints([&](int j) { return force_within(ui, *dynamics, j, kCoulombExtend); }));
    row("friction, retracting", of_joints([&](int j) { return force_within(ui, *dynamics, j, kCoulombRetract); }));
  }
  const auto valve = [&](auto cell) {
    return of_joints([&](int j) {
      const auto& found = machine.valve_calibration[static_cast<std::size_t>(j)];
      return found ? cell(*found) : "as drawn";
    });
  };
  row("dead band, extending",
      valve([](const ValveCalibration& v) { return fmt::format("{:.1f} %", 100 * v.dead_band_extend); }));
  row("dead band, retracting",
      valve([](const ValveCalibration& v) { return fmt::format("{:.1f} %", 100 * v.dead_band_retract); }));
  row("valve's delay", valve([](const ValveCalibration& v) { return fmt::format("{:.0f} ms", 1e3 * v.delay_s); }));
  rest.cut_top(t.unit());
  const auto& geometry = machine.geometry_calibration;
  paragraph(t, t.fonts.body, t.colours.text, rest,
            geometry ? "Lengths and pins are surveyed: the tip is within " +
                           ui.units.text(Quantity::kSmallLength, geometry->tip_rms_m) + " (RMS) of held-out poses."
                     : "Lengths and pins are those of the drawing.");
}

}  // namespace

DrawnScreen calibration_screen(const Ui& ui, const ConsoleData& data, UiState& /*state*/, Area area) {
  const float gap = ui.theme.px(10);
  origin_card(ui, data, area.cut_top(ui.theme.px(290), gap));
  accuracy_card(ui, data.facts.machine, area);
  return std::nullopt;
}

}  // namespace knuckle::console::screens
