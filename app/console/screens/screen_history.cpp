// Force and oil pressures over time, with a cursor that events and plots share.
#include <array>
#include <string>

#include "app/console/screens/screens.h"

namespace knuckle::console::screens {
namespace {

/// What is plotted, at the chosen time or now.
const History::Sample& shown_sample(const ConsoleData& data) {
  const History& history = data.plots.history();
  return history.ago(data.plots.cursor().chosen ? history.size() / 2 : 0);
}

void move_buttons(const Ui& ui, const ConsoleData& data, Area area, bool chosen) {
  const Theme& t = ui.theme;
  const auto press = [&](float width, Icon icon, const char* label, bool enabled) {
    return button(ui, area.cut_left(t.px(width), t.px(4)).inset(0, t.px(2)), icon, label, false, enabled);
  };
  if (press(40, Icon::kEventBack, "##before", true)) data.live_plots.jump(false, data.events, data.view);
  if (press(40, Icon::kEventOn, "##next", chosen)) data.live_plots.jump(true, data.events, data.view);
  if (press(172, Icon::kReset, "Back to now", chosen)) data.live_plots.choose(std::nullopt);
}

void cursor_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const std::optional<Time> at = chosen_time(data);
  const Card card(ui, at ? "AT THE CURSOR" : "NOW", area);
  Area rest = card.inside();
  if (data.player == nullptr) move_buttons(ui, data, rest.cut_right(t.px(264), t.unit()), at.has_value());
  const Area head = rest.cut_top(rest.height() / 2);
  const Time shown_at = at.value_or(data.view.now);
  std::string when = event_time(shown_at, data.facts.unix_ns_at_zero);
  if (data.facts.unix_ns_at_zero == 0) when += " s";
  put_text(t.fonts.mono, t.colours.text, head, Align::kLeft, when);
  if (at && data.player == nullptr)
    put_text(t.fonts.small, t.colours.notice,
             {head.min.x + text_width(t.fonts.mono, when) + t.unit(2), head.centre().y}, Align::kLeft,
             ago_text(data.view.now - *at));
  const EventRow* row = event_at(data.events, data.view.run, shown_at);
  const std::string text = row == nullptr
                               ? "no event up to here"
                               : event_time(row->at, data.facts.unix_ns_at_zero) + "  " + ui.units.as_shown(row->text);
  put_fitted(t.fonts.small, t.colours.muted, rest, text);
}

/// Those of the plots' seconds.
void event_lane(const Ui& ui, const ConsoleData& data, const Area& lane) {
  for (const EventRow& row : data.events.rows()) {
    const float share = data.plots.share(row.at);
    if (row.run == data.view.run && share >= 0 && share <= 1)
      event_mark(ui.theme, row.severity, lane.min.x + share * lane.width(), lane);
  }
}

struct Figure {
  const char* label;
  ImU32 colour;
  std::string text;
};
/// Above a plot: what its lines are and how much they say.
void figures(const Ui& ui, Area line, std::span<const Figure> all) {
  const Theme& t = ui.theme;
  for (const Figure& figure : all) {
    const float y = line.centre().y;
    canvas().AddLine({line.min.x, y}, {line.min.x + t.px(16), y}, ink(figure.colour), t.px(2));
    line.cut_left(t.px(22));
    put_text(t.fonts.small, t.colours.muted, {line.min.x, y}, Align::kLeft, figure.label);
    line.cut_left(text_width(t.fonts.small, figure.label) + t.unit());
    put_text(t.fonts.mono_small, t.colours.text, {line.min.x, y}, Align::kLeft, figure.text);
    line.cut_left(std::max(t.px(96), text_width(t.fonts.mono_small, figure.text)) + t.unit(2));
  }
}

void force_card(const Ui& ui, const ConsoleData& data, const UiState& state, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "FORCE ON THE BUCKET TIP", area);
  Area rest = card.inside();
  const Quantity q = Quantity::kForce;
  const std::array all{
      Figure{"force", t.colours.force, ui.units.text(q, known_force_N(shown_sample(data).machine))},
      Figure{"maximum set", t.colours.text, ui.units.text(q, static_cast<double>(state.force_most_N))}};
  figures(ui, rest.cut_top(t.px(18), t.px(4)), all);
  event_lane(ui, data, rest.cut_top(t.px(14), t.px(2)));
  force_plot(ui, data, rest, static_cast<double>(state.force_most_N));
}

void pressure_card(const Ui& ui, const ConsoleData& data, std::size_t joint, const Area& area) {
  const Theme& t = ui.theme;
  static constexpr std::array<const char*, kJoints> kTitles{"BOOM PRESSURES", "ARM PRESSURES", "BUCKET PRESSURES"};
  const Card card(ui, kTitles[joint], area);
  Area rest = card.inside();
  const std::array<ImU32, 2> colours = side_colours(t);
  const auto pressure = [&](double pressure_Pa) { return ui.units.text(Quantity::kPressure, pressure_Pa); };
  const auto side = [&](std::size_t i) { return pressure(shown_sample(data).machine.pressure_Pa[2 * joint + i]); };
  const std::array all{Figure{"head", colours[0], side(0)}, Figure{"rod", colours[1], side(1)},
                       Figure{"relief", t.colours.text, pressure(lower_relief_Pa(data.facts.machine.hydraulics))}};
  figures(ui, rest.cut_top(t.px(18), t.px(4)), all);
  pressure_plot(ui, data, joint, rest);
}

}  // namespace

DrawnScreen history_screen(const Ui& ui, const ConsoleData& data, UiState& state, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  cursor_card(ui, data, area.cut_top(t.px(84), gap));
  constexpr int kRows = kJoints + 1;
  force_card(ui, data, state, area.row(0, kRows, gap));
  for (std::size_t j = 0; j < kJoints; ++j) pressure_card(ui, data, j, area.row(static_cast<int>(j) + 1, kRows, gap));
  return std::nullopt;
}

}  // namespace knuckle::console::screens
