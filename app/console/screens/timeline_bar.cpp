#include <fmt/format.h>

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
#include "machine/reason_text.h"

namespace knuckle::console::screens {
namespace {

float x_of(const player::Timeline& timeline, const Area& track, Time at) {
  return track.min.x + static_cast<float>(timeline.share(at)) * track.width();
}

/// "12.345", "1:02:12.345"
std::string clock_text(Time at) {
  const double s = to_seconds(at);
  const auto whole = static_cast<long>(std::floor(s));
  if (whole < 60) return fmt::format("{:.3f} s", s);
  const double rest = s - static_cast<double>(whole - whole % 60);
  if (whole < 3600) return fmt::format("{}:{:06.3f}", whole / 60, rest);
  return fmt::format("{}:{:02}:{:06.3f}", whole / 3600, whole / 60 % 60, rest);
}

void buttons(const Ui& ui, player::Timeline& timeline, Area& area) {
  const Theme& t = ui.theme;
  const auto press = [&](Icon icon, const char* id) {
    return button(ui, area.cut_left(t.px(34), t.px(4)).inset(0, t.px(9)), icon, id);
  };
  if (press(Icon::kEventBack, "##event_back")) timeline.jump(false);
  if (press(Icon::kStepBack, "##step_back")) timeline.step(false);
  const bool playing = timeline.playing();
  if (button(ui, area.cut_left(t.px(44), t.px(4)).inset(0, t.px(6)), playing ? Icon::kPause : Icon::kPlay, "##play",
             playing))
    timeline.toggle();
  if (press(Icon::kStepOn, "##step_on")) timeline.step(true);
  if (press(Icon::kEventOn, "##event_on")) timeline.jump(true);
  area.cut_left(t.px(4));
  const auto speed = [&](const char* label) {
    return button(ui, area.cut_left(t.px(28), t.px(2)).inset(0, t.px(11)), Icon::kNone, label);
  };
  if (speed("-##slower")) timeline.slower();
  put_text(t.fonts.mono_small, t.colours.text, area.cut_left(t.px(46), t.px(2)), Align::kCentre,
           fmt::format("{:g}x", timeline.speed()));
  if (speed("+##faster")) timeline.faster();
}

/// The machine's modes, by colour and, where there is room, by name.
void mode_band(const Ui& ui, const PlayerPanel& player, const Area& track, const Area& band) {
  const Theme& t = ui.theme;
  const auto& modes = player.played().run.modes();
  canvas().AddRectFilled(band.min, band.max, t.colours.raised, t.px(3));
  for (std::size_t i = 0; i < modes.size(); ++i) {
    const float from = x_of(player.timeline(), track, modes[i].from);
    const float to = i + 1 < modes.size() ? x_of(player.timeline(), track, modes[i + 1].from) : track.max.x;
    const ImU32 fill = t.mode_colour(modes[i].mode);
    canvas().AddRectFilled({from, band.min.y}, {std::max(to, from + 1), band.max.y}, fill);
    const char* word = look_of(modes[i].mode).word;
    if (text_width(t.fonts.small, word) + t.unit() < to - from)
      put_text(t.fonts.small, text_on(fill), {(from + to) / 2, band.centre().y}, Align::kCentre, word);
  }
  for (const player::Gap& gap : player.played().run.gaps()) {
    const float from = x_of(player.timeline(), track, gap.from);
    const float to = std::max(x_of(player.timeline(), track, gap.to), from + t.px(3));
    canvas().AddRectFilled({from, track.min.y}, {to, track.max.y}, t.colours.background);
    hatch(ui, {{from, track.min.y}, {to, track.max.y}}, t.colours.muted, 1);
  }
}

void marks(const Ui& ui, const PlayerPanel& player, const Area& track, const Area& lane) {
  const Theme& t = ui.theme;
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

void cursor_line(const Ui& ui, const player::Timeline& timeline, const Area& track) {
  const Theme& t = ui.theme;
  const float x = x_of(timeline, track, timeline.cursor()), r = t.px(6);
  canvas().AddLine({x, track.min.y}, {x, track.max.y}, t.colours.text, t.px(2));
  canvas().AddTriangleFilled({x - r, track.min.y - t.px(2)}, {x + r, track.min.y - t.px(2)}, {x, track.min.y + r},
                             t.colours.text);
}

}  // namespace

ImU32 severity_colour(const Theme& theme, Severity severity) noexcept {
  return std::array{theme.colours.accent, theme.colours.notice, theme.colours.bad}[static_cast<std::size_t>(severity)];
}

void event_mark(const Theme& theme, Severity severity, float x, const Area& lane) {
  const float y = lane.centre().y, r = theme.px(6);
  const ImU32 colour = severity_colour(theme, severity);
  if (severity == Severity::kInfo)
    return canvas().AddLine({x, y - theme.px(4)}, {x, y + theme.px(4)}, colour, theme.px(2));
  if (severity == Severity::kWarning)
    return canvas().AddTriangleFilled({x, y - r}, {x + r, y + r * 0.8F}, {x - r, y + r * 0.8F}, colour);
  canvas().AddRectFilled({x - r, y - r}, {x + r, y + r}, colour, theme.px(1));
}

void draw_timeline(const Ui& ui, const ConsoleData& data, Area area) {
  const Theme& t = ui.theme;
  PlayerPanel& player = *data.player;
  player::Timeline& timeline = player.timeline();
  canvas().AddRectFilled(area.min, area.max, t.colours.surface, t.px(8));
  area = area.inset(t.unit(1.25F), 0);
  buttons(ui, timeline, area);
  area.cut_left(t.unit());
  const Area clock = area.cut_left(t.px(112), t.unit(1.5F));
  put_text(t.fonts.mono, t.colours.text, {clock.max.x, clock.centre().y - t.px(10)}, Align::kRight,
           clock_text(timeline.cursor()));
  put_text(t.fonts.mono_small, t.colours.muted, {clock.max.x, clock.centre().y + t.px(13)}, Align::kRight,
           fmt::format("of {}", clock_text(player.played().run.last())));
  const Area above = area.cut_top(t.px(24));
  const Area track = area.inset(0, t.px(4));
  pointer_area("timeline", track);
  const auto at_mouse = [&] {
    return timeline.at_share(static_cast<double>((ImGui::GetIO().MousePos.x - track.min.x) / track.width()));
  };
  if (ImGui::IsItemActive()) timeline.seek(at_mouse());
  Area rest = track;
  const Area band = rest.cut_bottom(t.px(18), t.px(2));
  mode_band(ui, player, track, band);
  marks(ui, player, track, rest);
  cursor_line(ui, timeline, track);
  const bool hovers = ImGui::IsItemHovered();
  if (const EventRow* row = event_at(player.events(), player.view().run, hovers ? at_mouse() : timeline.cursor())) {
    const ImU32 colour = row->severity == Severity::kInfo ? t.colours.muted : severity_colour(t, row->severity);
    put_fitted(t.fonts.small, colour, above, clock_text(row->at) + "  " + ui.units.as_shown(row->text));
  }
}

// The column beside the screens, and the banner's part, while a recording is played.

namespace {

std::string sides_text(const recording::Head& head) {
  std::string text = head.has_operator && head.has_machine ? "both sides"
                     : head.has_operator                   ? "operator's side only"
                                                           : "machine's side only";
  if (head.imported) text = "imported table";
  if (head.simulated) text += ", simulated";
  if (head.part == 0) text += ", flight record";
  return text;
}

std::string began_text(const recording::Head& head) {
  if (head.virtual_time || head.started_unix_ns == 0) return "on virtual time";
  return utc_text(head.started_unix_ns / 1'000'000'000, "%Y-%m-%d %H:%M:%S UTC");
}

void played_hand_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const OperatorSide& hand = data.view.hand;
  const bool own = data.player->played().head.has_operator;
  const Card card(ui, own ? "HAND" : "HAND, AS RECEIVED", area,
                  {.heard = !data.view.sensors_alone && !data.player->in_gap()});
  Area rest = card.inside();
  const std::array<std::pair<const char*, bool>, 3> lamps{
      {{"Presence", hand.presence}, {"Enable", hand.enable}, {"Clutch", hand.clutch}}};
  for (const auto& [label, on] : lamps) lamp(ui, rest.cut_top(t.px(24), t.px(2)), label, on, t.colours.good);
  if (hand.stop)
    lamp(ui, rest.cut_top(t.px(24)), "Stop pressed", true, t.colours.bad);
  else if (hand.device)
    put_lines(t.fonts.small, t.colours.bad, rest, ui.units.as_shown(text(hand.device)));
}

void recording_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const player::Played& played = data.player->played();
  const Card card(ui, "RECORDING", area);
  Area rest = card.inside();
  const auto line = [&](const ImFont* font, ImU32 colour, const std::string& text) {
    put_fitted(font, colour, rest.cut_top(t.px(21)), text);
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
void beside_card(const Ui& ui, const ConsoleData& data, const Area& area) {
  const Theme& t = ui.theme;
  const Beside& beside = *data.player->beside();
  const Card card(ui, fmt::format("BESIDE: {}", beside.name), area);
  Area rest = card.inside();
  if (const ConsoleView* other = data.player->beside_view()) {
    const auto row = [&](const char* label, const std::string& text) {
      value_row(ui, rest.cut_top(t.px(21)), label, text, "");
    };
    const Quantity q = Quantity::kForce;
    row("Mode", other->link.heard && !other->sensors_alone ? name(other->machine.mode) : "-");
    const bool measured = !measured_freshness(*other).stale();
    const ForceText said = measured ? force_text(*other) : ForceText{};
    const bool carries = measured && payload_is_known(other->machine, data.facts.machine.payload_full_scale_kg);
    row("Force", said.known ? ui.units.text(q, other->machine.tip_force_N.norm()) : "-");
    row("Contact", !said.known ? "-" : said.contact ? "yes" : "no");
    row("Payload", carries ? ui.units.text(Quantity::kMass, other->machine.payload_kg) : "-");
    const JointVector commands = data.view.status.valve_command - other->status.valve_command;
    const bool both = data.view.status_of_steps && other->status_of_steps;
    row("Commands apart", both ? fmt::format("{:.1f} %", 100 * commands.cwiseAbs().maxCoeff()) : "-");
    const bool both_measured = measured && !measured_freshness(data.view).stale();
    row("Joints apart", both_measured ? fmt::format("{:.2f} deg", most_difference_deg(data.view, *other)) : "-");
  } else {
    put_text(t.fonts.small, t.colours.muted, rest.cut_top(t.px(21)).centre(), Align::kCentre, "not at this time");
  }
  rest.cut_top(t.px(4));
  std::string text;
  for (const std::string& line : beside.differs) text += (text.empty() ? "" : "\n") + line;
  put_lines(t.fonts.small, beside.differs_at ? t.colours.text : t.colours.muted, rest, ui.units.as_shown(text));
}

void keys_card(const Ui& ui, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "KEYS", area);
  Area rest = card.inside();
  for (const KeyBinding& binding : kPlayerKeys) {
    if (*binding.keys == '\0') continue;
    if (rest.height() < t.px(21)) return;  // the help has them all
    Area row = rest.cut_top(t.px(21));
    const Area key = row.cut_left(t.px(62));
    put_text(t.fonts.mono_small, t.colours.accent, key, Align::kLeft, binding.keys);
    put_fitted(t.fonts.small, t.colours.muted, row, binding.what);
  }
}

}  // namespace

void draw_player_column(const Ui& ui, const ConsoleData& data, Area area) {
  const Theme& t = ui.theme;
  const float gap = t.px(10);
  played_hand_card(ui, data, area.cut_top(t.px(146), gap));
  const float notes = 21.F * static_cast<float>(std::min<std::size_t>(data.player->played().notes.size(), 2));
  recording_card(ui, data, area.cut_top(t.px(144 + notes), gap));
  if (data.player->beside())
    beside_card(ui, data, area);
  else
    keys_card(ui, area);
}

void draw_replay_block(const Ui& ui, const Area& area) {
  const Theme& t = ui.theme;
  const ImU32 fill = t.colours.notice, on = text_on(fill);
  canvas().AddRectFilled(area.min, area.max, fill, t.px(8));
  put_text(t.fonts.display, on, {area.centre().x, area.centre().y - t.px(9)}, Align::kCentre, "REPLAY");
  put_text(t.fonts.small, on, {area.centre().x, area.centre().y + t.px(20)}, Align::kCentre, "nothing is sent");
}

std::string replay_reason(const ConsoleView& view, const PlayerPanel& player, const BusDescription& bus) {
  if (player.in_gap()) return "nothing was recorded here";
  if (view.sensors_alone) return "what the sensors of the table said; it tells nothing of modes, limits and force";
  if (!view.link.heard) return "nothing had been received from the machine's side yet";
  if (machine_freshness(view).stale())
    return std::string("nothing received from the machine for ") + shown_duration(view.link.silence_s);
  const std::string stop = view.hand.stop ? "Stop is pressed" : "";
  const std::string why = view.machine.fault                    ? text(view.machine.fault, bus)
                          : view.machine.blocking               ? text(view.machine.blocking, bus)
                          : view.machine.mode == Mode::kEngaged ? "the machine follows the hand"
                                                                : "";
  return stop.empty() || why.empty() ? stop + why : stop + "; " + why;
}

}  // namespace knuckle::console::screens
