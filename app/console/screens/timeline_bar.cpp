#include "app/console/screens/timeline_bar.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "app/console/screens/banner.h"
#include "app/console/screens/player_panel.h"

namespace knuckle::console::screens {
namespace {

ImDrawList& canvas() {
  return *ImGui::GetWindowDrawList();
}

float x_of(const player::Timeline& timeline, const widgets::Area& track, Time at) {
  return track.min.x + static_cast<float>(timeline.share(at)) * track.width();
}

/// "12.345", "1:02:12.345"
widgets::Shown clock_words(Time at) {
  const double s = to_seconds(at);
  const auto whole = static_cast<long>(std::floor(s));
  if (whole < 60) return widgets::shown("%.3f s", s);
  const double rest = s - static_cast<double>(whole / 60 * 60);
  if (whole < 3600) return widgets::shown("%ld:%06.3f", whole / 60, rest);
  return widgets::shown("%ld:%02ld:%06.3f", whole / 3600, whole / 60 % 60, rest);
}

void buttons(const widgets::Ui& ui, player::Timeline& timeline, widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const auto press = [&](widgets::Icon icon, const char* id) {
    return widgets::button(ui, area.cut_left(t.px(34), t.px(4)).inset(0, t.px(9)), icon, id);
  };
  if (press(widgets::Icon::kEventBack, "##event_back")) timeline.jump(false);
  if (press(widgets::Icon::kStepBack, "##step_back")) timeline.step(false);
  const bool playing = timeline.playing();
  if (widgets::button(ui, area.cut_left(t.px(44), t.px(4)).inset(0, t.px(6)),
                      playing ? widgets::Icon::kPause : widgets::Icon::kPlay, "##play", playing))
    timeline.toggle();
  if (press(widgets::Icon::kStepOn, "##step_on")) timeline.step(true);
  if (press(widgets::Icon::kEventOn, "##event_on")) timeline.jump(true);
  area.cut_left(t.px(4));
  const auto speed = [&](const char* label) {
    return widgets::button(ui, area.cut_left(t.px(28), t.px(2)).inset(0, t.px(11)), widgets::Icon::kNone, label);
  };
  if (speed("-##slower")) timeline.slower();
  const widgets::Area words = area.cut_left(t.px(46), t.px(2));
  widgets::put_text(t.fonts.mono_small, t.colours.text, words.centre(), widgets::Align::kCentre,
                    widgets::shown("%gx", timeline.speed()).c_str());
  if (speed("+##faster")) timeline.faster();
}

/// The machine's modes, by colour and, where there is room, by name.
void mode_band(const widgets::Ui& ui, const PlayerPanel& player, const widgets::Area& track,
               const widgets::Area& band) {
  const widgets::Theme& t = ui.theme;
  const auto& modes = player.played().run.modes();
  canvas().AddRectFilled(band.min, band.max, t.colours.raised, t.px(3));
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const float from = x_of(player.timeline(), track, modes[i].from);
    const float to = i + 1 < modes.size() ? x_of(player.timeline(), track, modes[i + 1].from) : track.max.x;
    const ImU32 fill = t.mode_colour(modes[i].mode);
    canvas().AddRectFilled({from, band.min.y}, {std::max(to, from + 1), band.max.y}, fill);
    const char* word = mode_word(modes[i].mode);
    if (widgets::text_width(t.fonts.small, word) + t.unit() < to - from)
      widgets::put_text(t.fonts.small, widgets::text_on(fill), {(from + to) / 2, band.centre().y},
                        widgets::Align::kCentre, word);
  }
  for (const player::Gap& gap : player.played().run.gaps()) {
    const float from = x_of(player.timeline(), track, gap.from);
    const float to = std::max(x_of(player.timeline(), track, gap.to), from + t.px(3));
    canvas().AddRectFilled({from, track.min.y}, {to, track.max.y}, t.colours.background);
    widgets::hatch(ui, {{from, track.min.y}, {to, track.max.y}}, t.colours.muted, 1);
  }
}

void marks(const widgets::Ui& ui, const PlayerPanel& player, const widgets::Area& track, const widgets::Area& lane) {
  const widgets::Theme& t = ui.theme;
  for (const Severity severity : {Severity::kInfo, Severity::kWarning, Severity::kAlarm}) {  // the worst on top
    float drawn = -1e9F;  // marks on top of each other are one
    for (const EventRow& row : player.played().events) {
      if (row.severity != severity) continue;
      const float x = x_of(player.timeline(), track, row.at);
      if (x - drawn >= 1) event_mark(t, severity, drawn = x, lane);
    }
  }
  if (const auto& beside = player.beside(); beside && beside->differs_at) {
    const float x = x_of(player.timeline(), track, *beside->differs_at);
    canvas().AddLine({x, track.min.y}, {x, track.max.y}, t.colours.series[3], t.px(2));
    const float y = lane.centre().y, r = t.px(5);
    canvas().AddQuadFilled({x, y - r}, {x + r, y}, {x, y + r}, {x - r, y}, t.colours.series[3]);
  }
}

void cursor_line(const widgets::Ui& ui, const player::Timeline& timeline, const widgets::Area& track) {
  const widgets::Theme& t = ui.theme;
  const float x = x_of(timeline, track, timeline.cursor()), r = t.px(6);
  canvas().AddLine({x, track.min.y}, {x, track.max.y}, t.colours.text, t.px(2));
  canvas().AddTriangleFilled({x - r, track.min.y - t.px(2)}, {x + r, track.min.y - t.px(2)}, {x, track.min.y + r},
                             t.colours.text);
}

}  // namespace

void event_mark(const widgets::Theme& theme, Severity severity, float x, const widgets::Area& lane) {
  const widgets::Theme& t = theme;
  const float y = lane.centre().y, r = t.px(6);
  if (severity == Severity::kInfo)
    return canvas().AddLine({x, y - t.px(4)}, {x, y + t.px(4)}, t.colours.accent, t.px(2));
  if (severity == Severity::kWarning)
    return canvas().AddTriangleFilled({x, y - r}, {x + r, y + r * 0.8F}, {x - r, y + r * 0.8F}, t.colours.notice);
  canvas().AddRectFilled({x - r, y - r}, {x + r, y + r}, t.colours.bad, t.px(1));
}

void draw_timeline(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area) {
  const widgets::Theme& t = ui.theme;
  PlayerPanel& player = *data.player;
  player::Timeline& timeline = player.timeline();
  canvas().AddRectFilled(area.min, area.max, t.colours.surface, t.px(8));
  area = area.inset(t.unit(1.25F), 0);
  buttons(ui, timeline, area);
  area.cut_left(t.unit());
  const widgets::Area clock = area.cut_left(t.px(112), t.unit(1.5F));
  widgets::put_text(t.fonts.mono, t.colours.text, {clock.max.x, clock.centre().y - t.px(10)}, widgets::Align::kRight,
                    clock_words(timeline.cursor()).c_str());
  widgets::put_text(t.fonts.mono_small, t.colours.muted, {clock.max.x, clock.centre().y + t.px(13)},
                    widgets::Align::kRight,
                    widgets::shown("of %s", clock_words(player.played().run.last()).c_str()).c_str());
  widgets::Area words = area.cut_top(t.px(24));
  const widgets::Area track = area.inset(0, t.px(4));
  widgets::pointer_area("timeline", track);
  const auto at_mouse = [&] {
    return timeline.at_share(static_cast<double>((ImGui::GetIO().MousePos.x - track.min.x) / track.width()));
  };
  if (ImGui::IsItemActive()) timeline.seek(at_mouse());
  widgets::Area rest = track;
  const widgets::Area band = rest.cut_bottom(t.px(18), t.px(2));
  mode_band(ui, player, track, band);
  marks(ui, player, track, rest);
  cursor_line(ui, timeline, track);
  const bool hovers = ImGui::IsItemHovered();
  if (const EventRow* row = event_at(player.events(), player.view().run, hovers ? at_mouse() : timeline.cursor())) {
    const ImU32 colour = row->severity == Severity::kInfo      ? t.colours.muted
                         : row->severity == Severity::kWarning ? t.colours.notice
                                                               : t.colours.bad;
    widgets::put_fitted(t.fonts.small, colour, words,
                        (std::string(clock_words(row->at).c_str()) + "  " + in_words(ui, data, row->text)).c_str());
  }
}

}  // namespace knuckle::console::screens
