// The line on top of every screen: mode, the one reason that blocks, and how old all of it is. Nothing ever covers it.
#pragma once

#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"

namespace knuckle::console::screens {

void draw_banner(const widgets::Ui& ui, const ConsoleData& data, UiState& state, widgets::Area area);
/// What the window itself knows of its person.
struct AtWindow {
  HandSource hand = HandSource::kDevice;
  bool typing = false;          ///< Text, into a field.
  bool enable_ignored = false;  ///< Enable's key is held, but was pressed while text was typed, or before the window.
  bool pad_ignored = false;     ///< The bumper is held since before the gamepad was connected.
  bool pull_ignored = false;    ///< The mouse's button is held, but the pull has ended.
};
/// The one line that says what to do, or what happens now. @param view_age_s since the loops last put a view.
[[nodiscard]] std::string banner_reason(const ConsoleView& view, bool stop, double view_age_s,
                                        const AtWindow& person = {}, const JointLoads& loads = {});
/// By the operator's own Stop: nothing is broken.
[[nodiscard]] bool stopped(const ConsoleView& view) noexcept;
/// "SELF-TEST", ...
[[nodiscard]] const char* mode_word(Mode mode) noexcept;
[[nodiscard]] widgets::Icon mode_icon(Mode mode) noexcept;

}  // namespace knuckle::console::screens
