#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "app/console/keys.h"
#include "app/console/machine_text.h"
#include "app/console/screens/player_panel.h"
#include "app/console/screens/screens.h"
#include "core/text.h"

namespace knuckle::console::screens {
namespace {

float x_of(const player::Timeline& timeline, const widgets::Area& track, Time at) {
  return track.min.x + static_cast<float>(timeline.share(at)) * track.width();
}

/// "12.345", "1:02:12.345"
widgets::Shown clock_text(Time at) {
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
  widgets::canvas().AddRectFilled(band.min, band.max, t.colours.raised, t.px(3));
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const float from = x_of(player.timeline(), track, modes[i].from);
    const float to = i + 1 < modes.size() ? x_of(player.timeline(), track, modes[i + 1].from) : track.max.x;
    const ImU32 fill = t.mode_colour(modes[i].mode);
    widgets::canvas().AddRectFilled({from, band.min.y}, {std::max(to, from + 1), band.max.y}, fill);
    const char* word = mode_word(modes[i].mode);
    if (widgets::text_width(t.fonts.small, word) + t.unit() < to - from)
      widgets::put_text(t.fonts.small, widgets::text_on(fill), {(from + to) / 2, band.centre().y},
                        widgets::Align::kCentre, word);
  }
  for (const player::Gap& gap : player.played().run.gaps()) {
    const float from = x_of(player.timeline(), track, gap.from);
    const float to = std::max(x_of(player.timeline(), track, gap.to), from + t.px(3));
    widgets::canvas().AddRectFilled({from, track.min.y}, {to, track.max.y}, t.colours.background);
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
    widgets::canvas().AddLine({x, track.min.y}, {x, track.max.y}, t.colours.series[3], t.px(2));
    const float y = lane.centre().y, r = t.px(5);
    widgets::canvas().AddQuadFilled({x, y - r}, {x + r, y}, {x, y + r}, {x - r, y}, t.colours.series[3]);
  }
}

void cursor_line(const widgets::Ui& ui, const player::Timeline& timeline, const widgets::Area& track) {
  const widgets::Theme& t = ui.theme;
  const float x = x_of(timeline, track, timeline.cursor()), r = t.px(6);
  widgets::canvas().AddLine({x, track.min.y}, {x, track.max.y}, t.colours.text, t.px(2));
  widgets::canvas().AddTriangleFilled({x - r, track.min.y - t.px(2)}, {x + r, track.min.y - t.px(2)},
                                      {x, track.min.y + r}, t.colours.text);
}

}  // namespace

void event_mark(const widgets::Theme& theme, Severity severity, float x, const widgets::Area& lane) {
  const widgets::Theme& t = theme;
  const float y = lane.centre().y, r = t.px(6);
  if (severity == Severity::kInfo)
    return widgets::canvas().AddLine({x, y - t.px(4)}, {x, y + t.px(4)}, t.colours.accent, t.px(2));
  if (severity == Severity::kWarning)
    return widgets::canvas().AddTriangleFilled({x, y - r}, {x + r, y + r * 0.8F}, {x - r, y + r * 0.8F},
                                               t.colours.notice);
  widgets::canvas().AddRectFilled({x - r, y - r}, {x + r, y + r}, t.colours.bad, t.px(1));
}

void draw_timeline(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area) {
  const widgets::Theme& t = ui.theme;
  PlayerPanel& player = *data.player;
  player::Timeline& timeline = player.timeline();
  widgets::canvas().AddRectFilled(area.min, area.max, t.colours.surface, t.px(8));
  area = area.inset(t.unit(1.25F), 0);
  buttons(ui, timeline, area);
  area.cut_left(t.unit());
  const widgets::Area clock = area.cut_left(t.px(112), t.unit(1.5F));
  widgets::put_text(t.fonts.mono, t.colours.text, {clock.max.x, clock.centre().y - t.px(10)}, widgets::Align::kRight,
                    clock_text(timeline.cursor()).c_str());
  widgets::put_text(t.fonts.mono_small, t.colours.muted, {clock.max.x, clock.centre().y + t.px(13)},
                    widgets::Align::kRight,
                    widgets::shown("of %s", clock_text(player.played().run.last()).c_str()).c_str());
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
                        (std::string(clock_text(row->at).c_str()) + "  " + as_shown(ui, data, row->text)).c_str());
  }
}

// The column beside the screens, and the banner's part, while a recording is played.

namespace {

std::string sides_text(const recording::Head& head) {
  std::string words = head.has_operator && head.has_machine ? "both sides"
                      : head.has_operator                   ? "operator's side only"
                                                            : "machine's side only";
  if (head.imported) words = "imported table";
  if (head.simulated) words += ", simulated";
  if (head.part == 0) words += ", flight record";
  return words;
}

std::string began_text(const recording::Head& head) {
  if (head.virtual_time || head.started_unix_ns == 0) return "on virtual time";
  return utc_text(head.started_unix_ns / 1'000'000'000, "%Y-%m-%d %H:%M:%S UTC");
}

void played_hand_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const OperatorSide& hand = data.view.hand;
  const bool own = data.player->played().head.has_operator;
  const widgets::Card card(ui, own ? "HAND" : "HAND, AS RECEIVED", area,
                           {.heard = !data.view.sensors_alone && !data.player->in_gap()});
  widgets::Area rest = card.inside();
  const std::array<std::pair<const char*, bool>, 3> lamps{
      {{"Presence", hand.presence}, {"Enable", hand.enable}, {"Clutch", hand.clutch}}};
  for (const auto& [label, on] : lamps) widgets::lamp(ui, rest.cut_top(t.px(24), t.px(2)), label, on, t.colours.good);
  if (hand.stop)
    widgets::lamp(ui, rest.cut_top(t.px(24)), "Stop pressed", true, t.colours.bad);
  else if (hand.device)
    widgets::put_lines(t.fonts.small, t.colours.bad, rest, as_shown(ui, data, text(hand.device)).c_str());
}

void recording_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const player::Played& played = data.player->played();
  const widgets::Card card(ui, "RECORDING", area);
  widgets::Area rest = card.inside();
  const auto line = [&](const ImFont* font, ImU32 colour, const std::string& text) {
    widgets::put_fitted(font, colour, rest.cut_top(t.px(21)), text.c_str());
  };
  line(t.fonts.body, t.colours.text, data.facts.machine.name);
  line(t.fonts.mono_small, t.colours.text, std::filesystem::path(played.file).filename().string());
  line(t.fonts.small, t.colours.muted, sides_text(played.head));
  line(t.fonts.small, t.colours.muted, began_text(played.head));
  line(t.fonts.small, t.colours.muted, "version " + played.head.version);
  for (const std::string& note : played.notes) line(t.fonts.small, t.colours.notice, note);
}

double most_difference_deg(const ConsoleView& a, const ConsoleView& b) {
  constexpr double kDegrees = 57.29577951308232;
  return kDegrees * (a.machine.position_rad - b.machine.position_rad).cwiseAbs().maxCoeff();
}

/// Both runs in numbers, and where they part.
void beside_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const Beside& beside = *data.player->beside();
  const widgets::Card card(ui, widgets::shown("BESIDE: %s", beside.name.c_str()).c_str(), area);
  widgets::Area rest = card.inside();
  if (const ConsoleView* other = data.player->beside_view()) {
    const auto row = [&](const char* label, const std::string& words) {
      widgets::value_row(ui, rest.cut_top(t.px(21)), label, words.c_str(), "");
    };
    const widgets::Quantity q = widgets::Quantity::kForce;
    row("Mode", other->link.heard && !other->sensors_alone ? name(other->machine.mode) : "-");
    const bool measured = !measured_freshness(*other).stale();
    const ForceText said = measured ? force_text(*other) : ForceText{};
    const bool carries = measured && payload_is_known(other->machine, data.facts.machine.payload_full_scale_kg);
    row("Force", said.known ? ui.units.text(q, other->machine.tip_force_N.norm()).c_str() : "-");
    row("Contact", !said.known ? "-" : said.contact ? "yes" : "no");
    row("Payload", carries ? ui.units.text(widgets::Quantity::kMass, other->machine.payload_kg).c_str() : "-");
    const JointVector commands = data.view.status.valve_command - other->status.valve_command;
    const bool both = data.view.status_of_steps && other->status_of_steps;
    row("Commands apart", both ? widgets::shown("%.1f %%", 100 * commands.cwiseAbs().maxCoeff()).c_str() : "-");
    const bool both_measured = measured && !measured_freshness(data.view).stale();
    row("Joints apart",
        both_measured ? widgets::shown("%.2f deg", most_difference_deg(data.view, *other)).c_str() : "-");
  } else {
    widgets::put_text(t.fonts.small, t.colours.muted, rest.cut_top(t.px(21)).centre(), widgets::Align::kCentre,
                      "not at this time");
  }
  rest.cut_top(t.px(4));
  std::string words;
  for (const std::string& line : beside.differs) words += (words.empty() ? "" : "\n") + line;
  widgets::put_lines(t.fonts.small, beside.differs_at ? t.colours.text : t.colours.muted, rest,
                     ui.units.as_shown(words).c_str());
}

void keys_card(const widgets::Ui& ui, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "KEYS", area);
  widgets::Area rest = card.inside();
  for (const KeyBinding& binding : kPlayerKeys) {
    if (*binding.keys == '\0') continue;
    if (rest.height() < t.px(21)) return;  // the help has them all
    widgets::Area row = rest.cut_top(t.px(21));
    const widgets::Area key = row.cut_left(t.px(62));
    widgets::put_text(t.fonts.mono_small, t.colours.accent, {key.min.x, key.centre().y}, widgets::Align::kLeft,
                      binding.keys);
    widgets::put_fitted(t.fonts.small, t.colours.muted, row, binding.what);
  }
}

}  // namespace

void draw_player_column(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area) {
  const widgets::Theme& t = ui.theme;
  const float gap = t.px(10);
  played_hand_card(ui, data, area.cut_top(t.px(146), gap));
  const float notes = 21.F * static_cast<float>(std::min<std::size_t>(data.player->played().notes.size(), 2));
  recording_card(ui, data, area.cut_top(t.px(144 + notes), gap));
  if (data.player->beside())
    beside_card(ui, data, area);
  else
    keys_card(ui, area);
}

void draw_replay_block(const widgets::Ui& ui, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const ImU32 fill = t.colours.notice, on = widgets::text_on(fill);
  widgets::canvas().AddRectFilled(area.min, area.max, fill, t.px(8));
  widgets::put_text(t.fonts.display, on, {area.centre().x, area.centre().y - t.px(9)}, widgets::Align::kCentre,
                    "REPLAY");
  widgets::put_text(t.fonts.small, on, {area.centre().x, area.centre().y + t.px(20)}, widgets::Align::kCentre,
                    "nothing is sent");
}

std::string replay_reason(const ConsoleView& view, const PlayerPanel& player) {
  if (player.in_gap()) return "nothing was recorded here";
  if (view.sensors_alone) return "what the sensors of the table said; it tells nothing of modes, limits and force";
  if (!view.link.heard) return "nothing had been received from the machine's side yet";
  if (machine_freshness(view).stale())
    return std::string("nothing received from the machine for ") + widgets::shown_duration(view.link.silence_s).c_str();
  const std::string stop = view.hand.stop ? "Stop is pressed" : "";
  const std::string why = view.machine.fault                    ? text(view.machine.fault)
                          : view.machine.blocking               ? text(view.machine.blocking)
                          : view.machine.mode == Mode::kEngaged ? "the machine follows the hand"
                                                                : "";
  return stop.empty() || why.empty() ? stop + why : stop + "; " + why;
}

}  // namespace knuckle::console::screens
