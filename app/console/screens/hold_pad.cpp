#include "app/console/screens/hold_pad.h"

#include <array>

#include "app/console/widgets/widgets.h"

namespace knuckle::console::screens {
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
  ImDrawList& list = *ImGui::GetWindowDrawList();
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

}  // namespace knuckle::console::screens
