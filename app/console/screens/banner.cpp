#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "app/console/link_watch.h"
#include "app/console/machine_text.h"
#include "app/console/screens/player_panel.h"
#include "app/console/screens/screens.h"
#include "machine/reason_text.h"
#include "slave/loss_policy.h"

namespace knuckle::console::screens {
namespace {

/// What the block on the left says.
struct Headline {
  std::string word, below;
  Icon icon = Icon::kLink;
  ImU32 fill = 0;
  bool alarm = false;  ///< Flashes.
  ImU32 edge = 0;      ///< Of a frame around it; 0: none.
};

/// What else there is to know of a machine in this mode.
void add_notes(const Ui& ui, const ConsoleView& view, const JointLoads& loads, Headline& says) {
  const std::string presses = still_pressing(view, loads), own_end = shut_in(view, loads);
  if (!presses.empty()) {
    // The fullest cylinder alone; the reason beside it has them all.
    const bool by_oil = presses.starts_with("still pressing");
    says.below = by_oil ? presses.substr(0, presses.find(',')) : "still pressing";
    if (view.machine.mode == Mode::kReady) says.icon = Icon::kWarning;  // a tick would say that all is well
    says.edge = ui.theme.colours.notice;
  } else if (!own_end.empty()) {
    says.below = own_end;
  } else if (view.machine.home_on_two) {
    says.below = "home on two";
    says.edge = ui.theme.colours.notice;
  } else if (const LessFelt less = less_felt(view); !less.brief.empty()) {
    says.below = less.brief;
    says.edge = ui.theme.colours.notice;
  }
}

/// What a person has asked for here that the mode does not show.
struct Asked {
  bool blocked = false;  ///< Something is to be done before enable counts.
  bool stop = false;     ///< Stop is pressed.
};

Headline headline(const Ui& ui, const ConsoleView& view, const JointLoads& loads, bool recorded, const Asked& asked) {
  const Palette& c = ui.theme.colours;
  const Freshness fresh = machine_freshness(view).after(ui.view_age_s);
  const Mode mode = view.machine.mode;
  const std::string age = shown_duration(fresh.age_s);
  if (!recorded) return {"NO DATA", "not recorded", Icon::kRing, c.raised, false};
  if (view.sensors_alone) return {"SENSORS", "imported table", Icon::kRing, c.raised, false};
  if (!fresh.heard) return {"NO LINK", "", Icon::kLink, c.raised, false};
  // It reports OFF only as it starts and in its last message: nothing is lost then.
  if (fresh.stale() && mode == Mode::kOff) return {"OFF", age + " old", look_of(mode).icon, c.raised, false};
  // An old mode is no mode.
  const std::string was = std::string("was ") + look_of(mode).word + ", " + age + " old";
  if (ui.loop_silent()) return {"CONSOLE HANGS", was, Icon::kWarning, c.stop, true};
  if (fresh.stale()) return {"LINK LOST", was, Icon::kLink, c.stop, true};
  Headline says{look_of(mode).word, "", look_of(mode).icon, ui.theme.mode_colour(mode),
                mode == Mode::kFault || mode == Mode::kEStop};
  // Nothing is broken, so that it does not flash; but nothing else that stands still is as loud.
  if (stopped(view)) says = {"STOPPED", "", Icon::kStop, c.stop, false};
  // The machine is ready, but not for whoever is here.
  if (mode == Mode::kReady && asked.blocked)
    says = {look_of(mode).word, "not led from here yet", Icon::kHand, c.notice, false};
  add_notes(ui, view, loads, says);
  if (stopped(view)) says.edge = c.stop_text;
  if (asked.stop && led(mode)) {  // not confirmed yet
    says.below = "Stop is pressed";
    says.edge = c.notice;
  }
  return says;
}

/// @param recorded false: a hole in the recording that is played.
void mode_block(const Ui& ui, const ConsoleView& view, const JointLoads& loads, bool recorded, const Asked& asked,
                const Area& area) {
  const Theme& t = ui.theme;
  ImDrawList& list = canvas();
  const Headline says = headline(ui, view, loads, recorded, asked);
  const ImU32 on = says.fill == t.colours.raised ? t.colours.muted : text_on(says.fill);
  list.AddRectFilled(area.min, area.max, says.fill, t.px(8));
  if (says.alarm && !ui.steady && std::fmod(ui.now_s, 1.0) < 0.5)
    list.AddRect({area.min.x + t.px(3), area.min.y + t.px(3)}, {area.max.x - t.px(3), area.max.y - t.px(3)}, on,
                 t.px(6), 0, t.px(3));
  if (says.edge != 0) {
    const float half = t.px(2.5F);
    list.AddRect({area.min.x + half, area.min.y + half}, {area.max.x - half, area.max.y - half}, says.edge, t.px(7), 0,
                 2 * half);
  }
  draw_icon(list, says.icon, {area.min.x + t.px(38), area.centre().y}, t.px(34), on);
  const float x = area.min.x + t.px(70), y = area.centre().y;
  if (says.below.empty()) return put_text(t.fonts.display, on, {x, y}, Align::kLeft, says.word);
  put_text(t.fonts.title, on, {x, y - t.px(10)}, Align::kLeft, says.word);
  put_text(t.fonts.mono_small, on, {x, y + t.px(14)}, Align::kLeft, ui.units.as_shown(says.below));
}

struct Tag {
  Icon icon;
  std::string text;
  ImU32 fill;              ///< 0: none, a small mark.
  bool to_accept = false;  ///< Until it is pressed.
};

/// From the right: how good the link is, and what this session is.
std::vector<Tag> session_tags(const Ui& ui, const ConsoleView& view, const UiState& state) {
  const Theme& t = ui.theme;
  std::vector<Tag> tags;
  const ImU32 quiet = mix(t.colours.surface, t.colours.border, 0.6F);
  if (const auto link = link_verdict(view.link, ui.view_age_s)) {
    const ImU32 fill = link->quality == LinkQuality::kGood   ? quiet
                       : link->quality == LinkQuality::kFair ? t.colours.notice
                                                             : t.colours.stop;
    tags.push_back({Icon::kLink, std::string("link ") + name(link->quality) + ": " + link->text, fill});
  }
  // What is seen all day is seen no more: a person accepts it, once for each machine.
  const bool accepted = state.accepted_uncalibrated == view.status.machine.text();
  if (view.status_heard && !view.status.calibrated && accepted)
    tags.push_back({Icon::kNone, "uncalibrated", 0});
  else if (view.status_heard && !view.status.calibrated)
    tags.push_back({Icon::kWarning, "UNCALIBRATED: OK?", t.colours.notice, true});
  if (view.simulated || (view.status_heard && view.status.simulated))
    tags.push_back({Icon::kCircle, "SIMULATED", mix(t.colours.surface, t.colours.accent, 0.35F)});
  if (view.machine.home_on_two) tags.push_back({Icon::kWarning, "HOME ON TWO", t.colours.notice});
  if (view.paused) tags.push_back({Icon::kPause, "PAUSED", t.colours.notice});
  if (state.muted)
    tags.push_back({Icon::kNone, "SOUND OFF", quiet});
  else if (!state.sound_problem.empty())
    tags.push_back({Icon::kWarning, "NO SOUND", t.colours.notice});
  return tags;
}

/// @return whether it was pressed.
bool put_tag(const Ui& ui, const Tag& tag, const Area& place) {
  const Theme& t = ui.theme;
  const float y = place.centre().y;
  if (tag.fill == 0) {
    put_text(t.fonts.small, t.colours.muted, place.centre(), Align::kCentre, tag.text);
    return false;
  }
  chip(ui, {place.min.x, y}, tag.icon, tag.text, tag.fill);
  if (!tag.to_accept || place.width() < 1 || place.height() < 1) return false;
  const Area pressed{{place.min.x, y - t.px(14)}, {place.max.x, y + t.px(14)}};
  ImGui::SetCursorScreenPos(pressed.min);
  const bool accepts = ImGui::InvisibleButton(tag.text.c_str(), pressed.size());
  focus_ring(ui, pressed, t.px(14));
  return accepts;
}

/// In a row that ends at the area's right. @return how many have room there.
std::size_t put_tags(const Ui& ui, const ConsoleView& view, std::span<const Tag> tags, UiState& state, Area& area) {
  std::size_t count = 0;
  for (const Tag& tag : tags) {
    const float width = chip_width(ui, tag.text);
    if (width > area.width()) break;
    if (put_tag(ui, tag, area.cut_right(width, ui.theme.unit())))
      state.accepted_uncalibrated = view.status.machine.text();
    ++count;
  }
  return count;
}

using State = RecordingLight::State;
constexpr std::uint64_t kLittle_bytes = 2'000'000'000;  // a few hours of one program's recording

constexpr float kLightIcon_px = 22;  // of the design

float recording_width(const Ui& ui, const RecordingText& text) {
  const Theme& t = ui.theme;
  const float light = t.px(kLightIcon_px) + text_width(t.fonts.mono_small, text.light);
  if (text.note.empty()) return light;
  return light + t.unit() + text_width(t.fonts.small, text.note);
}

/// Ends with "..." where the area is too narrow.
void draw_recording(const Ui& ui, const RecordingLight& light, const RecordingText& text, const Area& area) {
  const Theme& t = ui.theme;
  const Palette& c = t.colours;
  const bool amiss = light.state == State::kStopped || (light.state == State::kOff && light.real);
  const Icon icon = light.state == State::kOn        ? Icon::kDot
                    : light.state == State::kStopped ? Icon::kWarning
                                                     : Icon::kRing;
  const ImU32 colour = light.state == State::kOn ? c.stop : amiss ? c.notice : c.muted;
  Area rest = area;
  const Area place = rest.cut_left(t.px(kLightIcon_px));
  draw_icon(canvas(), icon, {place.min.x + t.px(8), place.centre().y}, t.px(14), colour);
  const ImU32 text_colour = light.state == State::kOn ? c.text : colour;
  const float wide = text_width(t.fonts.mono_small, text.light);
  put_fitted(t.fonts.mono_small, text_colour, rest.cut_left(std::min(wide + 1, rest.width()), t.unit()), text.light);
  if (text.note.empty() || rest.width() <= 0) return;
  const bool noted = light.steps_lost > 0 || light.free_bytes < kLittle_bytes;
  put_fitted(t.fonts.small, noted ? c.notice : c.muted, rest, text.note);
}

/// On the right: tags above, the light of the recording below, and beside it the tags that have no room above.
void draw_tags(const Ui& ui, const ConsoleData& data, UiState& state, Area& area) {
  const Theme& t = ui.theme;
  constexpr float kMostShare = 0.5F;  // of the banner; the line that says what to do needs the rest
  const std::vector<Tag> tags = session_tags(ui, data.view, state);
  if (data.player != nullptr) return (void)put_tags(ui, data.view, tags, state, area);
  const RecordingText text = recording_text(data.recording, to_seconds(data.view.now));
  const float most = kMostShare * area.width();
  float all = 0;
  for (const Tag& tag : tags) all += chip_width(ui, tag.text) + t.unit();
  const float light = std::min(recording_width(ui, text) + t.unit(), all > most ? most / 2 : most);
  Area block = area.cut_right(std::min(most, std::max(all, light)), t.unit()).inset(0, t.px(5));
  Area upper = block.cut_top(block.height() / 2);
  const std::size_t above = put_tags(ui, data.view, tags, state, upper);
  draw_recording(ui, data.recording, text, block.cut_right(light, t.unit()));
  (void)put_tags(ui, data.view, std::span(tags).subspan(above), state, block);
}

/// What keeps this console from knowing how the machine is; nothing where it does.
struct Silence {
  std::string what, remedy;
};

/// Of a machine that is not heard: what it may do meanwhile, and how it does not (docs/safety.md, Link).
std::string unheard_remedy(const ConsoleView& view, double silence_s) {
  constexpr double kValvesClose_s = 0.15;
  const SlaveMessage& m = view.machine;
  const ReasonCode code = m.blocking.code;
  const bool waits = code == ReasonCode::kEnableHeld || code == ReasonCode::kReleaseToRecover;
  if (!view.hand.enable || !(led(m.mode) || (m.mode == Mode::kReady && !waits))) return "check the network";
  const std::string instead = view.led_by_scenario ? "press Stop" : "let go of enable";
  // Our messages may still arrive; without an answer to its own the machine holds.
  const double follows_s = to_seconds(slave::kLossLimits.max_round_trip);
  if (silence_s < follows_s + kValvesClose_s)
    return fmt::format("the machine may still follow for {:.1f} s and may go on when the link returns: {}", follows_s,
                       instead);
  return "the machine no longer follows, but may go on when the link returns: " + instead;
}

Silence silence(const ConsoleView& view, double view_age_s) {
  if (view_age_s > kLoopSilent_s)
    return {"this console's own loop has not run for " + shown_duration(view_age_s),
            "close the console and start it again"};
  if (!view.link.heard)
    return {"nothing received from the machine's side yet", "check that it runs and does not serve another operator"};
  const Freshness fresh = machine_freshness(view).after(view_age_s);
  // It reports OFF only as it starts and in its last message.
  if (fresh.stale() && view.machine.mode == Mode::kOff)
    return {"the machine's side has ended, " + shown_duration(fresh.age_s) + " ago", "start it again to continue"};
  if (fresh.stale())
    return {"nothing received from the machine for " + shown_duration(fresh.age_s), unheard_remedy(view, fresh.age_s)};
  return {};
}

/// What enable was dropped for; nullptr: it was not.
const char* dropped_text(Dropped dropped) {
  static constexpr std::array<const char*, 5> kTexts{nullptr, "this window had no focus", "this window was too small",
                                                     "this window stalled", "the session began anew"};
  static_assert(kTexts.size() == static_cast<std::size_t>(Dropped::kNewStart) + 1);
  return kTexts[static_cast<std::size_t>(dropped)];
}

std::string press_again(const std::string& why, HandSource hand) {
  const char* enable = hand == HandSource::kKeyboard  ? "Shift (enable)"
                       : hand == HandSource::kGamepad ? "the right bumper (enable)"
                                                      : "enable";
  return why + ": let go of " + enable + ", then press it again";
}

/// Why the machine does not follow, in terms of what this person has in hand.
std::string blocking_text(const ConsoleView& view, const BusDescription& bus, HandSource hand) {
  const ReasonCode code = view.machine.blocking.code;
  const bool waits = code == ReasonCode::kNoPresence || code == ReasonCode::kEnableNotPressed;
  if (const char* dropped = dropped_text(view.input.dropped); waits && dropped != nullptr)
    return press_again(dropped, hand);
  if (waits && view.led_by_scenario) return "the scenario's operator does not hold the device yet";
  return reason_text(view.machine.blocking, bus, hand);
}

/// What is to be known of a machine that is led: why it does not move, or what of its force is not felt.
std::vector<std::string> led_notes(const ConsoleView& view, const JointLoads& loads) {
  std::vector<std::string> notes;
  for (const std::string& end : end_texts(loads)) notes.push_back(end + ", move it the other way");
  if (const BlindPress press = blind_press(view, loads); !press.text.empty())
    notes.push_back(press.text);
  else if (const LessFelt less = less_felt(view); !less.text.empty())
    notes.push_back(less.text);
  return notes;
}

/// While it is led.
std::string following(const ConsoleView& view, const JointLoads& loads, const std::string& limited) {
  const std::string follows =
      view.led_by_scenario ? "the machine follows the scenario's operator" : "the machine follows the hand";
  const std::vector<std::string> notes = led_notes(view, loads);
  std::string text = limited.empty() ? follows : limited;
  for (const std::string& note : notes) text += "; " + note;
  return notes.empty() && limited.empty() && !view.led_by_scenario ? text + "; letting go of enable stops it" : text;
}

/// Of what grew old while this console did not run: that.
std::string cause_text(const ConsoleView& view, const Reason& reason, const BusDescription& bus) {
  const bool of_age = reason.code == ReasonCode::kDeviceStale || reason.code == ReasonCode::kLinkLost;
  return of_age && view.input.own_pause_s > 0 ? own_pause_text(view.input.own_pause_s) : text(reason, bus);
}

constexpr const char* kTooEarly = "enable was held too early";

/// What there is to do now, or nothing.
std::string what_blocks(const ConsoleView& view, const AtWindow& person, const JointLoads& loads,
                        const BusDescription& bus) {
  if (view.hand.device) return cause_text(view, view.hand.device, bus);
  if (view.input.unattended) return "this window does not have the keyboard focus: click into it to lead the machine";
  if (view.input.release_enable) {
    const char* dropped = dropped_text(view.input.dropped);
    return press_again(dropped != nullptr ? dropped : kTooEarly, person.hand);
  }
  if (person.typing && person.enable_ignored)
    return "enable is ignored while a text field is active: leave the field first";
  if (person.enable_ignored || person.pad_ignored) return press_again(kTooEarly, person.hand);
  if (person.pull_ignored) return "the picture has changed: let go of the mouse button, then press it again";
  const std::string blocks = view.machine.blocking ? blocking_text(view, bus, person.hand) : "";
  return view.machine.mode == Mode::kEngaged ? following(view, loads, blocks) : blocks;
}

/// Held for as long as the operator's loop wants it, which fills it.
void home_button(const Ui& ui, const ConsoleView& view, UiState& state, const Area& area) {
  const Theme& t = ui.theme;
  (void)button(ui, area, Icon::kNone, "Home on two: hold");
  state.home = ImGui::IsItemActive();
  const Area filled = area.inset(t.px(4), 0);
  bar(ui, {{filled.min.x, area.max.y - t.px(8)}, {filled.max.x, area.max.y - t.px(4)}}, 0,
      static_cast<float>(view.hand.home_asked), t.colours.notice);
}

/// In the largest type in which all of it has room: one large line, else smaller ones.
void draw_reason(const Ui& ui, const Area& area, const std::string& reason) {
  const Theme& t = ui.theme;
  if (text_width(t.fonts.title, reason) <= area.width())
    return put_text(t.fonts.title, t.colours.text, area, Align::kLeft, reason);
  const auto height = [&](const ImFont* font) { return text_height(font, area.width(), reason); };
  const ImFont* font = height(t.fonts.body) <= area.height() ? t.fonts.body : t.fonts.small;
  const float spare = std::max(0.F, area.height() - height(font));
  put_lines(font, t.colours.text, area.inset(0, spare / 2), reason);
}

}  // namespace

RecordingText recording_text(const RecordingLight& light, double elapsed_s) {
  RecordingText text;
  const auto append = [&text](const std::string& more) { text.note += (text.note.empty() ? "" : ", ") + more; };
  if (light.state == State::kOff) {
    text.light = "NOT RECORDED";
  } else if (light.state == State::kStopped) {
    text.light = "REC STOPPED: " + light.why;
  } else {
    const auto s = static_cast<long>(std::clamp(elapsed_s, 0.0, 1e9));
    text.light = fmt::format("REC {}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
    if (light.free_bytes > 0) append(fmt::format("{:.1f} GB free", 1e-9 * static_cast<double>(light.free_bytes)));
  }
  if (light.steps_lost > 0) append(std::to_string(light.steps_lost) + " steps lost");
  return text;
}

const ModeLook& look_of(Mode mode) noexcept {
  static constexpr auto kLooks = std::to_array<ModeLook>({{"OFF", Icon::kRing},
                                                          {"SELF-TEST", Icon::kWrench},
                                                          {"READY", Icon::kCheck},
                                                          {"ALIGNING", Icon::kHand},
                                                          {"ENGAGED", Icon::kArm},
                                                          {"HOLD", Icon::kPause},
                                                          {"FAULT", Icon::kWarning},
                                                          {"E-STOP", Icon::kStop}});
  static_assert(kLooks.size() == number_of_words(Mode{}));
  return kLooks[static_cast<std::size_t>(mode)];
}

std::string banner_reason(const ConsoleView& view, bool stop, double view_age_s, const AtWindow& person,
                          const JointLoads& loads, const BusDescription& bus) {
  const Silence unheard = silence(view, view_age_s);
  // Who has pressed Stop must know whether it came through.
  if (stop && !unheard.what.empty())
    return "Stop is pressed, but " + unheard.what + ": do not rely on it, use the machine's own E-stop";
  const bool paused = view.paused && view_age_s <= kLoopSilent_s;
  // A machine that received it says so, or has stopped for another reason.
  const SlaveMessage& m = view.machine;
  const bool confirmed = m.fault.code == ReasonCode::kOperatorStop || m.blocking.code == ReasonCode::kOperatorStop;
  const bool unconfirmed = !confirmed && m.mode != Mode::kFault && m.mode != Mode::kEStop;
  if (stop && paused && unconfirmed) return "Stop is pressed; it acts when the session resumes: press P";
  if (stop && unconfirmed) return "Stop is pressed; the machine has not confirmed it yet";
  std::string pushing = still_pressing(view, loads);
  if (const std::string own_end = shut_in(view, loads); !own_end.empty())
    pushing += (pushing.empty() ? "" : "; ") + own_end;
  const std::string also = pushing.empty() ? "" : "; " + pushing;
  if (stop && !confirmed)
    return "Stop is pressed; the machine stands for another reason: " + cause_text(view, m.fault, bus) + also;
  if (stop) return "Stop is pressed: release it above the button, or with Ctrl+Backspace" + also;
  if (paused) return "paused: press P to resume";
  if (!unheard.what.empty()) return unheard.what + ": " + unheard.remedy;
  std::string next = what_blocks(view, person, loads, bus);
  if (const std::string news = piece_news(view); !news.empty()) next = next.empty() ? news : news + "; " + next;
  if (!pushing.empty()) next = next.empty() ? pushing : pushing + "; " + next;
  if (!view.machine.fault) return next;
  // Whose Stop and enable are both released already is not asked to release one of them.
  const bool over = stopped(view) && !view.hand.enable && !next.empty();
  const std::string cause = over ? "Stop was pressed" : cause_text(view, view.machine.fault, bus);
  return next.empty() || next == cause ? cause : cause + "; now: " + next;
}

bool stopped(const ConsoleView& view) noexcept {
  return view.machine.mode == Mode::kFault && view.machine.fault.code == ReasonCode::kOperatorStop;
}

void draw_banner(const Ui& ui, const ConsoleData& data, UiState& state, Area area) {
  const Theme& t = ui.theme;
  canvas().AddRectFilled(area.min, area.max, t.colours.surface, t.px(8));
  if (data.player != nullptr) draw_replay_block(ui, area.cut_left(t.px(176), t.unit()));
  const AtWindow person{data.facts.hand, state.typing, state.enable_ignored, state.pad_ignored, state.pull_ignored};
  const InputSide& input = data.view.input;
  const bool leads = data.player == nullptr && !data.view.led_by_scenario;
  const bool blocked =
      leads && (data.view.hand.device || input.unattended || input.release_enable || input.dropped != Dropped::kNo ||
                person.enable_ignored || person.pad_ignored || person.pull_ignored);
  mode_block(ui, data.view, data.loads, data.player == nullptr || !data.player->in_gap(),
             {blocked, data.player == nullptr && state.stop},
             area.cut_left(t.px(data.player != nullptr ? 270.F : 318.F), t.unit(2)));
  area = area.inset(t.unit(), 0);
  draw_tags(ui, data, state, area);
  state.home = false;
  if (leads && data.view.machine.home_offered && !machine_freshness(data.view).after(ui.view_age_s).stale())
    home_button(ui, data.view, state, area.cut_right(t.px(180), t.unit()).inset(0, t.px(10)));
  const BusDescription& bus = data.facts.machine.bus;
  draw_reason(ui, area,
              ui.units.as_shown(data.player != nullptr
                                    ? replay_reason(data.view, *data.player, bus)
                                    : banner_reason(data.view, state.stop, ui.view_age_s, person, data.loads, bus)));
}

}  // namespace knuckle::console::screens
