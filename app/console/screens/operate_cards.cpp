#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/console/machine_text.h"
#include "app/console/screens/screens.h"
#include "app/console/widgets/widgets.h"
#include "app/session/scenario.h"
#include "estimation/force_estimator.h"

namespace knuckle::console::screens {
namespace {

constexpr float kLeastPosition = kLeastPositionScale, kMostPosition = kMostPositionScale;
constexpr float kLeastRatio = 1 / kMostForceScale, kMostRatio = 1 / kLeastForceScale;  // of forces, machine to hand
constexpr float kLeastLimit_N = session::kLeastAssist_N, kMostLimit_N = 5000;          // beyond, a slider is too coarse

/// Who keeps the person from moving it.
enum class Lock : std::uint8_t { kNone, kLed, kScenario };

/// At the right end of a setting's line: what is in use while that differs from the request, else what locks it.
void remark(const Ui& ui, const Area& line, Lock lock, bool differs, std::string_view in_use) {
  const Theme& t = ui.theme;
  const float y = line.centre().y;
  const std::string text = differs                   ? fmt::format("now {}", in_use)
                           : lock == Lock::kLed      ? "locked"
                           : lock == Lock::kScenario ? "scenario"
                                                     : std::string{};
  put_text(t.fonts.small, t.colours.notice, {line.max.x, y}, Align::kRight, text);
  if (lock == Lock::kNone) return;
  const float x = line.max.x - text_width(t.fonts.small, text) - t.px(14);
  draw_icon(canvas(), Icon::kLock, {x, y}, t.px(14), ink(t.colours.notice));
}

struct Scale {
  const char *label, *id, *format;
  float low, high, in_use;
};

/// @return whether it was moved.
bool scale_rows(const Ui& ui, Area& rest, const Scale& scale, float& asked, Lock lock) {
  const Theme& t = ui.theme;
  const Area name = rest.cut_top(t.px(20), t.px(2));
  put_label(t, name, scale.label);
  constexpr float kRounding = 1e-4F;
  const bool differs = std::abs(asked - scale.in_use) > kRounding * scale.in_use;
  remark(ui, name, lock, differs, fmt::format("{:.4g}", static_cast<double>(scale.in_use)));
  return slider(ui, rest.cut_top(t.px(24), t.px(6)), scale.id, asked, scale.low, scale.high,
                {.format = scale.format,
                 .value_width = t.px(84),
                 .locked = lock != Lock::kNone,
                 .logarithmic = true,
                 .marked = differs});
}

void assist_rows(const Ui& ui, Area& rest, const AssistSettings& in_use, AssistSettings& asked, float& limit_N,
                 Lock lock) {
  const Theme& t = ui.theme;
  ImGui::BeginDisabled(lock != Lock::kNone);
  const Area head = rest.cut_top(t.px(28));
  bool on = asked.force_limit_N > 0;
  toggle(ui, {head.min, {head.min.x + t.px(150), head.max.y}}, "Force limit", on);
  remark(ui, head, lock, asked.force_limit_N != in_use.force_limit_N,
         in_use.force_limit_N > 0 ? ui.units.text(Quantity::kForce, in_use.force_limit_N) : "off");
  force_slider(ui, rest.cut_top(t.px(24), t.px(8)), "##limit", limit_N, {kLeastLimit_N, kMostLimit_N}, {.locked = !on});
  asked.force_limit_N = on ? static_cast<double>(limit_N) : 0;
  const Area stop = rest.cut_top(t.px(28));
  Area left = stop;
  if (asked.stop_on_object != in_use.stop_on_object) left.cut_right(text_width(t.fonts.small, "now off"), t.unit());
  toggle(ui, left, "Stop on buried object", asked.stop_on_object);
  remark(ui, stop, Lock::kNone, asked.stop_on_object != in_use.stop_on_object, in_use.stop_on_object ? "on" : "off");
  ImGui::EndDisabled();
}

/// "10 : 1", or that it is not known.
std::string ratio_text(double machine_per_hand) {
  return std::isfinite(machine_per_hand) ? fmt::format("{:.4g} : 1", machine_per_hand) : "-";
}

/// Nothing of what was in use can be moved, so that it needs less room; the rest has the force around the cursor.
void recorded_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const OperatorSide& used = data.view.hand;
  const Card card(ui, "FORCE, AROUND THE CURSOR", area);
  Area rest = card.inside();
  Area rows = rest.cut_bottom(t.px(66), t.unit(0.5F));
  const auto row = [&](const char* label, const std::string& text) {
    value_row(ui, rows.cut_top(t.px(22)), label, text, "");
  };
  row("Position, machine per hand", ratio_text(used.position_scale));
  row("Force, machine per hand", ratio_text(1 / used.force_scale));
  const std::string limit =
      used.assist.force_limit_N > 0 ? ui.units.text(Quantity::kForce, used.assist.force_limit_N) : "no limit";
  row("Assist", limit + (used.assist.stop_on_object ? ", stop on object" : ""));
  force_plot(ui, data, rest);
}

}  // namespace

void force_slider(const Ui& ui, const Area& area, const char* id, float& force_N, const std::array<float, 2>& range_N,
                  SliderLook look) {
  const auto per_N = static_cast<float>(ui.units.convert(Quantity::kForce, 1));
  const std::string format = fmt::format("%.0f {}", ui.units.unit(Quantity::kForce));
  look.format = format.c_str();
  look.value_width = ui.theme.px(84);
  float shown = force_N * per_N;
  if (slider(ui, area, id, shown, range_N[0] * per_N, range_N[1] * per_N, look)) force_N = shown / per_N;
}

void scales_card(const Ui& ui, const ConsoleData& data, UiState& state, const Area& area) {
  if (data.player != nullptr) return recorded_card(ui, data, area);
  const Card card(ui, "SCALES AND ASSIST", area);
  Area rest = card.inside();
  const OperatorSide& used = data.view.hand;
  const auto position = static_cast<float>(used.position_scale), ratio = static_cast<float>(1 / used.force_scale);
  const bool scenario = data.view.led_by_scenario;
  const Lock lock = scenario ? Lock::kScenario : led(data.view.machine.mode) ? Lock::kLed : Lock::kNone;
  if (!state.scales_chosen) {
    state.position_scale = position;
    state.force_scale = ratio;
  }
  // A scenario's operator has settings of his own; the person's wait until he leads again.
  float asked_position = scenario ? position : state.position_scale;
  float asked_ratio = scenario ? ratio : state.force_scale;
  const bool position_moved = scale_rows(
      ui, rest, {"Position, machine per hand", "##position", "%.1f : 1", kLeastPosition, kMostPosition, position},
      asked_position, lock);
  const bool ratio_moved = scale_rows(
      ui, rest, {"Force, machine per hand", "##force", "%.0f : 1", kLeastRatio, kMostRatio, ratio}, asked_ratio, lock);
  if (position_moved || ratio_moved) {
    state.scales_chosen = true;
    state.position_scale = asked_position;
    state.force_scale = asked_ratio;
  }
  AssistSettings assist = scenario ? used.assist : state.assist;
  float limit_N =
      scenario && assist.force_limit_N > 0 ? static_cast<float>(assist.force_limit_N) : state.assist_limit_N;
  assist_rows(ui, rest, used.assist, assist, limit_N, scenario ? Lock::kScenario : Lock::kNone);
  if (scenario) return;
  state.assist = assist;
  state.assist_limit_N = limit_N;
}

// Words for limits and for trust in the force.

namespace {

/// "boom up: end stop" and "boom up: oil at relief" in one.
std::vector<std::string> by_direction(const std::vector<std::string>& texts) {
  std::vector<std::string> joined;
  for (const std::string& word : texts) {
    const std::size_t colon = word.find(": ");
    const auto same = std::find_if(joined.begin(), joined.end(), [&](const std::string& before) {
      return colon != std::string::npos && before.starts_with(word.substr(0, colon + 2));
    });
    if (same == joined.end())
      joined.push_back(word);
    else
      *same += ", " + word.substr(colon + 2);
  }
  return joined;
}

/// Rows of chips, each of this height. @return the height that all take. @param draws false: they are measured alone.
float chip_rows(const Ui& ui, std::span<const std::string> texts, const Area& area, float row, bool draws) {
  const Theme& t = ui.theme;
  float x = area.min.x, y = area.min.y + t.px(16);
  for (const std::string& word : texts) {
    const float width = chip_width(ui, word);
    if (x > area.min.x && x + width > area.max.x) {
      x = area.min.x;
      y += row;
    }
    if (draws) chip(ui, {x, y}, Icon::kWarning, word, t.colours.notice);
    x += width + t.unit();
  }
  return y + t.px(14) - area.min.y;
}

/// Chips in rows, or, where they have no room, their text alone. @return false where nothing is limited.
bool limit_chips(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const std::vector<std::string> texts = by_direction(
      limit_texts(data.view, data.facts.machine, data.kinematics, data.loads, !measured_freshness(data.view).stale()));
  const bool wide = std::any_of(texts.begin(), texts.end(),
                                [&](const std::string& word) { return chip_width(ui, word) > area.width(); });
  for (const float row : {t.px(34), t.px(30)}) {
    if (wide || chip_rows(ui, texts, area, row, false) > area.height()) continue;
    chip_rows(ui, texts, area, row, true);
    return !texts.empty();
  }
  // Too many for chips: the words alone.
  put_lines(t.fonts.small, t.colours.notice, area, fmt::format("{}", fmt::join(texts, "; ")));
  return true;
}

}  // namespace

void limits_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "ACTIVE LIMITS", area, machine_freshness(data.view));
  if (limit_chips(ui, data, card.inside())) return;
  const ImVec2 at{card.inside().min.x, card.inside().min.y + t.px(13)};
  const bool recorded = data.player == nullptr || (!data.view.sensors_alone && data.view.link.heard);
  if (!recorded) return put_text(t.fonts.body, t.colours.muted, at, Align::kLeft, "-");
  draw_icon(canvas(), Icon::kCheck, {at.x + t.px(9), at.y}, t.px(16), ink(t.colours.good));
  put_text(t.fonts.body, t.colours.muted, {at.x + t.px(26), at.y}, Align::kLeft, "none");
}

std::string confidence_text(const ConsoleView& view) {
  if (valves_freshness(view).stale()) return "the machine reports no cause";
  const std::string text = estimation::doubt_text(view.status.force_doubts);
  return text.empty() ? "no known disturbance" : text;
}

namespace {

struct Pad {
  const char* label;
  bool HeldKeys::*held;
};
constexpr std::array<Pad, 6> kPads{{{"boom up", &HeldKeys::boom_up},
                                    {"boom down", &HeldKeys::boom_down},
                                    {"arm out", &HeldKeys::arm_out},
                                    {"arm in", &HeldKeys::arm_in},
                                    {"bucket out", &HeldKeys::bucket_out},
                                    {"bucket in", &HeldKeys::bucket_in}}};

/// @return whether the pointer holds it.
bool hold_button(const Ui& ui, const Area& area, const char* label) {
  const Theme& t = ui.theme;
  ImDrawList& list = canvas();
  pointer_area(label, area);
  // The pointer alone: a key that presses a button must not lead a machine.
  const bool held = ImGui::IsItemActive() && ImGui::IsItemHovered() && ImGui::IsMouseDown(ImGuiMouseButton_Left);
  const ImU32 fill = held ? t.mode_colour(Mode::kEngaged) : t.colours.raised;
  list.AddRectFilled(area.min, area.max, fill, t.px(6));
  list.AddRect(area.min, area.max, t.colours.border, t.px(6), 0, t.px(1.5F));
  put_text(t.fonts.body, held ? text_on(fill) : t.colours.text, area.centre(), Align::kCentre, label);
  return held;
}

}  // namespace

bool has_hold_pad(const ConsoleData& data) {
  return data.player == nullptr && data.facts.hand != HandSource::kDevice && !data.view.led_by_scenario;
}

void draw_hold_pad(const Ui& ui, const ConsoleData& data, UiState& state, const Area& tools, const Area& buttons) {
  if (!has_hold_pad(data)) return;
  const Theme& t = ui.theme;
  Area rest = tools.inset(t.unit(1.5F), t.unit());
  rest.cut_top(t.px(26));
  toggle(ui, rest.cut_top(t.px(26)).cut_right(t.px(186)), "Hold to run (M)", state.hold_to_run);
  for (std::size_t i = 0; i < kPads.size() && buttons.width() > 0; ++i) {
    const Pad& pad = kPads[i];
    const Area place = buttons.column(static_cast<int>(i), static_cast<int>(kPads.size()), t.unit());
    if (hold_button(ui, place, pad.label)) state.pad.*pad.held = state.pad.enable = true;
  }
}

void force_plot(const Ui& ui, const ConsoleData& data, const Area& area, double mark_N) {
  const auto force_N = [](const History::Sample& s) { return known_force_N(s.machine); };
  PlotCursor& cursor = data.plots.cursor();
  double most_N = std::isfinite(mark_N) ? mark_N : 1;
  for (const History* history : {&data.plots.history(), cursor.beside})
    for (std::size_t i = 0; history != nullptr && i < history->size(); ++i)
      most_N = std::fmax(most_N, force_N(history->ago(i)));
  // Round in the unit that is read.
  const double per_N = ui.units.convert(Quantity::kForce, 1);
  const double top_N = round_above(most_N * per_N) / per_N;
  const std::array lines{Line{"force", ui.theme.colours.force, force_N}};
  history_plot(ui, area, data.plots.history(), lines, {0, top_N, "0", ui.units.text(Quantity::kForce, top_N), mark_N},
               cursor);
}

std::array<ImU32, 2> side_colours(const Theme& theme) {
  return {theme.colours.series[0], theme.colours.series[1]};
}

double lower_relief_Pa(const HydraulicsDescription& hydraulics) noexcept {
  return std::min(hydraulics.main_relief_Pa, hydraulics.port_relief_Pa);
}

void pressure_plot(const Ui& ui, const ConsoleData& data, std::size_t joint, const Area& area) {
  const std::array<ImU32, 2> colours = side_colours(ui.theme);
  const HydraulicsDescription& h = data.facts.machine.hydraulics;
  const auto side = [joint](std::size_t i) {
    return [i, joint](const History::Sample& s) { return s.machine.pressure_Pa[2 * joint + i]; };
  };
  const std::array lines{Line{"head", colours[0], side(0)}, Line{"rod", colours[1], side(1)}};
  const double top_Pa = 1.1 * std::max(h.port_relief_Pa, h.main_relief_Pa);
  history_plot(ui, area, data.plots.history(), lines,
               {0, top_Pa, "0", ui.units.text(Quantity::kPressure, top_Pa), lower_relief_Pa(h)}, data.plots.cursor());
}

}  // namespace knuckle::console::screens
