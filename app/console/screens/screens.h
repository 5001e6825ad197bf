// The screens: free functions from the newest view to widgets; what the person changes goes into the state.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "app/console/console_view.h"
#include "app/console/screens/console_data.h"
#include "app/console/screens/ui_state.h"
#include "app/console/widgets/plots.h"
#include "app/console/widgets/widgets.h"

namespace knuckle::console::screens {

using DrawnScreen = std::optional<Area>;  ///< Where the machine's picture goes, on a screen that has one.
DrawnScreen operate_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
DrawnScreen link_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
DrawnScreen real_time_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
DrawnScreen hydraulics_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
/// What is known of this machine beside its drawing, from where, and how surely.
DrawnScreen calibration_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
DrawnScreen events_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
DrawnScreen history_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area);

/// One on the rail; its name and its key are in keys.h.
struct ScreenOnRail {
  Screen screen;
  Icon icon;
  DrawnScreen (*draw)(const Ui&, const ConsoleData&, UiState&, Area);
};
inline constexpr auto kScreens = std::to_array<ScreenOnRail>({
    {Screen::kOperate, Icon::kArm, operate_screen},
    {Screen::kLink, Icon::kLink, link_screen},
    {Screen::kRealTime, Icon::kClock, real_time_screen},
    {Screen::kHydraulics, Icon::kDrop, hydraulics_screen},
    {Screen::kCalibration, Icon::kWrench, calibration_screen},
    {Screen::kEvents, Icon::kList, events_screen},
    {Screen::kHistory, Icon::kPlot, history_screen},
});
static_assert(kScreens.size() == static_cast<std::size_t>(Screen::kCount) &&
              std::is_sorted(kScreens.begin(), kScreens.end(),
                             [](const ScreenOnRail& a, const ScreenOnRail& b) { return a.screen < b.screen; }));

/// Scales and assists: what is in use, and what is requested where that differs.
void scales_card(const Ui& ui, const ConsoleData& data, UiState& state, const Area& area);

/// Opens the one window of ImGui's, without a frame of its own and as large as ours; ImGui::End() closes it.
void open_canvas();
/// Everything on screen for one frame, into the open canvas.
DrawnScreen draw_console(const Ui& ui, const ConsoleData& data, UiState& state);

/// A slider speaks the person's unit, the state newtons. @param look without format and width.
void force_slider(const Ui& ui, const Area& area, const char* id, float& force_N, const std::array<float, 2>& range_N,
                  SliderLook look);
/// All limits being hit.
void limits_card(const Ui& ui, const ConsoleData& data, const Area& area);
/// Why the force is not known better, in a few words, as reported by the machine's side.
[[nodiscard]] std::string confidence_text(const ConsoleView& view);

// The line on top of every screen: mode, the one reason that blocks, and how old all of it is. Nothing ever covers it.

void draw_banner(const Ui& ui, const ConsoleData& data, UiState& state, Area area);
/// What the window itself knows of its person.
struct AtWindow {
  HandSource hand = HandSource::kDevice;
  bool typing = false;          ///< Text, into a field.
  bool enable_ignored = false;  ///< Enable's key is held, but was pressed while text was typed, or before the window.
  bool pad_ignored = false;     ///< The bumper is held since before the gamepad was connected.
  bool pull_ignored = false;    ///< The mouse's button is held, but the pull has ended.
};
/// The one line that says what to do, or what happens now. @param view_age_s since the loops last put a view. @param
/// bus of the machine.
[[nodiscard]] std::string banner_reason(const ConsoleView& view, bool stop, double view_age_s,
                                        const AtWindow& person = {}, const JointLoads& loads = {},
                                        const BusDescription& bus = {});
/// By the operator's own Stop: nothing is broken.
[[nodiscard]] bool stopped(const ConsoleView& view) noexcept;
/// How a mode is called and marked.
struct ModeLook {
  const char* word;  ///< "SELF-TEST", ...
  Icon icon;
};
[[nodiscard]] const ModeLook& look_of(Mode mode) noexcept;

// The light of the recording: in the banner, so on every screen.

struct RecordingText {
  std::string light;  ///< "REC 0:12:34", "NOT RECORDED", "REC STOPPED: why"
  std::string note;   ///< Behind it: "12.3 GB free, 7 steps lost"; may be empty.
};
/// @param elapsed_s of the recording.
[[nodiscard]] RecordingText recording_text(const RecordingLight& light, double elapsed_s);

// Leading without a keyboard: buttons below the picture that enable and move one joint for as long as they are held, by
// mouse or touch; and what turns them on.

/// The person leads by this window.
[[nodiscard]] bool has_hold_pad(const ConsoleData& data);
/// Its switch among the tools, and its buttons. @param buttons empty: none.
void draw_hold_pad(const Ui& ui, const ConsoleData& data, UiState& state, const Area& tools, const Area& buttons);

// Force and oil pressures over time, for the screens that show them.

/// @param mark_N a line across it; unknown: none.
void force_plot(const Ui& ui, const ConsoleData& data, const Area& area, double mark_N = History::kUnknown);
/// Both sides of one cylinder.
void pressure_plot(const Ui& ui, const ConsoleData& data, std::size_t joint, const Area& area);
/// Of head and rod side.
[[nodiscard]] std::array<ImU32, 2> side_colours(const Theme& theme);

/// At which the oil of a cylinder escapes.
[[nodiscard]] double lower_relief_Pa(const HydraulicsDescription& hydraulics) noexcept;

// Below every screen while a recording is played: its time line, and where on it the player is.

/// Buttons, speed, time; events as marks, modes as a band, gaps hatched; scrubbed with the mouse.
void draw_timeline(const Ui& ui, const ConsoleData& data, Area area);
/// What stands beside the screens instead of hand, session and Stop: what is played, and what is beside it.
void draw_player_column(const Ui& ui, const ConsoleData& data, Area area);

[[nodiscard]] ImU32 severity_colour(const Theme& theme, Severity severity) noexcept;
/// Small for information, a triangle for a warning, a square for an alarm: the shape says as much as the colour.
void event_mark(const Theme& theme, Severity severity, float x, const Area& lane);

// Of the banner.
/// That this is no live machine. As wide as it is high times so much.
void draw_replay_block(const Ui& ui, const Area& area);
/// What stopped or limited the machine then.
[[nodiscard]] std::string replay_reason(const ConsoleView& view, const PlayerPanel& player, const BusDescription& bus);

}  // namespace knuckle::console::screens
