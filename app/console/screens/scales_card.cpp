#include <array>
#include <cmath>

#include "app/console/screens/force_plots.h"
#include "app/console/screens/screens.h"
#include "app/session/scenario.h"

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
  widgets::draw_icon(*ImGui::GetWindowDrawList(), widgets::Icon::kLock, {x, y}, t.px(14),
                     widgets::ink(t.colours.notice));
}

struct Scale {
  const char *label, *id, *format;
  float low, high, in_use;
};

/// @return whether it was moved.
bool scale_rows(const widgets::Ui& ui, widgets::Area& rest, const Scale& scale, float& asked, Lock lock) {
  const widgets::Theme& t = ui.theme;
  const widgets::Area name = rest.cut_top(t.px(20), t.px(2));
  widgets::put_text(t.fonts.small, t.colours.muted, {name.min.x, name.centre().y}, widgets::Align::kLeft, scale.label);
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
std::string ratio_words(double machine_per_hand) {
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
  row("Position, machine per hand", ratio_words(used.position_scale));
  row("Force, machine per hand", ratio_words(1 / used.force_scale));
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

}  // namespace knuckle::console::screens
