#include <array>
#include <cmath>

#include "app/console/machine_text.h"
#include "app/console/picture/picture_colours.h"
#include "app/console/screens/distances.h"
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
void direction_dial(const widgets::Ui& ui, const widgets::Area& area, const SlaveMessage& m, bool known) {
  const widgets::Theme& t = ui.theme;
  const ImVec2 c = area.centre();
  const float r = std::min(area.width(), area.height()) / 2 - t.px(2);
  widgets::canvas().AddCircle(c, r, widgets::ink(t.colours.border), 48, t.px(1.5F));
  for (int i = 0; i < 8; ++i) {
    const float a = static_cast<float>(i) * 0.7853982F, inner = r - t.px(i % 2 == 0 ? 7.F : 4.F);
    widgets::canvas().AddLine({c.x + inner * std::cos(a), c.y + inner * std::sin(a)},
                              {c.x + r * std::cos(a), c.y + r * std::sin(a)}, widgets::ink(t.colours.border),
                              t.px(1.5F));
  }
  if (!known) return widgets::put_text(t.fonts.mono, t.colours.muted, c, widgets::Align::kCentre, "-");
  const PlanarVector u = m.tip_force_N.normalized();
  const ImVec2 d{static_cast<float>(u.x()), static_cast<float>(-u.y())}, n{-d.y, d.x};
  const auto at = [&](float along, float across) {
    return ImVec2{c.x + d.x * along * r + n.x * across * r, c.y + d.y * along * r + n.y * across * r};
  };
  const ImU32 colour = widgets::ink(t.colours.force);
  widgets::canvas().AddLine(at(-0.7F, 0), at(0.4F, 0), colour, t.px(4));
  widgets::canvas().AddTriangleFilled(at(0.78F, 0), at(0.3F, -0.28F), at(0.3F, 0.28F), colour);
}

/// What the card says of the force's size.
struct Size {
  widgets::Shown number;  ///< "1460", "< 755" where it is smaller than its own doubt, "> 8200" where it is the least.
  double least_N = 0;     ///< That the gauge is filled to.
  bool open = false;      ///< It may be any more.
  bool directed = false;
};
Size size_of(const widgets::Units& units, const ForceText& said, const BlindPress& press, double force_N,
             double sigma_N) {
  constexpr widgets::Quantity q = widgets::Quantity::kForce;
  if (!said.known && !press.words.empty())
    return {widgets::shown("> %s", units.number(q, 100 * std::floor(press.least_N / 100)).c_str()), press.least_N,
            true};
  if (!said.known) return {widgets::shown("-")};
  if (force_N < sigma_N) return {widgets::shown("< %s", units.number(q, force_N + sigma_N).c_str()), force_N};
  return {units.number(q, force_N), force_N, false, true};
}

/// The force against what the person says is too much here.
void force_gauge(const widgets::Ui& ui, UiState& state, widgets::Area& rest, const Size& size) {
  const widgets::Theme& t = ui.theme;
  const auto most_N = static_cast<double>(state.force_most_N);
  const double share = size.least_N / most_N;
  const ImU32 colour = share > 1 ? t.colours.bad : share > kNearMost ? t.colours.notice : t.colours.accent;
  const widgets::Area line = rest.cut_top(t.px(14), t.px(4));
  widgets::bar(ui, line, 0, static_cast<float>(share),
               size.open ? widgets::mix(colour, t.colours.raised, 0.5F) : colour);
  if (size.open) widgets::hatch(ui, line, colour, 3);
  widgets::canvas().AddRect(line.min, line.max, widgets::ink(share > 1 ? t.colours.bad : t.colours.border), t.px(3), 0,
                            t.px(share > 1 ? 2.F : 1.F));
  widgets::Area row = rest.cut_top(t.px(24), t.unit(0.5F));
  const char* word = share > 1 ? "Too much" : "Maximum";
  widgets::put_text(share > 1 ? t.fonts.body_bold : t.fonts.small, share > 1 ? t.colours.bad : t.colours.muted,
                    {row.min.x, row.centre().y}, widgets::Align::kLeft, word);
  row.cut_left(t.px(74));
  // The slider speaks the person's unit, the state newtons.
  const auto per_N = static_cast<float>(ui.units.convert(widgets::Quantity::kForce, 1));
  float shown = state.force_most_N * per_N;
  const widgets::Shown format = widgets::shown("%%.0f %s", ui.units.unit(widgets::Quantity::kForce));
  if (widgets::slider(ui, row, "##most", shown, kLeastMost_N * per_N, kMostMost_N * per_N,
                      {.format = format.c_str(), .value_width = t.px(84), .logarithmic = true}))
    state.force_most_N = shown / per_N;
}

/// One of the force's parts: from where it comes, in a word.
void from_row(const widgets::Ui& ui, const widgets::Area& row, const Size& size, double part_N,
              std::array<const char*, 3> words) {
  const widgets::Quantity q = widgets::Quantity::kForce;
  const char* word = !size.directed ? words[2] : part_N > 0 ? words[0] : words[1];
  const widgets::Shown number = size.directed ? ui.units.number(q, std::abs(part_N)) : widgets::shown("-");
  widgets::value_row(ui, row, word, number.c_str(), ui.units.unit(q));
}

/// How sure it is, and why no surer.
void confidence_rows(const widgets::Ui& ui, const ConsoleView& view, const BlindPress& press, widgets::Area& rest) {
  const widgets::Theme& t = ui.theme;
  const double sure = view.machine.confidence;
  const auto confidence = static_cast<float>(sure);
  const char* word = confidence > 0.75F ? "good" : confidence > 0.4F ? "fair" : "poor";
  const ImU32 colour = confidence > 0.75F ? t.colours.good : confidence > 0.4F ? t.colours.notice : t.colours.bad;
  widgets::value_row(ui, rest.cut_top(t.px(22)), "Confidence", widgets::fixed(sure * 100, 0).c_str(), "%");
  widgets::bar(ui, rest.cut_top(t.px(10), t.unit(0.75F)), 0, confidence, colour);
  const std::string words = !press.words.empty() ? press.words
                            : std::isnan(sure)   ? "not recorded"
                                                 : std::string(word) + ": " + confidence_text(view);
  widgets::put_lines(t.fonts.small, press.words.empty() ? t.colours.muted : t.colours.notice, rest,
                     ui.units.as_shown(words).c_str());
}

void force_card(const widgets::Ui& ui, const ConsoleData& data, UiState& state, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const SlaveMessage& m = data.view.machine;
  const widgets::Card card(ui, "FORCE ON THE BUCKET TIP", area, measured_freshness(data.view));
  widgets::Area rest = card.inside();
  const ForceText said = force_text(data.view);
  const BlindPress press = blind_press(data.view, data.loads);
  const double force_N = m.tip_force_N.norm(), sigma_N = sigma_along(m);
  const Size size = size_of(ui.units, said, press, force_N, sigma_N);
  widgets::Area top = rest.cut_top(t.px(80), t.unit());
  direction_dial(ui, top.cut_right(t.px(80), t.unit()), m, size.directed && force_N > 2 * sigma_N && force_N > 1);
  const widgets::Quantity q = widgets::Quantity::kForce;
  widgets::value_large(ui, top, size.open ? "At least" : "Estimated", size.number.c_str(), ui.units.unit(q));
  if (size.directed)
    widgets::put_text(t.fonts.mono_small, t.colours.muted, {top.min.x, top.max.y - t.px(10)}, widgets::Align::kLeft,
                      widgets::shown("\xC2\xB1 %s", ui.units.text(q, sigma_N).c_str()).c_str());
  force_gauge(ui, state, rest, size);
  widgets::lamp(ui, rest.cut_top(t.px(22), t.unit(0.5F)), size.open ? "Pressing" : said.contact_word,
                said.contact || size.open, t.colours.force);
  from_row(ui, rest.cut_top(t.px(22)), size, m.tip_force_N.x(), {"From behind", "From the front", "Front or behind"});
  from_row(ui, rest.cut_top(t.px(22)), size, m.tip_force_N.y(), {"From below", "From above", "Below or above"});
  const bool wall = !said.known && feels_end_of_range(data.view, data.facts.machine);
  widgets::value_row(ui, rest.cut_top(t.px(22), t.unit(0.5F)), wall ? "Felt: end of the range" : "Felt in the hand",
                     ui.units.number(widgets::Quantity::kHandForce, data.view.hand.sent_force_N.norm()).c_str(),
                     ui.units.unit(widgets::Quantity::kHandForce));
  confidence_rows(ui, data.view, press, rest);
}

void payload_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const SlaveMessage& m = data.view.machine;
  const widgets::Card card(ui, "PAYLOAD", area, measured_freshness(data.view));
  widgets::Area rest = card.inside();
  const widgets::Quantity q = widgets::Quantity::kMass;
  const widgets::Area line = rest.cut_top(t.px(40), t.unit(0.5F));
  const double full_kg = data.facts.machine.payload_full_scale_kg;
  const bool known = payload_is_known(m, full_kg);
  const widgets::Shown number = known ? ui.units.number(q, m.payload_kg) : widgets::shown("-");
  widgets::put_text(t.fonts.mono_display, known ? t.colours.text : t.colours.muted, {line.min.x, line.centre().y},
                    widgets::Align::kLeft, number.c_str());
  const float x = line.min.x + widgets::text_width(t.fonts.mono_display, number.c_str()) + t.unit();
  widgets::put_text(t.fonts.body, t.colours.muted, {x, line.centre().y + t.px(4)}, widgets::Align::kLeft,
                    known ? ui.units.unit(q) : "not known");
  if (known)
    widgets::put_text(t.fonts.mono_small, t.colours.muted, {line.max.x, line.centre().y + t.px(4)},
                      widgets::Align::kRight,
                      widgets::shown("\xC2\xB1 %s", ui.units.text(q, m.payload_sigma_kg).c_str()).c_str());
  const widgets::Area share = rest.cut_top(t.px(10), t.unit(0.75F));
  if (known) widgets::bar(ui, share, 0, static_cast<float>(m.payload_kg / std::max(full_kg, 1.0)), t.colours.accent);
  const int loads = data.payload.loads();
  const widgets::Shown carried = widgets::shown("Carried, %d load%s", loads, loads == 1 ? "" : "s");
  widgets::value_row(ui, rest.cut_top(t.px(24)), data.view.sensors_alone ? "Carried" : carried.c_str(),
                     data.view.sensors_alone ? "-" : ui.units.number(q, data.payload.total_kg()).c_str(),
                     ui.units.unit(q));
}

void limits_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "ACTIVE LIMITS", area, machine_freshness(data.view));
  if (limit_chips(ui, data, card.inside())) return;
  const ImVec2 at{card.inside().min.x, card.inside().min.y + t.px(13)};
  if (limits_not_recorded(data))
    return widgets::put_text(t.fonts.body, t.colours.muted, at, widgets::Align::kLeft, "-");
  widgets::draw_icon(widgets::canvas(), widgets::Icon::kCheck, {at.x + t.px(9), at.y}, t.px(16),
                     widgets::ink(t.colours.good));
  widgets::put_text(t.fonts.body, t.colours.muted, {at.x + t.px(26), at.y}, widgets::Align::kLeft, "none");
}

void pressure_bar(const widgets::Ui& ui, const ConsoleData& data, std::size_t chamber, widgets::Area area) {
  const widgets::Theme& t = ui.theme;
  const HydraulicsDescription& h = data.facts.machine.hydraulics;
  const double pressure = data.view.machine.pressure_Pa[chamber];
  const double full = 1.1 * std::max(h.port_relief_Pa, h.main_relief_Pa);
  const widgets::Area words = area.cut_bottom(t.px(20));
  const widgets::Area number = area.cut_bottom(t.px(20));
  widgets::put_text(t.fonts.small, t.colours.muted, words.centre(), widgets::Align::kCentre,
                    chamber % 2 == 0 ? "head" : "rod");
  widgets::put_text(t.fonts.mono_small, t.colours.text, number.centre(), widgets::Align::kCentre,
                    ui.units.number(widgets::Quantity::kPressure, pressure).c_str());
  const widgets::Area tube = area.inset((area.width() - t.px(22)) / 2, 0);
  widgets::canvas().AddRectFilled(tube.min, tube.max, widgets::ink(t.colours.raised), t.px(4));
  const auto y_of = [&](double pa) {
    return tube.max.y - tube.height() * static_cast<float>(std::clamp(pa / full, 0.0, 1.0));
  };
  const bool high = pressure > data.facts.machine.limits.chamber_pressure_Pa || at_relief(h, pressure);
  const ImU32 colour = high ? t.colours.bad : t.colours.series[chamber / 2];
  if (std::isfinite(pressure))
    widgets::canvas().AddRectFilled({tube.min.x, y_of(pressure)}, tube.max, widgets::ink(colour), t.px(4));
  const auto mark = [&](double pa, ImU32 mark_colour, float overhang) {
    widgets::canvas().AddLine({tube.min.x - overhang, y_of(pa)}, {tube.max.x + overhang, y_of(pa)},
                              widgets::ink(mark_colour), t.px(2));
  };
  mark(h.main_relief_Pa, t.colours.text, 0);
  mark(h.port_relief_Pa, t.colours.bad, t.px(6));
}

void pressures_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(
      ui, widgets::shown("CYLINDER PRESSURES, %s", ui.units.unit(widgets::Quantity::kPressure)).c_str(), area,
      measured_freshness(data.view));
  widgets::Area rest = card.inside();
  widgets::Area legend = rest.cut_bottom(t.px(20));
  const auto key = [&](ImU32 colour, const char* word) {
    widgets::canvas().AddLine({legend.min.x, legend.centre().y}, {legend.min.x + t.px(16), legend.centre().y},
                              widgets::ink(colour), t.px(2));
    widgets::put_text(t.fonts.small, t.colours.muted, {legend.min.x + t.px(22), legend.centre().y},
                      widgets::Align::kLeft, word);
    legend.cut_left(t.px(34) + widgets::text_width(t.fonts.small, word));
  };
  key(t.colours.text, "main relief");
  key(t.colours.bad, "port relief");
  for (std::size_t j = 0; j < kJoints; ++j) {
    widgets::Area axis = rest.column(static_cast<int>(j), kJoints, t.unit());
    const widgets::Area name = axis.cut_bottom(t.px(20));
    widgets::put_text(t.fonts.small, t.colours.text, name.centre(), widgets::Align::kCentre, kJointNames[j]);
    const float spare = std::max(0.F, axis.width() - t.px(120)) / 2;
    axis = axis.inset(spare, 0);
    for (std::size_t side = 0; side < 2; ++side)
      pressure_bar(ui, data, 2 * j + side, axis.column(static_cast<int>(side), 2, t.px(2)));
  }
}

/// What the picture's colours mean, and the key that exchanges it for a camera's.
void legend(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const float y = area.centre().y;
  float x = area.min.x + t.unit(1.5F);
  const auto key = [&](ImU32 colour, const char* word) {
    widgets::canvas().AddCircleFilled({x + t.px(5), y}, t.px(5), colour);
    widgets::put_text(t.fonts.small, t.colours.text, {x + t.px(16), y}, widgets::Align::kLeft, word);
    x += t.px(32) + widgets::text_width(t.fonts.small, word);
  };
  const picture::PictureColours colours = t.light ? picture::light_picture_colours() : picture::dark_picture_colours();
  const auto packed = [](const picture::Rgb& c) { return ImGui::ColorConvertFloat4ToU32({c.x(), c.y(), c.z(), 1}); };
  key(packed(colours.commanded), "commanded");
  if (data.player == nullptr) key(packed(colours.hand), "hand");
  if (data.player != nullptr && data.player->beside()) key(packed(colours.beside), data.player->beside()->name.c_str());
  key(packed(colours.force), "force");
  key(t.colours.series[1], "load");
  const char* hint = data.cameras.empty()   ? "V: view"
                     : data.cameras.large() ? "V: view  X: machine"
                                            : "V: view  X: camera";
  widgets::put_text(t.fonts.small, t.colours.muted, {area.max.x - t.unit(), y}, widgets::Align::kRight, hint);
}

/// Above the tools: whose picture it is, and from where.
void picture_title(const widgets::Ui& ui, const ConsoleData& data, const UiState& state, widgets::Area tools) {
  const widgets::Theme& t = ui.theme;
  tools = tools.inset(t.unit(), t.px(2));
  const auto line = [&](const char* words) {
    widgets::put_fitted(t.fonts.small, t.colours.muted, tools.cut_top(t.px(17)), words);
  };
  line(data.facts.machine.name.c_str());
  line(state.side_view ? "side view" : "orbit");
  if (data.player != nullptr && data.player->played().world) line("surroundings as at the start");
}

}  // namespace

DrawnScreen operate_screen(const widgets::Ui& ui, const ConsoleData& data, UiState& state, widgets::Area area) {
  const widgets::Theme& t = ui.theme;
  const float gap = t.px(10);
  widgets::Area right = area.cut_right(t.px(300), gap);
  force_card(ui, data, state, right.cut_top(t.px(358), gap));
  payload_card(ui, data, right.cut_top(t.px(128), gap));
  limits_card(ui, data, right);
  widgets::Area bottom = area.cut_bottom(t.px(228), gap);
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
    const widgets::Area& small = large ? pane.machine : *pane.camera;
    widgets::canvas().AddRect({small.min.x - 1, small.min.y - 1}, {small.max.x + 1, small.max.y + 1}, t.colours.border,
                              0, 0, t.px(2));
    data.cameras.place(ui, *pane.camera);
  }
  legend(ui, data, pane.legend);
  if (!large) picture_title(ui, data, state, pane.tools);
  draw_marks(ui, data, state, pane.machine, !large);
  draw_hold_pad(ui, data, state, pane.tools, pane.pad);
  draw_grade_panel(ui, state.measures, pane.tools);
  widgets::Area distances = pane.distances;
  draw_said(ui, state.measures, distances);
  draw_distances(ui, data, state, distances);
  return pane.machine;
}

}  // namespace knuckle::console::screens
