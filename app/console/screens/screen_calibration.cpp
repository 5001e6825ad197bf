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
void paragraph(const widgets::Theme& t, const ImFont* font, ImU32 colour, widgets::Area& rest,
               const std::string& text) {
  const float height = font->CalcTextSizeA(font->FontSize, 1e9F, rest.width(), text.c_str()).y;
  widgets::put_lines(font, colour, rest.cut_top(height, t.unit()), text.c_str());
}

/// Where the machine's side works by another file than this console was started with.
bool sides_differ(const ConsoleData& data) {
  return data.view.status_heard && data.view.status.calibrated != data.facts.machine.dynamics_calibration.has_value();
}

void origin_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const MachineDescription& machine = data.facts.machine;
  const widgets::Card card(ui, "CALIBRATION IN FORCE", area);
  widgets::Area rest = card.inside();
  const auto line = [&](const char* what, const std::string& words) {
    widgets::Area row = rest.cut_top(t.px(26));
    const widgets::Area name = row.cut_left(t.px(110));
    widgets::put_label(t, name, what);
    widgets::put_fitted(t.fonts.body, t.colours.text, row, words.c_str());
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

void table_row(const widgets::Ui& ui, widgets::Area& rest, const char* what, const Cells& cells, const ImFont* font) {
  const widgets::Theme& t = ui.theme;
  const widgets::Area row = rest.cut_top(t.px(28));
  widgets::put_fitted(t.fonts.body, t.colours.text, {row.min, {row.min.x + 0.4F * row.width(), row.max.y}}, what);
  for (int j = 0; j < kJoints; ++j) {
    const float x = row.min.x + row.width() * (0.6F + 0.2F * static_cast<float>(j));
    widgets::put_text(font, t.colours.text, {x, row.centre().y}, widgets::Align::kRight,
                      cells[static_cast<std::size_t>(j)].c_str());
  }
}

/// With the half-width of its 95 % interval.
std::string force_within(const widgets::Ui& ui, const DynamicsCalibration& dynamics, int joint, FrictionIndex which) {
  constexpr double kTwoSided95 = 1.96;
  const int at = friction_index(joint, which);
  const double within_N = kTwoSided95 * std::sqrt(std::max(0.0, dynamics.covariance(at, at)));
  return std::string(ui.units.text(widgets::Quantity::kForce, dynamics.parameters[at]).c_str()) + " ± " +
         ui.units.text(widgets::Quantity::kForce, within_N).c_str();
}

void accuracy_card(const widgets::Ui& ui, const MachineDescription& machine, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "HOW SURE IT IS", area);
  widgets::Area rest = card.inside();
  const auto row = [&](const char* what, const Cells& cells) { table_row(ui, rest, what, cells, t.fonts.mono_small); };
  table_row(ui, rest, "", {"boom", "arm", "bucket"}, t.fonts.small);
  if (const auto& dynamics = machine.dynamics_calibration) {
    row("torque left over, held-out motion", of_joints([&](int j) {
          return std::string(widgets::shown("%.0f N m", dynamics->residual_rms_Nm[j]).c_str());
        }));
    row("friction, extending", of_joints([&](int j) { return force_within(ui, *dynamics, j, kCoulombExtend); }));
    row("friction, retracting", of_joints([&](int j) { return force_within(ui, *dynamics, j, kCoulombRetract); }));
  }
  const auto valve = [&](auto cell) {
    return of_joints([&](int j) {
      const auto& found = machine.valve_calibration[static_cast<std::size_t>(j)];
      return found ? std::string(cell(*found).c_str()) : std::string("as drawn");
    });
  };
  row("dead band, extending",
      valve([](const ValveCalibration& v) { return widgets::shown("%.1f %%", 100 * v.dead_band_extend); }));
  row("dead band, retracting",
      valve([](const ValveCalibration& v) { return widgets::shown("%.1f %%", 100 * v.dead_band_retract); }));
  row("valve's delay", valve([](const ValveCalibration& v) { return widgets::shown("%.0f ms", 1e3 * v.delay_s); }));
  rest.cut_top(t.unit());
  const auto& geometry = machine.geometry_calibration;
  paragraph(t, t.fonts.body, t.colours.text, rest,
            geometry ? "Lengths and pins are surveyed: the tip is within " +
                           std::string(ui.units.text(widgets::Quantity::kSmallLength, geometry->tip_rms_m).c_str()) +
                           " (RMS) of held-out poses."
                     : "Lengths and pins are those of the drawing.");
}

}  // namespace

DrawnScreen calibration_screen(const widgets::Ui& ui, const ConsoleData& data, UiState& /*state*/, widgets::Area area) {
  const float gap = ui.theme.px(10);
  origin_card(ui, data, area.cut_top(ui.theme.px(290), gap));
  accuracy_card(ui, data.facts.machine, area);
  return std::nullopt;
}

}  // namespace knuckle::console::screens
