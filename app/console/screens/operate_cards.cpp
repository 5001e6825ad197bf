#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
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
void remark(const widgets::Ui& ui, const widgets::Area& line, Lock lock, bool differs, const char* in_use) {
  const widgets::Theme& t = ui.theme;
  const float y = line.centre().y;
  const widgets::Shown words = differs                   ? widgets::shown("now %s", in_use)
                               : lock == Lock::kLed      ? widgets::shown("locked")
                               : lock == Lock::kScenario ? widgets::shown("scenario")
                                                         : widgets::Shown{};
  widgets::put_text(t.fonts.small, t.colours.notice, {line.max.x, y}, widgets::Align::kRight, words.c_str());
  if (lock == Lock::kNone) return;
  const float x = line.max.x - widgets::text_width(t.fonts.small, words.c_str()) - t.px(14);
  widgets::draw_icon(widgets::canvas(), widgets::Icon::kLock, {x, y}, t.px(14), widgets::ink(t.colours.notice));
}

struct Scale {
  const char *label, *id, *format;
  float low, high, in_use;
};

/// @return whether it was moved.
bool scale_rows(const widgets::Ui& ui, widgets::Area& rest, const Scale& scale, float& asked, Lock lock) {
  const widgets::Theme& t = ui.theme;
  const widgets::Area name = rest.cut_top(t.px(20), t.px(2));
  widgets::put_label(t, name, scale.label);
  constexpr float kRounding = 1e-4F;
  const bool differs = std::abs(asked - scale.in_use) > kRounding * scale.in_use;
  remark(ui, name, lock, differs, widgets::shown("%.4g", static_cast<double>(scale.in_use)).c_str());
  return widgets::slider(ui, rest.cut_top(t.px(24), t.px(6)), scale.id, asked, scale.low, scale.high,
                         {.format = scale.format,
                          .value_width = t.px(84),
                          .locked = lock != Lock::kNone,
                          .logarithmic = true,
                          .marked = differs});
}

void assist_rows(const widgets::Ui& ui, widgets::Area& rest, const AssistSettings& in_use, AssistSettings& asked,
                 float& limit_N, Lock lock) {
  const widgets::Theme& t = ui.theme;
  ImGui::BeginDisabled(lock != Lock::kNone);
  const widgets::Area head = rest.cut_top(t.px(28));
  bool on = asked.force_limit_N > 0;
  widgets::toggle(ui, {head.min, {head.min.x + t.px(150), head.max.y}}, "Force limit", on);
  remark(ui, head, lock, asked.force_limit_N != in_use.force_limit_N,
         in_use.force_limit_N > 0 ? ui.units.text(widgets::Quantity::kForce, in_use.force_limit_N).c_str() : "off");
  // The slider speaks the person's unit, the state newtons.
  const auto per_N = static_cast<float>(ui.units.convert(widgets::Quantity::kForce, 1));
  float limit_shown = limit_N * per_N;
  const widgets::Shown format = widgets::shown("%%.0f %s", ui.units.unit(widgets::Quantity::kForce));
  if (widgets::slider(ui, rest.cut_top(t.px(24), t.px(8)), "##limit", limit_shown, kLeastLimit_N * per_N,
                      kMostLimit_N * per_N, {.format = format.c_str(), .value_width = t.px(84), .locked = !on}))
    limit_N = limit_shown / per_N;
  asked.force_limit_N = on ? static_cast<double>(limit_N) : 0;
  const widgets::Area stop = rest.cut_top(t.px(28));
  widgets::Area words = stop;
  if (asked.stop_on_object != in_use.stop_on_object)
    words.cut_right(widgets::text_width(t.fonts.small, "now off"), t.unit());
  widgets::toggle(ui, words, "Stop on buried object", asked.stop_on_object);
  remark(ui, stop, Lock::kNone, asked.stop_on_object != in_use.stop_on_object, in_use.stop_on_object ? "on" : "off");
  ImGui::EndDisabled();
}

/// "10 : 1", or that it is not known.
std::string ratio_text(double machine_per_hand) {
  return std::isfinite(machine_per_hand) ? std::string(widgets::shown("%.4g : 1", machine_per_hand).c_str()) : "-";
}

/// Nothing of what was in use can be moved, so that it needs less room; the rest has the force around the cursor.
void recorded_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const OperatorSide& used = data.view.hand;
  const widgets::Card card(ui, "FORCE, AROUND THE CURSOR", area);
  widgets::Area rest = card.inside();
  widgets::Area rows = rest.cut_bottom(t.px(66), t.unit(0.5F));
  const auto row = [&](const char* label, const std::string& words) {
    widgets::value_row(ui, rows.cut_top(t.px(22)), label, words.c_str(), "");
  };
  row("Position, machine per hand", ratio_text(used.position_scale));
  row("Force, machine per hand", ratio_text(1 / used.force_scale));
  const std::string limit = used.assist.force_limit_N > 0
                                ? ui.units.text(widgets::Quantity::kForce, used.assist.force_limit_N).c_str()
                                : "no limit";
  row("Assist", limit + (used.assist.stop_on_object ? ", stop on object" : ""));
  force_plot(ui, data, rest);
}

}  // namespace

void scales_card(const widgets::Ui& ui, const ConsoleData& data, UiState& state, const widgets::Area& area) {
  if (data.player != nullptr) return recorded_card(ui, data, area);
  const widgets::Card card(ui, "SCALES AND ASSIST", area);
  widgets::Area rest = card.inside();
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
std::vector<std::string> by_direction(const std::vector<std::string>& words) {
  std::vector<std::string> joined;
  for (const std::string& word : words) {
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
float chip_rows(const widgets::Ui& ui, std::span<const std::string> words, const widgets::Area& area, float row,
                bool draws) {
  const widgets::Theme& t = ui.theme;
  float x = area.min.x, y = area.min.y + t.px(16);
  for (const std::string& word : words) {
    const float width = widgets::chip_width(ui, word.c_str());
    if (x > area.min.x && x + width > area.max.x) {
      x = area.min.x;
      y += row;
    }
    if (draws) widgets::chip(ui, {x, y}, widgets::Icon::kWarning, word.c_str(), t.colours.notice);
    x += width + t.unit();
  }
  return y + t.px(14) - area.min.y;
}

}  // namespace

bool limit_chips(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const std::vector<std::string> words = by_direction(
      limit_texts(data.view, data.facts.machine, data.kinematics, data.loads, !measured_freshness(data.view).stale()));
  const bool wide = std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return widgets::chip_width(ui, word.c_str()) > area.width();
  });
  for (const float row : {t.px(34), t.px(30)}) {
    if (wide || chip_rows(ui, words, area, row, false) > area.height()) continue;
    chip_rows(ui, words, area, row, true);
    return !words.empty();
  }
  // Too many for chips: the words alone.
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : "; ") + word;
  widgets::put_lines(t.fonts.small, t.colours.notice, area, all.c_str());
  return true;
}

std::string confidence_text(const ConsoleView& view) {
  if (valves_freshness(view).stale()) return "the machine reports no cause";
  const std::string words = estimation::doubt_text(view.status.force_doubts);
  return words.empty() ? "no known disturbance" : words;
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
bool hold_button(const widgets::Ui& ui, const widgets::Area& area, const char* label) {
  const widgets::Theme& t = ui.theme;
  ImDrawList& list = widgets::canvas();
  widgets::pointer_area(label, area);
  // The pointer alone: a key that presses a button must not lead a machine.
  const bool held = ImGui::IsItemActive() && ImGui::IsItemHovered() && ImGui::IsMouseDown(ImGuiMouseButton_Left);
  const ImU32 fill = held ? t.mode_colour(Mode::kEngaged) : t.colours.raised;
  list.AddRectFilled(area.min, area.max, fill, t.px(6));
  list.AddRect(area.min, area.max, t.colours.border, t.px(6), 0, t.px(1.5F));
  widgets::put_text(t.fonts.body, held ? widgets::text_on(fill) : t.colours.text, area.centre(),
                    widgets::Align::kCentre, label);
  return held;
}

}  // namespace

bool has_hold_pad(const ConsoleData& data) {
  return data.player == nullptr && data.facts.hand != HandSource::kDevice && !data.view.led_by_scenario;
}

void draw_hold_pad(const widgets::Ui& ui, const ConsoleData& data, UiState& state, const widgets::Area& tools,
                   const widgets::Area& buttons) {
  if (!has_hold_pad(data)) return;
  const widgets::Theme& t = ui.theme;
  widgets::Area rest = tools.inset(t.unit(1.5F), t.unit());
  rest.cut_top(t.px(26));
  widgets::toggle(ui, rest.cut_top(t.px(26)).cut_right(t.px(186)), "Hold to run (M)", state.hold_to_run);
  for (std::size_t i = 0; i < kPads.size() && buttons.width() > 0; ++i) {
    const Pad& pad = kPads[i];
    const widgets::Area place = buttons.column(static_cast<int>(i), static_cast<int>(kPads.size()), t.unit());
    if (hold_button(ui, place, pad.label)) state.pad.*pad.held = state.pad.enable = true;
  }
}

namespace {

/// The next of 1, 2, 5, 10, ...
double round_above(double value) {
  const double decade = std::pow(10, std::floor(std::log10(value)));
  for (const double times : {1.0, 2.0, 5.0})
    if (times * decade >= value) return times * decade;
  return 10 * decade;
}

}  // namespace

void force_plot(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area, double mark_N) {
  const auto force_N = [](const widgets::History::Sample& s) { return widgets::known_force_N(s.machine); };
  widgets::PlotCursor& cursor = data.plots.cursor();
  double most_N = std::isfinite(mark_N) ? mark_N : 1;
  for (const widgets::History* history : {&data.plots.history(), cursor.beside})
    for (std::size_t i = 0; history != nullptr && i < history->size(); ++i)
      most_N = std::fmax(most_N, force_N(history->ago(i)));
  // Round in the unit that is read.
  const double per_N = ui.units.convert(widgets::Quantity::kForce, 1);
  const double top_N = round_above(most_N * per_N) / per_N;
  const std::array lines{widgets::Line{"force", ui.theme.colours.force, force_N}};
  widgets::history_plot(ui, area, data.plots.history(), lines,
                        {0, top_N, "0", ui.units.text(widgets::Quantity::kForce, top_N).c_str(), mark_N}, cursor);
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
    return [i, joint](const widgets::History::Sample& s) { return s.machine.pressure_Pa[2 * joint + i]; };
  };
  const std::array lines{widgets::Line{"head", colours[0], side(0)}, widgets::Line{"rod", colours[1], side(1)}};
  const double top_Pa = 1.1 * std::max(h.port_relief_Pa, h.main_relief_Pa);
  widgets::history_plot(
      ui, area, data.plots.history(), lines,
      {0, top_Pa, "0", ui.units.text(widgets::Quantity::kPressure, top_Pa).c_str(), lower_relief_Pa(h)},
      data.plots.cursor());
}

}  // namespace knuckle::console::screens
