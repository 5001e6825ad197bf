#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "app/console/keys.h"
#include "app/console/screens/screens.h"

namespace knuckle::console::screens {
namespace {

/// What the help shows beside the keys of the console itself.
constexpr std::array<std::pair<const char*, const char*>, 4> kPointing{
    {{"Arrows", "to a neighbour, in a list too"},
     {"Enter", "press the framed one; slider, field: begin, end"},
     {"Mouse", "side view: drag the bucket's tip"},
     {"Mouse", "wheel zooms, right drag pans; orbit: drag turns"}}};
constexpr std::array<std::pair<const char*, const char*>, 4> kPlayerPointing{
    {{"Arrows", "to a neighbour, in a list too"},
     {"Enter", "press the framed one; field: begin, end"},
     {"Mouse", "time line, plots, events: go to that time"},
     {"Mouse", "wheel zooms, right drag pans; orbit: drag turns"}}};

void rail_entry(const Ui& ui, const ScreenOnRail& entry, std::size_t open, UiState& state, const Area& area) {
  const Theme& t = ui.theme;
  const Palette& c = t.colours;
  const bool chosen = state.screen == entry.screen;
  const KeyBinding& key = key_of(entry.screen);
  ImGui::SetCursorScreenPos(area.min);
  if (ImGui::InvisibleButton(key.what, area.size())) state.screen = entry.screen;
  if (chosen || ImGui::IsItemHovered())
    canvas().AddRectFilled(area.min, area.max, mix(c.background, chosen ? c.accent : c.raised, chosen ? 0.28F : 0.8F),
                           t.px(8));
  focus_ring(ui, area, t.px(8));
  const ImU32 colour = chosen ? c.text : c.muted;
  const float x = area.centre().x, middle = area.centre().y;
  draw_icon(canvas(), entry.icon, {x, middle - t.px(13)}, t.px(28), ink(chosen ? c.accent : c.muted));
  put_text(t.fonts.small, colour, {x, middle + t.px(18)}, Align::kCentre, key.what);
  put_text(t.fonts.small, c.muted, {area.max.x - t.px(6), area.min.y + t.px(12)}, Align::kRight, key.keys);
  if (open == 0) return;
  const std::string count = open > 99 ? "99+" : fmt::format("{}", open);
  const ImVec2 at{area.min.x + t.px(18), area.min.y + t.px(14)};
  canvas().AddRectFilled({at.x - t.px(14), at.y - t.px(9)}, {at.x + t.px(14), at.y + t.px(9)}, c.stop, t.px(9));
  put_text(t.fonts.mono_small, c.stop_text, at, Align::kCentre, count);
}

void hand_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const OperatorSide& hand = data.view.hand;
  const Card card(ui, "HAND", area);
  Area rest = card.inside();
  const Area head = rest.cut_top(t.px(24), t.unit(0.5F));
  const HandSource source = data.facts.hand;
  const Icon icon = data.view.led_by_scenario         ? Icon::kPlay
                    : source == HandSource::kKeyboard ? Icon::kKeyboard
                    : source == HandSource::kGamepad  ? Icon::kGamepad
                                                      : Icon::kHand;
  draw_icon(canvas(), icon, {head.min.x + t.px(11), head.centre().y}, t.px(22), ink(t.colours.text));
  const char* word = source == HandSource::kKeyboard  ? "Keyboard"
                     : source == HandSource::kGamepad ? "Gamepad"
                                                      : "Haptic device";
  Area name = head;
  name.cut_left(t.px(32));
  put_fitted(t.fonts.body, t.colours.text, name, data.view.led_by_scenario ? "Scenario" : word);
  if (hand.device) {
    put_lines(t.fonts.small, t.colours.bad, rest, ui.units.as_shown(text(hand.device)));
    return;
  }
  const char* present = source == HandSource::kDevice || data.view.led_by_scenario ? "Hand on the device" : "In use";
  const std::array<std::pair<const char*, bool>, 3> lamps{
      {{present, hand.presence}, {"Enable", hand.enable}, {"Clutch", hand.clutch}}};
  for (const auto& [label, on] : lamps)
    lamp(ui, rest.cut_top(t.px(24), t.px(2)), label, on,
         on && hand.clutch && label == lamps[2].first ? t.colours.notice : t.colours.good);
}

bool small_slider(const Ui& ui, Area& rest, const char* label, float& value, float high, const char* format) {
  const Theme& t = ui.theme;
  Area row = rest.cut_top(t.px(32), t.unit(0.5F));
  put_label(t, row, label);
  row.cut_left(t.px(56));
  return slider(ui, row, fmt::format("##{}", label).c_str(), value, 0, high,
                {.format = format, .value_width = t.px(58)});
}

void simulation_card(const Ui& ui, const ConsoleData& data, UiState& state, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "SIMULATION", area);
  Area rest = card.inside();
  value_row(ui, rest.cut_top(t.px(22), t.unit(0.5F)), "Session", fmt::format("{:.1f}", data.view.simulated_s), "s");
  SimulationChoice& choice = state.simulation;
  stepper(ui, rest.cut_top(t.px(32), t.unit(0.5F)), "scenario", choice.scenario, data.facts.scenarios);
  choice.link_chosen |= small_slider(ui, rest, "Delay", choice.delay_ms, 400, "%.0f ms");
  choice.link_chosen |= small_slider(ui, rest, "Jitter", choice.jitter_ms, 100, "%.0f ms");
  choice.link_chosen |= small_slider(ui, rest, "Loss", choice.loss_percent, 50, "%.0f %%");
  toggle(ui, rest.cut_top(t.px(28), t.unit(0.5F)), "Scenario drives", choice.demo);
  const Area buttons = rest.cut_top(t.px(36));
  const Area left = buttons.column(0, 2, t.unit()), right = buttons.column(1, 2, t.unit());
  if (button(ui, left, state.paused ? Icon::kPlay : Icon::kPause, state.paused ? "Resume" : "Pause", state.paused))
    state.paused = !state.paused;
  // Stands out while what is chosen is not what runs.
  if (button(ui, right, Icon::kReset, "Reset", !(choice == state.running))) ++state.reset_count;
}

void connection_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "MACHINE", area, machine_freshness(data.view));
  Area rest = card.inside();
  put_fitted(t.fonts.body, t.colours.text, rest.cut_top(t.px(24), t.unit(0.5F)), data.facts.machine.name);
  put_fitted(t.fonts.mono_small, t.colours.muted, rest.cut_top(t.px(22), t.unit(0.5F)), data.facts.peer);
  value_row(ui, rest.cut_top(t.px(22)), "Round trip", fmt::format("{:.1f}", data.view.link.round_trip_s * 1e3), "ms");
  value_row(ui, rest.cut_top(t.px(22)), "Loss", fmt::format("{:.1f}", data.view.link.loss * 100), "%");
}

void draw_rail(const Ui& ui, const ConsoleData& data, UiState& state, Area area) {
  const Theme& t = ui.theme;
  const float height = std::min(t.px(84), (area.height() - t.px(96)) / static_cast<float>(kScreens.size()));
  const std::size_t open = data.events.open(Severity::kWarning);
  for (const ScreenOnRail& entry : kScreens)
    rail_entry(ui, entry, entry.screen == Screen::kEvents ? open : 0, state, area.cut_top(height, t.px(2)));
  Area hints = area.cut_bottom(t.px(88));
  const std::array<std::pair<const char*, const char*>, 4> keys{
      {{"F9", t.light ? "Dark" : "Light"}, {"F10", "Units"}, {"F11", "Full"}, {"F12", "Help"}}};
  for (const auto& [key, what] : keys) {
    Area row = hints.cut_top(t.px(22));
    put_text(t.fonts.small, t.colours.muted, {row.min.x + t.px(6), row.centre().y}, Align::kLeft, key);
    put_text(t.fonts.small, t.colours.muted, {row.max.x - t.px(4), row.centre().y}, Align::kRight, what);
  }
}

void draw_stop(const Ui& ui, UiState& state, Area area) {
  const Theme& t = ui.theme;
  const Palette& c = t.colours;
  ImGui::SetCursorScreenPos(area.min);
  // Acts when it is pressed, not when it is released.
  ImGui::InvisibleButton("Stop", area.size());
  if (ImGui::IsItemActivated()) state.stop = true;
  const ImU32 fill = state.stop ? mix(c.stop, c.background, 0.45F) : c.stop;
  canvas().AddRectFilled(area.min, area.max, ImGui::IsItemHovered() ? mix(fill, c.stop_text, 0.08F) : fill, t.px(10));
  canvas().AddRect(area.min, area.max, state.stop ? c.notice : mix(c.stop, c.stop_text, 0.35F), t.px(10), 0,
                   t.px(state.stop ? 3.F : 1.5F));
  focus_ring(ui, area.inset(t.px(4)), t.px(7));
  const ImVec2 middle = area.centre();
  if (state.stop) {
    draw_icon(canvas(), Icon::kLock, {middle.x, middle.y - t.px(20)}, t.px(26), c.stop_text);
    return put_text(t.fonts.title, c.stop_text, {middle.x, middle.y + t.px(18)}, Align::kCentre, "STOP PRESSED");
  }
  draw_icon(canvas(), Icon::kStop, {area.min.x + t.px(48), middle.y}, t.px(50), c.stop_text);
  put_text(t.fonts.display, c.stop_text, {area.min.x + t.px(86), middle.y - t.px(6)}, Align::kLeft, "STOP");
  put_text(t.fonts.small, c.stop_text, {area.min.x + t.px(88), middle.y + t.px(24)}, Align::kLeft,
           state.typing && !state.typing_number ? "Esc" : "Space, Esc");
}

void draw_side_column(const Ui& ui, const ConsoleData& data, UiState& state, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  draw_stop(ui, state, area.cut_bottom(t.px(96), gap));
  // Never where Stop is: a second, hasty click must not release it.
  if (state.stop && button(ui, area.cut_bottom(t.px(40), gap), Icon::kNone, "Release (Ctrl+Backspace)"))
    state.stop = false;
  hand_card(ui, data, area.cut_top(t.px(152), gap));
  if (data.view.simulated)
    simulation_card(ui, data, state, area.cut_top(t.px(282)));
  else
    connection_card(ui, data, area.cut_top(t.px(152)));
}

void draw_help(const Ui& ui, bool playing, const Area& area) {
  const Theme& t = ui.theme;
  canvas().AddRectFilled(area.min, area.max, t.colours.surface, t.px(8));
  canvas().AddRect(area.min, area.max, t.colours.accent, t.px(8), 0, t.px(1.5F));
  Area rest = area.inset(t.unit(3), t.unit(2));
  put_text(t.fonts.title, t.colours.text, {rest.min.x, rest.min.y + t.px(14)}, Align::kLeft, "Keys");
  put_text(t.fonts.small, t.colours.muted, {rest.max.x, rest.min.y + t.px(14)}, Align::kRight, "F12 closes");
  rest.cut_top(t.px(38));
  const Area note = rest.cut_bottom(t.px(48), t.unit());
  put_lines(t.fonts.small, t.colours.notice, note,
            playing
                ? "A recording is played: nothing is sent, nothing can be stopped or led from here."
                : "Stop is software: it requests a stop over the link. It is not an emergency stop; the machine has "
                  "its own, hard-wired.");
  std::vector<std::pair<const char*, const char*>> rows;
  const auto add = [&rows](const KeyBinding& b) {
    if (*b.keys != '\0') rows.emplace_back(b.keys, b.what);
  };
  if (playing) std::for_each(kPlayerKeys.begin(), kPlayerKeys.end(), add);
  for (const KeyBinding& b : kKeys)
    if (!playing || acts_on_window(b)) add(b);
  const auto& pointing = playing ? kPlayerPointing : kPointing;
  rows.insert(rows.end(), pointing.begin(), pointing.end());
  const std::size_t half = (rows.size() + 1) / 2;
  std::size_t i = 0;
  const auto line = [&](const char* keys, const char* what) {
    Area column = rest.column(i < half ? 0 : 1, 2, t.unit(2));
    Area row = column.row(static_cast<int>(i % half), static_cast<int>(half), 0);
    put_text(t.fonts.mono_small, t.colours.accent, row, Align::kLeft, keys);
    row.cut_left(t.px(124));
    const ImFont* font = t.fonts.small;
    const float height = text_height(font, row.width(), what);
    put_lines(font, t.colours.text, row.inset(0, (row.height() - height) / 2), what);
    ++i;
  };
  for (const auto& [keys, what] : rows) line(keys, what);
}

}  // namespace

// Where everything goes: banner on top, rail on the left, hand, session and Stop on the right, the screen between.

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

DrawnScreen draw_console(const Ui& ui, const ConsoleData& data, UiState& state) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  Area rest = Area{{0, 0}, ImGui::GetIO().DisplaySize}.inset(gap);
  draw_banner(ui, data, state, rest.cut_top(t.px(72), gap));
  if (data.player != nullptr) draw_timeline(ui, data, rest.cut_bottom(t.px(66), gap));
  draw_rail(ui, data, state, rest.cut_left(t.px(92), gap));
  const Area column = rest.cut_right(t.px(236), gap);
  if (data.player != nullptr)
    draw_player_column(ui, data, column);
  else
    draw_side_column(ui, data, state, column);
  if (!state.help) return kScreens[static_cast<std::size_t>(state.screen)].draw(ui, data, state, rest);
  draw_help(ui, data.player != nullptr, rest);
  return std::nullopt;
}

}  // namespace knuckle::console::screens
