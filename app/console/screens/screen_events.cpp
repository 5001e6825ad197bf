#include <fmt/format.h>
#include <imgui_internal.h>

#include <algorithm>
#include <array>

#include "app/console/screens/screens.h"
#include "core/error.h"

namespace knuckle::console::screens {
namespace {

constexpr std::array<const char*, 3> kFilterTexts{"All", "Warnings", "Alarms"};

Icon severity_icon(Severity severity) {
  return severity == Severity::kInfo ? Icon::kCircle : severity == Severity::kWarning ? Icon::kWarning : Icon::kStop;
}

EventFilter chosen_filter(const UiState& state) {
  return {static_cast<Severity>(state.events.least_severity), state.events.text.data()};
}

void export_shown(const EventBook& events, const EventFilter& filter, UiState& state) {
  try {
    const std::string kept = events.export_csv(state.export_path, filter);
    state.export_result = ";  written: " + state.export_path;
    if (!kept.empty()) state.export_result += ", the previous file is kept as " + kept;
  } catch (const InputError& error) {
    state.export_result = std::string(";  ") + error.what();
  }
}

void acknowledge_button(const Ui& ui, const ConsoleData& data, const EventFilter& filter, Area& row) {
  const Theme& t = ui.theme;
  const std::vector<const EventRow*> rows = data.events.matching(filter);
  const bool open = std::any_of(rows.begin(), rows.end(), [](const EventRow* r) { return !r->acknowledged; });
  const Area seen = row.cut_right(t.px(190), t.unit());
  if (button(ui, seen, Icon::kCheck, filter.hides_some() ? "Acknowledge shown" : "Acknowledge all", false, open))
    data.events.acknowledge(filter);
}

void tools(const Ui& ui, const ConsoleData& data, UiState& state, Area row) {
  const Theme& t = ui.theme;
  for (int i = 0; i < 3; ++i) {
    const Area place = row.cut_left(t.px(i == 0 ? 56.F : 104.F), t.unit(0.5F));
    if (button(ui, place, Icon::kNone, kFilterTexts[static_cast<std::size_t>(i)], state.events.least_severity == i))
      state.events.least_severity = i;
  }
  const Area out = row.cut_right(t.px(130), t.unit());
  // This and the next act on what is shown, and say so where that is not all.
  const EventFilter filter = chosen_filter(state);
  const bool some = filter.hides_some();
  if (button(ui, out, Icon::kNone, some ? "Export shown" : "Export CSV")) export_shown(data.events, filter, state);
  if (data.player == nullptr) acknowledge_button(ui, data, filter, row);
  row.cut_left(t.unit(0.5F));
  ImGui::SetCursorScreenPos(row.min);
  ImGui::SetNextItemWidth(row.width());
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {t.unit(), (row.height() - ImGui::GetFontSize()) / 2});
  ImGui::InputTextWithHint("##filter", "filter (Stop while typing: Esc)", state.events.text.data(),
                           state.events.text.size());
  ui.focus.add_last_item();
  ImGui::PopStyleVar();
}

/// Of the events up to the time that is looked at the newest; nullptr: no time was chosen, or there is none.
const EventRow* current_event(const ConsoleData& data) {
  const std::optional<Time> at = chosen_time(data);
  return at ? event_at(data.events, data.view.run, *at) : nullptr;
}

/// A click on a row goes to its time, where that is of the session on screen. The row of that time stands out.
void go_to(const Ui& ui, const ConsoleData& data, const EventRow& row, const EventRow* newest, float height) {
  const Theme& t = ui.theme;
  const bool current = newest != nullptr && newest->run == row.run && newest->at == row.at;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const std::string id = fmt::format("##event{}", row.number);
  constexpr ImGuiSelectableFlags kFlags = ImGuiSelectableFlags_SpanAllColumns | ImGuiSelectableFlags_AllowItemOverlap;
  const bool pressed = ImGui::Selectable(id.c_str(), current, kFlags, {0, height - t.px(8)});
  ui.focus.add_last_item();
  if (pressed && row.run == data.view.run) choose_time(data, row.at);
  ImGui::SetCursorScreenPos(at);
  if (current) ImGui::TableSetBgColor(ImGuiTableBgTarget_RowBg0, mix(t.colours.surface, t.colours.accent, 0.28F));
}

/// Keeps the row of the time that is looked at in sight while that moves.
void follow_cursor(const EventRow* newest, const std::vector<const EventRow*>& rows, float row_height) {
  if (newest == nullptr) return;
  const auto current = std::find_if(rows.rbegin(), rows.rend(), [&](const EventRow* row) {
    return row->run == newest->run && row->at <= newest->at;
  });
  const auto index = static_cast<float>(current - rows.rbegin());
  ImGuiStorage& memory = *ImGui::GetStateStorage();
  const ImGuiID id = ImGui::GetID("followed");
  const auto number = static_cast<int>(newest->number);
  if (memory.GetInt(id, -1) == number) return;
  memory.SetInt(id, number);
  const float y = index * row_height, view = ImGui::GetWindowHeight();
  if (y < ImGui::GetScrollY() + row_height || y > ImGui::GetScrollY() + view - 2 * row_height)
    ImGui::SetScrollY(std::max(0.F, y - view / 2));
}

/// Nothing of its time is plotted any more.
bool out_of_reach(const ConsoleData& data, const EventRow& row) {
  return data.player == nullptr && (row.run != data.view.run || data.view.now - row.at > LivePlots::kKept);
}

/// @param newest of the events up to the time that is looked at; nullptr: there is none.
void event_row(const Ui& ui, const ConsoleData& data, const EventRow& row, const EventRow* newest) {
  const Theme& t = ui.theme;
  const bool old = out_of_reach(data, row);
  const ImU32 colour = severity_colour(t, row.severity), text_colour = old ? t.colours.muted : t.colours.text;
  const float height = t.px(40);  // room for two small lines
  ImGui::TableNextRow(0, height);
  ImGui::TableNextColumn();
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float y = at.y + height / 2 - t.px(4);
  go_to(ui, data, row, newest, height);
  ImDrawList& list = canvas();
  draw_icon(list, severity_icon(row.severity), {at.x + t.px(10), y}, t.px(17), ink(colour));
  put_text(t.fonts.small, colour, {at.x + t.px(26), y}, Align::kLeft, name(row.severity));
  ImGui::TableNextColumn();
  const ImVec2 when = ImGui::GetCursorScreenPos();
  put_text(t.fonts.mono_small, text_colour, {when.x, y}, Align::kLeft, event_time(row.at, data.facts.unix_ns_at_zero));
  ImGui::TableNextColumn();
  const ImVec2 code = ImGui::GetCursorScreenPos();
  put_fitted(t.fonts.mono_small, t.colours.muted,
             {{code.x, y - t.px(10)}, {code.x + ImGui::GetContentRegionAvail().x, y + t.px(10)}}, row.code);
  ImGui::TableNextColumn();
  const std::string text = ui.units.as_shown(row.text);
  const ImVec2 place = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x;
  const ImFont* font = t.fonts.small;
  const float tall = std::min(t.px(34), text_height(font, width, text));
  if (text_width(t.fonts.body, text) <= width)
    put_text(t.fonts.body, text_colour, {place.x, y}, Align::kLeft, text);
  else
    put_lines(font, text_colour, {{place.x, y - tall / 2}, {place.x + width, y + t.px(19)}}, text);
  ImGui::TableNextColumn();
  if (row.severity == Severity::kInfo || data.player != nullptr) return;
  const ImVec2 seen = ImGui::GetCursorScreenPos();
  if (row.acknowledged)
    put_text(t.fonts.small, t.colours.muted, {seen.x + t.px(4), y}, Align::kLeft, "seen");
  else if (button(ui, {{seen.x, y - t.px(13)}, {seen.x + t.px(64), y + t.px(13)}}, Icon::kNone,
                  fmt::format("Ack##{}", row.number).c_str()))
    data.events.acknowledge(row.number);
}

std::string count_text(const EventBook& events, std::size_t shown) {
  std::string text = std::to_string(shown) + " shown, " + std::to_string(events.rows().size()) + " in total";
  if (events.forgotten() > 0) text += ", " + std::to_string(events.forgotten()) + " older ones dropped";
  if (events.forgotten_open() > 0) text += ", " + std::to_string(events.forgotten_open()) + " of them not acknowledged";
  return text;
}

}  // namespace

DrawnScreen events_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area) {
  const Theme& t = ui.theme;
  const Card card(ui, "EVENTS", area);
  Area rest = card.inside();
  tools(ui, data, state, rest.cut_top(t.px(34), t.unit()));
  const Area foot = rest.cut_bottom(t.px(22), t.unit(0.5F));
  const std::vector<const EventRow*> rows = data.events.matching(chosen_filter(state));
  const bool missed = data.events.forgotten_open() > 0;
  put_fitted(t.fonts.small, missed ? t.colours.notice : t.colours.muted, foot,
             (count_text(data.events, rows.size()) + state.export_result));
  ImGui::SetCursorScreenPos(rest.min);
  constexpr ImGuiTableFlags kFlags =
      ImGuiTableFlags_ScrollY | ImGuiTableFlags_BordersInnerH | ImGuiTableFlags_NoSavedSettings;
  if (!ImGui::BeginTable("events", 5, kFlags, rest.size())) return std::nullopt;
  ImGui::TableSetupScrollFreeze(0, 1);
  ImGui::TableSetupColumn("Severity", ImGuiTableColumnFlags_WidthFixed, t.px(92));
  ImGui::TableSetupColumn(data.facts.unix_ns_at_zero == 0 ? "Time, s" : "Time", ImGuiTableColumnFlags_WidthFixed,
                          t.px(104));
  ImGui::TableSetupColumn("Code", ImGuiTableColumnFlags_WidthFixed, t.px(150));
  ImGui::TableSetupColumn("What", ImGuiTableColumnFlags_WidthStretch);
  ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, t.px(68));
  ImGui::PushFont(t.fonts.small);
  ImGui::PushItemFlag(ImGuiItemFlags_NoNav, true);  // nothing is sorted by a column
  ImGui::TableHeadersRow();
  ImGui::PopItemFlag();
  ImGui::PopFont();
  // Newest first; only those in sight are drawn.
  const EventRow* newest = current_event(data);
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(rows.size()));
  while (clipper.Step())
    for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i)
      event_row(ui, data, *rows[rows.size() - 1 - static_cast<std::size_t>(i)], newest);
  follow_cursor(newest, rows, clipper.ItemsHeight);
  ImGui::EndTable();
  return std::nullopt;
}

}  // namespace knuckle::console::screens
