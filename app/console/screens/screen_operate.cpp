#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "app/console/machine_text.h"
#include "app/console/picture/picture_colours.h"
#include "app/console/screens/measures.h"
#include "app/console/screens/picture_pane.h"
#include "app/console/screens/player_panel.h"
#include "app/console/screens/screens.h"

namespace knuckle::console::screens {
namespace {

constexpr double kNearMost = 0.8;                           // of the maximum: the gauge warns
constexpr float kLeastMost_N = 100, kMostMost_N = 200'000;  // that can be set

/// Standard deviation along the force itself.
double sigma_along(const SlaveMessage& m) {
  const double norm = m.tip_force_N.norm();
  const auto& [xx, xz, zz] = m.covariance_N2;
  if (norm < 1) return std::sqrt(std::max(0.0, 0.5 * (xx + zz)));
  const PlanarVector u = m.tip_force_N / norm;
  return std::sqrt(std::max(0.0, u.x() * u.x() * xx + 2 * u.x() * u.y() * xz + u.y() * u.y() * zz));
}

/// Compass of the arm's plane, machine on the left: the force's direction, not its size.
void direction_dial(const Ui& ui, const Area& area, const SlaveMessage& m, bool known) {
  const Theme& t = ui.theme;
  const ImVec2 c = area.centre();
  const float r = std::min(area.width(), area.height()) / 2 - t.px(2);
  canvas().AddCircle(c, r, ink(t.colours.border), 48, t.px(1.5F));
  for (int i = 0; i < 8; ++i) {
    const float a = static_cast<float>(i) * 0.7853982F, inner = r - t.px(i % 2 == 0 ? 7.F : 4.F);
    canvas().AddLine({c.x + inner * std::cos(a), c.y + inner * std::sin(a)},
                     {c.x + r * std::cos(a), c.y + r * std::sin(a)}, ink(t.colours.border), t.px(1.5F));
  }
  if (!known) return put_text(t.fonts.mono, t.colours.muted, c, Align::kCentre, "-");
  const PlanarVector u = m.tip_force_N.normalized();
  const ImVec2 d{static_cast<float>(u.x()), static_cast<float>(-u.y())}, n{-d.y, d.x};
  const auto at = [&](float along, float across) {
    return ImVec2{c.x + d.x * along * r + n.x * across * r, c.y + d.y * along * r + n.y * across * r};
  };
  const ImU32 colour = ink(t.colours.force);
  canvas().AddLine(at(-0.7F, 0), at(0.4F, 0), colour, t.px(4));
  canvas().AddTriangleFilled(at(0.78F, 0), at(0.3F, -0.28F), at(0.3F, 0.28F), colour);
}

/// What the card says of the force's size.
struct Size {
  std::string number;  ///< "1460", "< 755" where it is smaller than its own doubt, "> 8200" where it is the least.
  double least_N = 0;  ///< That the gauge is filled to.
  bool open = false;   ///< It may be any more.
  bool directed = false;
};
Size size_of(const Units& units, const ForceText& said, const BlindPress& press, double force_N, double sigma_N) {
  constexpr Quantity q = Quantity::kForce;
  if (!said.known && !press.text.empty())
    return {fmt::format("> {}", units.number(q, 100 * std::floor(press.least_N / 100))), press.least_N, true};
  if (!said.known) return {"-"};
  if (force_N < sigma_N) return {fmt::format("< {}", units.number(q, force_N + sigma_N)), force_N};
  return {units.number(q, force_N), force_N, false, true};
}

/// The force against what the person says is too much here.
void force_gauge(const Ui& ui, UiState& state, Area& rest, const Size& size) {
  const Theme& t = ui.theme;
  const auto most_N = static_cast<double>(state.force_most_N);
  const double share = size.least_N / most_N;
  const ImU32 colour = share > 1 ? t.colours.bad : share > kNearMost ? t.colours.notice : t.colours.accent;
  const Area line = rest.cut_top(t.px(14), t.px(4));
  bar(ui, line, 0, static_cast<float>(share), size.open ? mix(colour, t.colours.raised, 0.5F) : colour);
  if (size.open) hatch(ui, line, colour, 3);
  canvas().AddRect(line.min, line.max, ink(share > 1 ? t.colours.bad : t.colours.border), t.px(3), 0,
                   t.px(share > 1 ? 2.F : 1.F));
  Area row = rest.cut_top(t.px(24), t.unit(0.5F));
  const char* word = share > 1 ? "Too much" : "Maximum";
  put_text(share > 1 ? t.fonts.body_bold : t.fonts.small, share > 1 ? t.colours.bad : t.colours.muted, row,
           Align::kLeft, word);
  row.cut_left(t.px(74));
  force_slider(ui, row, "##most", state.force_most_N, {kLeastMost_N, kMostMost_N}, {.logarithmic = true});
}

/// One of the force's parts: from where it comes, in a word.
void from_row(const Ui& ui, const Area& row, const Size& size, double part_N, std::array<const char*, 3> text) {
  const Quantity q = Quantity::kForce;
  const char* word = !size.directed ? text[2] : part_N > 0 ? text[0] : text[1];
  const std::string number = size.directed ? ui.units.number(q, std::abs(part_N)) : "-";
  value_row(ui, row, word, number, ui.units.unit(q));
}

/// How sure it is, and why no surer.
void confidence_rows(const Ui& ui, const ConsoleView& view, const BlindPress& press, Area& rest) {
  const Theme& t = ui.theme;
  const double sure = view.machine.confidence;
  const auto confidence = static_cast<float>(sure);
  const char* word = confidence > 0.75F ? "good" : confidence > 0.4F ? "fair" : "poor";
  const ImU32 colour = confidence > 0.75F ? t.colours.good : confidence > 0.4F ? t.colours.notice : t.colours.bad;
  value_row(ui, rest.cut_top(t.px(22)), "Confidence", fixed(sure * 100, 0), "%");
  bar(ui, rest.cut_top(t.px(10), t.unit(0.75F)), 0, confidence, colour);
  const std::string text = !press.text.empty() ? press.text
                           : std::isnan(sure)  ? "not recorded"
                                               : std::string(word) + ": " + confidence_text(view);
  put_lines(t.fonts.small, press.text.empty() ? t.colours.muted : t.colours.notice, rest, ui.units.as_shown(text));
}

void force_card(const Ui& ui, const ConsoleData& data, UiState& state, const Area& area) {
  const Theme& t = ui.theme;
  const SlaveMessage& m = data.view.machine;
  const Card card(ui, "FORCE ON THE BUCKET TIP", area, measured_freshness(data.view));
  Area rest = card.inside();
  const ForceText said = force_text(data.view);
  const BlindPress press = blind_press(data.view, data.loads);
  const double force_N = m.tip_force_N.norm(), sigma_N = sigma_along(m);
  const Size size = size_of(ui.units, said, press, force_N, sigma_N);
  Area top = rest.cut_top(t.px(80), t.unit());
  direction_dial(ui, top.cut_right(t.px(80), t.unit()), m, size.directed && force_N > 2 * sigma_N && force_N > 1);
  const Quantity q = Quantity::kForce;
  Area lines = top;
  put_fitted(t.fonts.small, t.colours.muted, lines.cut_top(t.fonts.small->FontSize * 1.1F),
             size.open ? "At least" : "Estimated");
  put_large(ui, lines.cut_top(t.fonts.mono_display->FontSize * 1.1F), t.colours.text, size.number, ui.units.unit(q));
  if (size.directed)
    put_text(t.fonts.mono_small, t.colours.muted, {top.min.x, top.max.y - t.px(10)}, Align::kLeft,
             fmt::format("\xC2\xB1 {}", ui.units.text(q, sigma_N)));
  force_gauge(ui, state, rest, size);
  lamp(ui, rest.cut_top(t.px(22), t.unit(0.5F)), size.open ? "Pressing" : said.contact_word, said.contact || size.open,
       t.colours.force);
  from_row(ui, rest.cut_top(t.px(22)), size, m.tip_force_N.x(), {"From behind", "From the front", "Front or behind"});
  from_row(ui, rest.cut_top(t.px(22)), size, m.tip_force_N.y(), {"From below", "From above", "Below or above"});
  const bool wall = !said.known && feels_end_of_range(data.view, data.facts.machine);
  value_row(ui, rest.cut_top(t.px(22), t.unit(0.5F)), wall ? "Felt: end of the range" : "Felt in the hand",
            ui.units.number(Quantity::kHandForce, data.view.hand.sent_force_N.norm()),
            ui.units.unit(Quantity::kHandForce));
  confidence_rows(ui, data.view, press, rest);
}

void payload_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const SlaveMessage& m = data.view.machine;
  const Card card(ui, "PAYLOAD", area, measured_freshness(data.view));
  Area rest = card.inside();
  const Quantity q = Quantity::kMass;
  const Area line = rest.cut_top(t.px(40), t.unit(0.5F));
  const double full_kg = data.facts.machine.payload_full_scale_kg;
  const bool known = payload_is_known(m, full_kg);
  const std::string number = known ? ui.units.number(q, m.payload_kg) : "-";
  put_large(ui, line, known ? t.colours.text : t.colours.muted, number, known ? ui.units.unit(q) : "not known");
  if (known)
    put_text(t.fonts.mono_small, t.colours.muted, {line.max.x, line.centre().y + t.px(4)}, Align::kRight,
             fmt::format("\xC2\xB1 {}", ui.units.text(q, m.payload_sigma_kg)));
  const Area share = rest.cut_top(t.px(10), t.unit(0.75F));
  if (known) bar(ui, share, 0, static_cast<float>(m.payload_kg / std::max(full_kg, 1.0)), t.colours.accent);
  const int loads = data.kept.payload.loads();
  const std::string carried = fmt::format("Carried, {} load{}", loads, loads == 1 ? "" : "s");
  value_row(ui, rest.cut_top(t.px(24)), data.view.sensors_alone ? "Carried" : carried,
            data.view.sensors_alone ? "-" : ui.units.number(q, data.kept.payload.total_kg()), ui.units.unit(q));
}

void pressure_bar(const Ui& ui, const ConsoleData& data, std::size_t chamber, Area area) {
  const Theme& t = ui.theme;
  const HydraulicsDescription& h = data.facts.machine.hydraulics;
  const bool measured = (data.view.machine.unknown_torques >> (chamber / 2) & 1) == 0;
  const double pressure = measured ? data.view.machine.pressure_Pa[chamber] : std::numeric_limits<double>::quiet_NaN();
  const double full = 1.1 * std::max(h.port_relief_Pa, h.main_relief_Pa);
  const Area side = area.cut_bottom(t.px(20));
  const Area number = area.cut_bottom(t.px(20));
  put_text(t.fonts.small, t.colours.muted, side.centre(), Align::kCentre, chamber % 2 == 0 ? "head" : "rod");
  put_text(t.fonts.mono_small, t.colours.text, number.centre(), Align::kCentre,
           ui.units.number(Quantity::kPressure, pressure));
  const Area tube = area.inset((area.width() - t.px(22)) / 2, 0);
  canvas().AddRectFilled(tube.min, tube.max, ink(t.colours.raised), t.px(4));
  const auto y_of = [&](double pa) {
    return tube.max.y - tube.height() * static_cast<float>(std::clamp(pa / full, 0.0, 1.0));
  };
  const bool high = pressure > data.facts.machine.limits.chamber_pressure_Pa || at_relief(h, pressure);
  const ImU32 colour = high ? t.colours.bad : t.colours.series[chamber / 2];
  if (std::isfinite(pressure)) canvas().AddRectFilled({tube.min.x, y_of(pressure)}, tube.max, ink(colour), t.px(4));
  const auto mark = [&](double pa, ImU32 mark_colour, float overhang) {
    canvas().AddLine({tube.min.x - overhang, y_of(pa)}, {tube.max.x + overhang, y_of(pa)}, ink(mark_colour), t.px(2));
  };
  mark(h.main_relief_Pa, t.colours.text, 0);
  mark(h.port_relief_Pa, t.colours.bad, t.px(6));
}

void pressures_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, fmt::format("CYLINDER PRESSURES, {}", ui.units.unit(Quantity::kPressure)), area,
                  measured_freshness(data.view));
  Area rest = card.inside();
  Area legend = rest.cut_bottom(t.px(20));
  const auto key = [&](ImU32 colour, std::string_view word) {
    canvas().AddLine({legend.min.x, legend.centre().y}, {legend.min.x + t.px(16), legend.centre().y}, ink(colour),
                     t.px(2));
    put_text(t.fonts.small, t.colours.muted, {legend.min.x + t.px(22), legend.centre().y}, Align::kLeft, word);
    legend.cut_left(t.px(34) + text_width(t.fonts.small, word));
  };
  key(t.colours.text, "main relief");
  key(t.colours.bad, "port relief");
  for (std::size_t j = 0; j < kJoints; ++j) {
    Area axis = rest.column(static_cast<int>(j), kJoints, t.unit());
    const Area name = axis.cut_bottom(t.px(20));
    put_text(t.fonts.small, t.colours.text, name.centre(), Align::kCentre, kJointNames[j]);
    const float spare = std::max(0.F, axis.width() - t.px(120)) / 2;
    axis = axis.inset(spare, 0);
    for (std::size_t side = 0; side < 2; ++side)
      pressure_bar(ui, data, 2 * j + side, axis.column(static_cast<int>(side), 2, t.px(2)));
  }
}

/// What the picture's colours mean, and the key that exchanges it for a camera's.
void legend(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const float y = area.centre().y;
  float x = area.min.x + t.unit(1.5F);
  const auto key = [&](ImU32 colour, std::string_view word) {
    canvas().AddCircleFilled({x + t.px(5), y}, t.px(5), colour);
    put_text(t.fonts.small, t.colours.text, {x + t.px(16), y}, Align::kLeft, word);
    x += t.px(32) + text_width(t.fonts.small, word);
  };
  const picture::PictureColours colours = t.light ? picture::light_picture_colours() : picture::dark_picture_colours();
  const auto packed = [](const picture::Rgb& c) { return ImGui::ColorConvertFloat4ToU32({c.x(), c.y(), c.z(), 1}); };
  key(packed(colours.commanded), "commanded");
  if (data.player == nullptr) key(packed(colours.hand), "hand");
  if (data.player != nullptr && data.player->beside()) key(packed(colours.beside), data.player->beside()->name);
  key(packed(colours.force), "force");
  key(t.colours.series[1], "load");
  const char* hint = data.cameras.empty()   ? "V: view"
                     : data.cameras.large() ? "V: view  X: machine"
                                            : "V: view  X: camera";
  put_text(t.fonts.small, t.colours.muted, {area.max.x - t.unit(), y}, Align::kRight, hint);
}

/// Above the tools: whose picture it is, and from where.
void picture_title(const Ui& ui, const ConsoleData& data, const UiState& state, Area tools) {
  const Theme& t = ui.theme;
  tools = tools.inset(t.unit(), t.px(2));
  const auto line = [&](std::string_view text) {
    put_fitted(t.fonts.small, t.colours.muted, tools.cut_top(t.px(17)), text);
  };
  line(data.facts.machine.name);
  line(state.side_view ? "side view" : "orbit");
  if (data.player != nullptr && data.player->played().world) line("surroundings as at the start");
}

}  // namespace

DrawnScreen operate_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  Area right = area.cut_right(t.px(300), gap);
  force_card(ui, data, state, right.cut_top(t.px(358), gap));
  payload_card(ui, data, right.cut_top(t.px(128), gap));
  limits_card(ui, data, right);
  Area bottom = area.cut_bottom(t.px(228), gap);
  scales_card(ui, data, state, bottom.cut_right(t.px(286), gap));
  pressures_card(ui, data, bottom);
  const bool large = data.cameras.large();
  const PicturePane pane = divide(t, area,
                                  {.figures = state.side_view,
                                   .pad = state.hold_to_run && has_hold_pad(data),
                                   .grade = state.measures.grade_on,
                                   .camera_aspect = data.cameras.aspect(),
                                   .camera_large = large});
  if (pane.camera) {
    const Area& small = large ? pane.machine : *pane.camera;
    canvas().AddRect({small.min.x - 1, small.min.y - 1}, {small.max.x + 1, small.max.y + 1}, t.colours.border, 0, 0,
                     t.px(2));
    data.cameras.place(ui, *pane.camera);
  }
  legend(ui, data, pane.legend);
  if (!large) picture_title(ui, data, state, pane.tools);
  draw_marks(ui, data, state, pane.machine, !large);
  draw_hold_pad(ui, data, state, pane.tools, pane.pad);
  draw_grade_panel(ui, state.measures, pane.tools);
  Area distances = pane.distances;
  draw_said(ui, state.measures, distances);
  draw_distances(ui, data, state.measures, distances);
  return pane.machine;
}

}  // namespace knuckle::console::screens
