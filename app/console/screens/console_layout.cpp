// Where everything goes: banner on top, rail on the left, hand, session and Stop on the right, the screen between.

#include "app/console/screens/banner.h"
#include "app/console/screens/chrome.h"
#include "app/console/screens/screens.h"
#include "app/console/screens/timeline_bar.h"

namespace knuckle::console::screens {

void open_canvas() {
  ImGui::SetNextWindowPos({0, 0});
  ImGui::SetNextWindowSize(ImGui::GetIO().DisplaySize);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
  ImGui::Begin("console", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoBackground |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoScrollWithMouse |
                   ImGuiWindowFlags_NoBringToFrontOnFocus);
  ImGui::PopStyleVar(2);
}

std::optional<widgets::Area> draw_console(const widgets::Ui& ui, const ConsoleData& data, UiState& state) {
  const widgets::Theme& t = ui.theme;
  const float gap = t.px(10);
  widgets::Area rest = widgets::Area{{0, 0}, ImGui::GetIO().DisplaySize}.inset(gap);
  draw_banner(ui, data, state, rest.cut_top(t.px(72), gap));
  if (data.player != nullptr) draw_timeline(ui, data, rest.cut_bottom(t.px(66), gap));
  draw_rail(ui, data, state, rest.cut_left(t.px(92), gap));
  const widgets::Area column = rest.cut_right(t.px(236), gap);
  if (data.player != nullptr)
    draw_player_column(ui, data, column);
  else
    draw_side_column(ui, data, state, column);
  std::optional<widgets::Area> picture;
  if (state.help) {
    draw_help(ui, data.player != nullptr, rest);
  } else {
    switch (state.screen) {
      case Screen::kOperate:
      case Screen::kCount:
        picture = operate_screen(ui, data, state, rest);
        break;
      case Screen::kLink:
        link_screen(ui, data, rest);
        break;
      case Screen::kRealTime:
        real_time_screen(ui, data, rest);
        break;
      case Screen::kHydraulics:
        hydraulics_screen(ui, data, rest);
        break;
      case Screen::kCalibration:
        calibration_screen(ui, data, rest);
        break;
      case Screen::kEvents:
        events_screen(ui, data, state, rest);
        break;
      case Screen::kHistory:
        history_screen(ui, data, state, rest);
        break;
    }
  }
  return picture;
}

}  // namespace knuckle::console::screens
