#include "app/console/screens/recording_tag.h"

#include <algorithm>

namespace knuckle::console::screens {
namespace {

using State = RecordingLight::State;
constexpr std::uint64_t kLittle_bytes = 2'000'000'000;  // a few hours of one program's recording

float icon_width(const widgets::Theme& t) {
  return t.px(22);
}
float note_gap(const widgets::Theme& t) {
  return t.unit();
}

std::string free_words(std::uint64_t bytes) {
  return widgets::shown("%.1f GB free", 1e-9 * static_cast<double>(bytes)).c_str();
}

}  // namespace

RecordingWords recording_words(const RecordingLight& light, double elapsed_s) {
  RecordingWords words;
  const auto append = [&words](const std::string& more) { words.note += (words.note.empty() ? "" : ", ") + more; };
  if (light.state == State::kOff) {
    words.light = "NOT RECORDED";
  } else if (light.state == State::kStopped) {
    words.light = "REC STOPPED: " + light.why;
  } else {
    const auto s = static_cast<long>(std::clamp(elapsed_s, 0.0, 1e9));
    words.light = widgets::shown("REC %ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60).c_str();
    if (light.free_bytes > 0) append(free_words(light.free_bytes));
  }
  if (light.steps_lost > 0) append(std::to_string(light.steps_lost) + " steps lost");
  return words;
}

float recording_width(const widgets::Ui& ui, const RecordingWords& words) {
  const widgets::Theme& t = ui.theme;
  const float light = icon_width(t) + widgets::text_width(t.fonts.mono_small, words.light.c_str());
  if (words.note.empty()) return light;
  return light + note_gap(t) + widgets::text_width(t.fonts.small, words.note.c_str());
}

void draw_recording(const widgets::Ui& ui, const RecordingLight& light, const RecordingWords& words,
                    const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Palette& c = t.colours;
  const bool amiss = light.state == State::kStopped || (light.state == State::kOff && light.real);
  const widgets::Icon icon = light.state == State::kOn        ? widgets::Icon::kDot
                             : light.state == State::kStopped ? widgets::Icon::kWarning
                                                              : widgets::Icon::kRing;
  const ImU32 colour = light.state == State::kOn ? c.stop : amiss ? c.notice : c.muted;
  widgets::Area rest = area;
  const widgets::Area place = rest.cut_left(icon_width(t));
  widgets::draw_icon(*ImGui::GetWindowDrawList(), icon, {place.min.x + t.px(8), place.centre().y}, t.px(14), colour);
  const ImU32 text = light.state == State::kOn ? c.text : colour;
  const float wide = widgets::text_width(t.fonts.mono_small, words.light.c_str());
  widgets::put_fitted(t.fonts.mono_small, text, rest.cut_left(std::min(wide + 1, rest.width()), note_gap(t)),
                      words.light.c_str());
  if (words.note.empty() || rest.width() <= 0) return;
  const bool noted = light.steps_lost > 0 || light.free_bytes < kLittle_bytes;
  widgets::put_fitted(t.fonts.small, noted ? c.notice : c.muted, rest, words.note.c_str());
}

}  // namespace knuckle::console::screens
