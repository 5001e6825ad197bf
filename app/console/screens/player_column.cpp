// The column beside the screens, and the banner's part, while a recording is played.
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>

#include "app/console/keys.h"
#include "app/console/machine_words.h"
#include "app/console/screens/player_panel.h"
#include "app/console/screens/timeline_bar.h"
#include "core/text.h"

namespace knuckle::console::screens {
namespace {

ImDrawList& canvas() {
  return *ImGui::GetWindowDrawList();
}

std::string sides_words(const recording::Head& head) {
  std::string words = head.has_operator && head.has_machine ? "both sides"
                      : head.has_operator                   ? "operator's side only"
                                                            : "machine's side only";
  if (head.imported) words = "imported table";
  if (head.simulated) words += ", simulated";
  if (head.part == 0) words += ", flight record";
  return words;
}

std::string began_words(const recording::Head& head) {
  if (head.virtual_time || head.started_unix_ns == 0) return "on virtual time";
  return utc_text(head.started_unix_ns / 1'000'000'000, "%Y-%m-%d %H:%M:%S UTC");
}

void hand_card(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
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
    widgets::put_lines(t.fonts.small, t.colours.bad, rest, in_words(ui, data, text(hand.device)).c_str());
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
  line(t.fonts.small, t.colours.muted, sides_words(played.head));
  line(t.fonts.small, t.colours.muted, began_words(played.head));
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
    const ForceWords said = measured ? force_words(*other) : ForceWords{};
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
                     ui.units.in_words(words).c_str());
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
  hand_card(ui, data, area.cut_top(t.px(146), gap));
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
  canvas().AddRectFilled(area.min, area.max, fill, t.px(8));
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
