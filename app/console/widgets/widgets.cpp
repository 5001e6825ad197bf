#include "app/console/widgets/widgets.h"

#include <imgui_internal.h>

#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <utility>

namespace knuckle::console {

void FocusOrder::add_last_item() {
  const ImGuiLastItemData& item = GImGui->LastItemData;
  if ((item.InFlags & ImGuiItemFlags_Disabled) != 0 || !ImGui::IsItemVisible()) return;
  items_.push_back({item.ID, ImGui::GetCurrentWindow(), {item.NavRect.Min, item.NavRect.Max}});
}

void FocusOrder::end_frame() {
  const auto focused =
      std::find_if(items_.begin(), items_.end(), [](const Item& item) { return item.id == GImGui->NavId; });
  found_ = focused != items_.end();
  if (found_) at_ = static_cast<std::size_t>(focused - items_.begin());
  const Move move = std::exchange(asked_, Move::kNone);
  if (move != Move::kNone && !items_.empty() && !ImGui::IsAnyMouseDown()) {
    at_ = target(move);
    go(items_[at_]);
  }
  items_.clear();
}

/// A list is one step, however long it is: arrows move in it.
std::size_t FocusOrder::target(Move move) const {
  const std::size_t count = items_.size(), from = std::min(at_, count - 1);
  if (!found_ && move == Move::kOn) return entered(at_ % count);
  const std::size_t step = move == Move::kOn ? 1 : count - 1;
  std::size_t to = (from + step) % count;
  const auto in_same_list = [&] {
    return found_ && items_[to].window == items_[from].window && items_[to].window->ParentWindow != nullptr;
  };
  while (to != from && in_same_list()) to = (to + step) % count;
  return entered(to);
}

/// Of a list the item that had the focus there last, if it is in sight; else the first one.
std::size_t FocusOrder::entered(std::size_t index) const {
  const ImGuiWindow* const window = items_[index].window;
  if (window->ParentWindow == nullptr) return index;
  const auto find = [this](const auto& is) {
    return static_cast<std::size_t>(std::find_if(items_.begin(), items_.end(), is) - items_.begin());
  };
  const ImGuiID last = window->NavLastIds[ImGuiNavLayer_Main];
  const std::size_t again = find([&](const Item& item) { return item.window == window && item.id == last; });
  return again < items_.size() ? again : find([&](const Item& item) { return item.window == window; });
}

void FocusOrder::go(const Item& item) {
  ImGui::ClearActiveID();  // ends typing: what was typed stays
  ImGui::FocusWindow(item.window);
  ImGui::SetNavID(item.id, ImGuiNavLayer_Main, 0,
                  ImGui::WindowRectAbsToRel(item.window, {item.area.min, item.area.max}));
  GImGui->NavDisableHighlight = false;
}

namespace {

constexpr float kGreyed = 0.42F;

ImVec2 text_size(const ImFont* font, float width, std::string_view text) {
  return font->CalcTextSizeA(font->FontSize, FLT_MAX, width, text.data(), text.data() + text.size());
}

}  // namespace

float text_width(const ImFont* font, std::string_view text) {
  return text_size(font, 0, text).x;
}

float text_height(const ImFont* font, float width, std::string_view text) {
  return text_size(font, width, text).y;
}

void put_text(const ImFont* font, ImU32 colour, ImVec2 at, Align align, std::string_view text) {
  const float width = align == Align::kLeft ? 0 : text_width(font, text);
  const float x = align == Align::kRight ? at.x - width : align == Align::kCentre ? at.x - width / 2 : at.x;
  canvas().AddText(font, font->FontSize, {std::round(x), std::round(at.y - font->FontSize / 2)}, ink(colour),
                   text.data(), text.data() + text.size());
}

void put_text(const ImFont* font, ImU32 colour, const Area& area, Align align, std::string_view text) {
  const ImVec2 centre = area.centre();
  const float x = align == Align::kRight ? area.max.x : align == Align::kCentre ? centre.x : area.min.x;
  put_text(font, colour, ImVec2(x, centre.y), align, text);
}

void put_label(const Theme& theme, const Area& area, std::string_view text) {
  put_text(theme.fonts.small, theme.colours.muted, area, Align::kLeft, text);
}

namespace {

/// With "..." for what the area has no room for.
std::string fitted_lines(const ImFont* font, const Area& area, std::string_view text) {
  const int lines = static_cast<int>(area.height() / font->FontSize);
  if (text_height(font, area.width(), text) <= area.height() || lines < 1) return std::string(text);
  const char *line = text.data(), *const end = line + text.size();
  for (int i = 1; i < lines; ++i) {
    line = font->CalcWordWrapPositionA(1, line, end, area.width());
    while (line < end && (*line == ' ' || *line == '\n')) ++line;
  }
  return std::string(text.data(), line) + fitted_text(font, area.width(), std::string_view(line, end));
}

}  // namespace

float put_lines(const ImFont* font, ImU32 colour, const Area& area, std::string_view text) {
  const std::string shown = fitted_lines(font, area, text);
  canvas().PushClipRect(area.min, area.max, true);
  canvas().AddText(font, font->FontSize, {std::round(area.min.x), std::round(area.min.y)}, ink(colour), shown.c_str(),
                   nullptr, area.width());
  canvas().PopClipRect();
  return text_height(font, area.width(), shown);
}

std::string fitted_text(const ImFont* font, float width, std::string_view text) {
  if (text_width(font, text) <= width) return std::string(text);
  constexpr std::string_view kDots = "...";
  const char* rest = text.data();  // behind what fits, before a UTF-8 character
  font->CalcTextSizeA(font->FontSize, width - text_width(font, kDots), 0, rest, rest + text.size(), &rest);
  return std::string(text.data(), rest).append(kDots);
}

void put_fitted(const ImFont* font, ImU32 colour, const Area& area, std::string_view text) {
  put_text(font, colour, area, Align::kLeft, fitted_text(font, area.width(), text));
}

Card::Card(const Ui& ui, std::string_view title, const Area& area, Freshness freshness) {
  const Theme& t = ui.theme;
  const Palette& c = t.colours;
  freshness = freshness.after(ui.view_age_s);
  greyed_ = freshness.stale() || ui.loop_silent();
  canvas().AddRectFilled(area.min, area.max, c.surface, t.px(8));
  inside_ = area.inset(t.unit(1.5F), t.unit(1.25F));
  Area head = inside_.cut_top(t.fonts.small->FontSize, t.unit(0.75F));
  if (greyed_) {
    const std::string age = freshness.heard ? shown_duration(freshness.age_s) + " old"
                            : ui.replay     ? "not recorded"
                                            : "no data yet";
    const float width = text_width(t.fonts.small, age);
    const Area tag = head.cut_right(width + t.unit(2.5F), t.unit());
    draw_icon(canvas(), Icon::kClock, {tag.min.x + t.unit(), tag.centre().y}, t.px(14), c.notice);
    put_text(t.fonts.small, c.notice, tag, Align::kRight, age);
  }
  put_fitted(t.fonts.small, c.muted, head, title);
  ImGui::PushID(title.data(), title.data() + title.size());
  ImGui::PushClipRect(inside_.min, {area.max.x, area.max.y}, true);
  if (greyed_) ImGui::PushStyleVar(ImGuiStyleVar_Alpha, kGreyed);
}

Card::~Card() {
  if (greyed_) ImGui::PopStyleVar();
  ImGui::PopClipRect();
  ImGui::PopID();
}

void value_row(const Ui& ui, const Area& area, std::string_view label, std::string_view number, std::string_view unit) {
  const Theme& t = ui.theme;
  const float y = area.centre().y;
  float right = area.max.x;
  if (!unit.empty()) {
    put_text(t.fonts.small, t.colours.muted, {right, y}, Align::kRight, unit);
    right -= text_width(t.fonts.small, unit) + t.unit(0.5F);
  }
  put_text(t.fonts.mono, t.colours.text, {right, y}, Align::kRight, number);
  right -= text_width(t.fonts.mono, number) + t.unit(0.5F);
  put_fitted(t.fonts.small, t.colours.muted, {area.min, {right, area.max.y}}, label);
}

void put_large(const Ui& ui, const Area& area, ImU32 colour, std::string_view number, std::string_view unit) {
  const Theme& t = ui.theme;
  put_text(t.fonts.mono_display, colour, area, Align::kLeft, number);
  const float x = area.min.x + text_width(t.fonts.mono_display, number) + t.unit();
  put_text(t.fonts.body, t.colours.muted, {x, area.centre().y + t.px(4)}, Align::kLeft, unit);
}

void lamp(const Ui& ui, const Area& area, std::string_view label, bool on, ImU32 colour) {
  const Theme& t = ui.theme;
  const float radius = t.px(7);
  const ImVec2 centre{area.min.x + radius, area.centre().y};
  if (on)
    canvas().AddCircleFilled(centre, radius, ink(colour));
  else
    canvas().AddCircle(centre, radius - t.px(1), ink(t.colours.muted), 0, t.px(1.5F));
  const Area beside{{centre.x + radius + t.unit(), area.min.y}, area.max};
  put_fitted(on ? t.fonts.body_bold : t.fonts.body, on ? t.colours.text : t.colours.muted, beside, label);
}

float chip_width(const Ui& ui, std::string_view text) {
  return text_width(ui.theme.fonts.small, text) + ui.theme.unit(4.5F);
}

float chip(const Ui& ui, ImVec2 left_middle, Icon icon, std::string_view text, ImU32 fill) {
  const Theme& t = ui.theme;
  const float half = t.px(14), width = chip_width(ui, text);
  canvas().AddRectFilled({left_middle.x, left_middle.y - half}, {left_middle.x + width, left_middle.y + half},
                         ink(fill), half);
  const ImU32 on = text_on(fill);
  draw_icon(canvas(), icon, {left_middle.x + t.unit(1.75F), left_middle.y}, t.px(14), ink(on));
  put_text(t.fonts.small, on, {left_middle.x + t.unit(3.25F), left_middle.y}, Align::kLeft, text);
  return width;
}

void bar(const Ui& ui, const Area& area, float share_from, float share_to, ImU32 colour) {
  const Theme& t = ui.theme;
  canvas().AddRectFilled(area.min, area.max, ink(t.colours.raised), t.px(3));
  const auto x = [&area](float share) { return area.min.x + area.width() * std::clamp(share, 0.F, 1.F); };
  const float a = x(std::min(share_from, share_to)), b = x(std::max(share_from, share_to));
  if (b > a) canvas().AddRectFilled({a, area.min.y}, {b, area.max.y}, ink(colour), std::min(t.px(3), (b - a) / 2));
}

void hatch(const Ui& ui, const Area& area, ImU32 colour, float line_px) {
  const Theme& t = ui.theme;
  canvas().PushClipRect(area.min, area.max, true);
  for (float x = area.min.x - area.height(); x < area.max.x; x += t.px(line_px + 5))
    canvas().AddLine({x, area.max.y}, {x + area.height(), area.min.y}, ink(colour), t.px(line_px));
  canvas().PopClipRect();
}

void focus_ring(const Ui& ui, const Area& area, float rounding) {
  ui.focus.add_last_item();
  if (ImGui::IsItemFocused() && ImGui::GetIO().NavVisible)
    canvas().AddRect(area.min, area.max, ui.theme.colours.text, rounding, 0, ui.theme.px(2));
}

void pointer_area(const char* id, const Area& area, ImGuiButtonFlags buttons) {
  if (area.width() < 1 || area.height() < 1) return;
  ImGui::SetCursorScreenPos(area.min);
  ImGui::PushItemFlag(ImGuiItemFlags_NoNav, true);
  ImGui::InvisibleButton(id, area.size(), buttons);
  ImGui::PopItemFlag();
}

bool button(const Ui& ui, const Area& area, Icon icon, const char* label, bool chosen, bool enabled) {
  const Theme& t = ui.theme;
  const Palette& c = t.colours;
  if (area.width() < 1 || area.height() < 1) return false;
  ImGui::SetCursorScreenPos(area.min);
  ImGui::BeginDisabled(!enabled);
  const bool pressed = ImGui::InvisibleButton(label, area.size());
  const bool hovered = ImGui::IsItemHovered(), held = ImGui::IsItemActive();
  const ImU32 base = chosen ? mix(c.surface, c.accent, 0.30F) : c.raised;
  canvas().AddRectFilled(area.min, area.max, ink(mix(base, c.accent, held ? 0.3F : hovered ? 0.15F : 0)), t.px(5));
  if (chosen) canvas().AddRect(area.min, area.max, ink(c.accent), t.px(5), 0, t.px(1.5F));
  focus_ring(ui, area, t.px(5));
  const ImFont* font = chosen ? t.fonts.body_bold : t.fonts.body;
  const std::string_view text(label, ImGui::FindRenderedTextEnd(label));  // what is behind ## is not shown
  const float mark = icon == Icon::kNone ? 0 : t.px(26);
  const float left = area.centre().x - (text_width(font, text) + mark) / 2;
  if (icon != Icon::kNone) draw_icon(canvas(), icon, {left + t.px(9), area.centre().y}, t.px(18), ink(c.text));
  put_text(font, c.text, {left + mark, area.centre().y}, Align::kLeft, text);
  ImGui::EndDisabled();
  return pressed;
}

bool slider(const Ui& ui, Area area, const char* id, float& value, float low, float high, const SliderLook& look) {
  const Theme& t = ui.theme;
  const Area beside = area.cut_right(look.value_width, t.unit());
  ImGui::SetCursorScreenPos(area.min);
  ImGui::SetNextItemWidth(area.width());
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {t.unit(), (area.height() - ImGui::GetFontSize()) / 2});
  ImGui::PushStyleColor(ImGuiCol_Text, 0);  // ImGui's own text would lie under the knob
  ImGui::BeginDisabled(look.locked);
  const ImGuiSliderFlags flags =
      ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_NoInput | (look.logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
  const bool moved = ImGui::SliderFloat(id, &value, low, high, look.format, flags);
  ui.focus.add_last_item();
  ImGui::EndDisabled();
  ImGui::PopStyleColor();
  ImGui::PopStyleVar();
  const ImU32 colour = look.marked ? t.colours.notice : t.colours.text;
  std::array<char, 32> number{};  // of ImGui's format, which is printf's
  ImFormatString(number.data(), number.size(), look.format, static_cast<double>(value));
  put_text(t.fonts.mono_small, colour, beside, Align::kRight, number.data());
  return moved;
}

bool toggle(const Ui& ui, const Area& area, const char* label, bool& value) {
  const Theme& t = ui.theme;
  const Palette& c = t.colours;
  ImGui::SetCursorScreenPos(area.min);
  const bool pressed = ImGui::InvisibleButton(label, area.size());
  if (pressed) value = !value;
  const float h = t.px(20), w = t.px(36), y = area.centre().y;
  const ImVec2 a{area.min.x, y - h / 2}, b{area.min.x + w, y + h / 2};
  canvas().AddRectFilled(a, b, ink(value ? c.accent : c.raised), h / 2);
  canvas().AddRect(a, b, ink(value ? c.accent : c.muted), h / 2, 0, t.px(1.5F));
  canvas().AddCircleFilled({value ? b.x - h / 2 : a.x + h / 2, y}, h / 2 - t.px(4), ink(value ? c.surface : c.muted));
  focus_ring(ui, area, t.px(5));
  put_fitted(t.fonts.body, c.text, {{b.x + t.unit(), area.min.y}, area.max}, label);
  return pressed;
}

bool stepper(const Ui& ui, const Area& area, const char* id, int& index, std::span<const std::string> texts) {
  const Theme& t = ui.theme;
  const int count = static_cast<int>(texts.size());
  if (count == 0) return false;
  const int before = index;
  Area rest = area;
  ImGui::PushID(id);
  if (button(ui, rest.cut_left(t.px(30), t.unit(0.5F)), Icon::kNone, "<")) index = (index + count - 1) % count;
  if (button(ui, rest.cut_right(t.px(30), t.unit(0.5F)), Icon::kNone, ">")) index = (index + 1) % count;
  ImGui::PopID();
  canvas().AddRectFilled(rest.min, rest.max, ink(t.colours.raised), t.px(5));
  const std::string& text = texts[static_cast<std::size_t>(std::clamp(index, 0, count - 1))];
  const ImFont* font = text_width(t.fonts.body, text) > rest.width() ? t.fonts.small : t.fonts.body;
  put_text(font, t.colours.text, rest, Align::kCentre, text);
  return index != before;
}

}  // namespace knuckle::console
