// Force and oil pressures over time, with a cursor that events and plots share.
#include <array>
#include <cmath>
#include <string>

#include "app/console/screens/screens.h"

namespace knuckle::console::screens {
namespace {

/// What is plotted, at the chosen time or now.
const widgets::History::Sample& shown_sample(const ConsoleData& data) {
  const widgets::History& history = data.plots.history();
  return history.ago(data.plots.cursor().chosen ? history.size() / 2 : 0);
}

void move_buttons(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area, bool chosen) {
  const widgets::Theme& t = ui.theme;
  const auto press = [&](float width, widgets::Icon icon, const char* label, bool enabled) {
    return widgets::button(ui, area.cut_left(t.px(width), t.px(4)).inset(0, t.px(2)), icon, label, false, enabled);
  };
  if (press(40, widgets::Icon::kEventBack, "##before", true)) data.live_plots.jump(false, data.events, data.view);
  if (press(40, widgets::Icon::kEventOn, "##next", chosen)) data.live_plots.jump(true, data.events, data.view);
  if (press(172, widgets::Icon::kReset, "Back to now", chosen)) data.live_plots.choose(std::nullopt);
}

void cursor_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const std::optional<Time> at = chosen_time(data);
  const widgets::Card card(ui, at ? "AT THE CURSOR" : "NOW", area);
  widgets::Area rest = card.inside();
  if (data.player == nullptr) move_buttons(ui, data, rest.cut_right(t.px(264), t.unit()), at.has_value());
  const widgets::Area head = rest.cut_top(rest.height() / 2);
  const Time shown_at = at.value_or(data.view.now);
  std::string when = event_time(shown_at, data.facts.unix_ns_at_zero);
  if (data.facts.unix_ns_at_zero == 0) when += " s";
  widgets::put_text(t.fonts.mono, t.colours.text, {head.min.x, head.centre().y}, widgets::Align::kLeft, when.c_str());
  if (at && data.player == nullptr)
    widgets::put_text(t.fonts.small, t.colours.notice,
                      {head.min.x + widgets::text_width(t.fonts.mono, when.c_str()) + t.unit(2), head.centre().y},
                      widgets::Align::kLeft, ago_text(data.view.now - *at).c_str());
  const EventRow* row = event_at(data.events, data.view.run, shown_at);
  const std::string words =
      row == nullptr ? "no event up to here"
                     : event_time(row->at, data.facts.unix_ns_at_zero) + "  " + as_shown(ui, data, row->text);
  widgets::put_fitted(t.fonts.small, t.colours.muted, rest, words.c_str());
}

/// Those of the plots' seconds.
void event_lane(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& lane) {
  for (const EventRow& row : data.events.rows()) {
    const float share = data.plots.share(row.at);
    if (row.run == data.view.run && share >= 0 && share <= 1)
      event_mark(ui.theme, row.severity, lane.min.x + share * lane.width(), lane);
  }
}

struct Figure {
  const char* label;
  ImU32 colour;
  widgets::Shown words;
};
/// Above a plot: what its lines are and how much they say.
void figures(const widgets::Ui& ui, widgets::Area line, std::span<const Figure> all) {
  const widgets::Theme& t = ui.theme;
  for (const Figure& figure : all) {
    const float y = line.centre().y;
    widgets::canvas().AddLine({line.min.x, y}, {line.min.x + t.px(16), y}, widgets::ink(figure.colour), t.px(2));
    line.cut_left(t.px(22));
    widgets::put_text(t.fonts.small, t.colours.muted, {line.min.x, y}, widgets::Align::kLeft, figure.label);
    line.cut_left(widgets::text_width(t.fonts.small, figure.label) + t.unit());
    widgets::put_text(t.fonts.mono_small, t.colours.text, {line.min.x, y}, widgets::Align::kLeft, figure.words.c_str());
    line.cut_left(std::max(t.px(96), widgets::text_width(t.fonts.mono_small, figure.words.c_str())) + t.unit(2));
  }
}

void force_card(const widgets::Ui& ui, const ConsoleData& data, const UiState& state, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "FORCE ON THE BUCKET TIP", area);
  widgets::Area rest = card.inside();
  const widgets::Quantity q = widgets::Quantity::kForce;
  const std::array all{
      Figure{"force", t.colours.force, ui.units.text(q, widgets::known_force_N(shown_sample(data).machine))},
      Figure{"maximum set", t.colours.text, ui.units.text(q, static_cast<double>(state.force_most_N))}};
  figures(ui, rest.cut_top(t.px(18), t.px(4)), all);
  event_lane(ui, data, rest.cut_top(t.px(14), t.px(2)));
  force_plot(ui, data, rest, static_cast<double>(state.force_most_N));
}

void pressure_card(const widgets::Ui& ui, const ConsoleData& data, std::size_t joint, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  static constexpr std::array<const char*, kJoints> kTitles{"BOOM PRESSURES", "ARM PRESSURES", "BUCKET PRESSURES"};
  const widgets::Card card(ui, kTitles[joint], area);
  widgets::Area rest = card.inside();
  const std::array<ImU32, 2> colours = side_colours(t);
  const auto words = [&](double pressure_Pa) { return ui.units.text(widgets::Quantity::kPressure, pressure_Pa); };
  const auto side = [&](std::size_t i) { return words(shown_sample(data).machine.pressure_Pa[2 * joint + i]); };
  const std::array all{Figure{"head", colours[0], side(0)}, Figure{"rod", colours[1], side(1)},
                       Figure{"relief", t.colours.text, words(lower_relief_Pa(data.facts.machine.hydraulics))}};
  figures(ui, rest.cut_top(t.px(18), t.px(4)), all);
  pressure_plot(ui, data, joint, rest);
}

}  // namespace

DrawnScreen history_screen(const widgets::Ui& ui, const ConsoleData& data, UiState& state, widgets::Area area) {
  const widgets::Theme& t = ui.theme;
  const float gap = t.px(10);
  cursor_card(ui, data, area.cut_top(t.px(84), gap));
  constexpr int kRows = kJoints + 1;
  force_card(ui, data, state, area.row(0, kRows, gap));
  for (std::size_t j = 0; j < kJoints; ++j) pressure_card(ui, data, j, area.row(static_cast<int>(j) + 1, kRows, gap));
  return std::nullopt;
}

}  // namespace knuckle::console::screens
