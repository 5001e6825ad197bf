#include <algorithm>
#include <array>
#include <cmath>

#include "app/console/screens/calibrate_panel.h"
#include "app/console/screens/screens.h"

namespace knuckle::console::screens {
namespace {

constexpr std::array<const char*, kCalibrationStages> kStageWords{
    "Identity",   "Nodes and E-stop", "Motion enable",  "Signs",    "Stroke ends and zero",
    "Dead bands", "Static poses",     "Dynamic motion", "Hold-out", "Decision",
    "Over"};

bool by_wizard(CalibrationStage stage) {
  return stage <= CalibrationStage::kDeadBands;
}

float height_of(const ImFont* font, float width, const std::string& text) {
  return font->CalcTextSizeA(font->FontSize, 1e9F, width, text.c_str()).y;
}

/// As many lines as it takes, from the top of what is left.
void paragraph(const widgets::Theme& t, const ImFont* font, ImU32 colour, widgets::Area& rest,
               const std::string& text) {
  widgets::put_lines(font, colour, rest.cut_top(height_of(font, rest.width(), text), t.unit()), text.c_str());
}

void steps_card(const widgets::Ui& ui, const CalibrationPanel& panel, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "STEPS", area);
  widgets::Area rest = card.inside();
  const bool begun = panel.begun();
  const int now = begun ? static_cast<int>(panel.state().stage) : -1;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  for (int i = 0; i + 1 < kCalibrationStages; ++i) {
    const widgets::Area row = rest.cut_top(t.px(36));
    const bool done = i < now && (panel.running() || panel.state().verdict.size() > 0);
    const widgets::Icon icon = done ? widgets::Icon::kCheck : i == now ? widgets::Icon::kDot : widgets::Icon::kRing;
    const ImU32 colour = done ? t.colours.good : i == now ? t.colours.accent : t.colours.muted;
    widgets::draw_icon(list, icon, {row.min.x + t.px(10), row.centre().y}, t.px(16), widgets::ink(colour));
    widgets::put_text(i == now ? t.fonts.body_bold : t.fonts.body, i == now ? t.colours.text : t.colours.muted,
                      {row.min.x + t.px(30), row.centre().y}, widgets::Align::kLeft,
                      widgets::shown("%d  %s", i + 1, kStageWords[static_cast<std::size_t>(i)]).c_str());
  }
}

/// Before anything was begun, or after it is over.
void begin_card(const widgets::Ui& ui, const ConsoleData& data, CalibrationPanel& panel, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "CALIBRATE", area);
  widgets::Area rest = card.inside();
  if (!data.view.simulated) {
    widgets::put_lines(
        t.fonts.body, t.colours.text, rest,
        "A real machine is commissioned at its own bus, with a hand on its E-stop: knuckle commission --can, then "
        "knuckle identify. Nothing here moves it.");
    return;
  }
  widgets::Area text = rest.cut_top(t.px(84), t.unit());
  paragraph(t, t.fonts.body, t.colours.text, text,
            "Commissions a simulated machine of its own step by step, as knuckle commission does a real one, then "
            "surveys, excites, identifies and validates it. Nothing changes before you accept the result.");
  const widgets::Area place = rest.cut_top(t.px(40), t.unit());
  if (widgets::button(ui, widgets::Area{place.min, {place.min.x + t.px(220), place.max.y}}, widgets::Icon::kWrench,
                      panel.begun() ? "Begin again" : "Begin"))
    panel.begin();
  if (panel.can_roll_back() &&
      button(ui, widgets::Area{{place.min.x + t.px(232), place.min.y}, {place.min.x + t.px(452), place.max.y}},
             widgets::Icon::kReset, "Roll back"))
    panel.take_back();
  paragraph(t, t.fonts.small, t.colours.muted, rest, "result: " + panel.plan.target);
  const std::string& told = panel.problem().empty() ? panel.state().outcome : panel.problem();
  if (!told.empty()) paragraph(t, t.fonts.body_bold, t.colours.text, rest, ui.units.in_words(told));
  if (panel.can_roll_back())
    paragraph(
        t, t.fonts.body, t.colours.text, rest,
        "This session continues with the machine file it started with. To use the new one: knuckle console --machine " +
            panel.state().accepted.value_or(Acceptance{}).file);
}

void number_answer(const widgets::Ui& ui, CalibrationPanel& panel, const bringup::Question& question,
                   widgets::Area row) {
  const widgets::Theme& t = ui.theme;
  const widgets::Area field = row.cut_left(t.px(140), t.unit());
  ImGui::SetCursorScreenPos(field.min);
  ImGui::SetNextItemWidth(field.width());
  const bool entered = ImGui::InputText("##number", panel.typed.data(), panel.typed.size(),
                                        ImGuiInputTextFlags_CharsScientific | ImGuiInputTextFlags_EnterReturnsTrue);
  ui.focus.add_last_item();
  panel.typing = ImGui::IsItemActive();
  const bool any = panel.typed[0] != 0;
  if ((widgets::button(ui, row.cut_left(t.px(90), t.unit()), widgets::Icon::kCheck, "Enter", false, any) || entered) &&
      any)
    panel.enter(ui.units);
  const auto [factor, unit] = CalibrationPanel::shown_unit(question, ui.units);
  widgets::put_text(
      t.fonts.small, t.colours.muted, {row.min.x, row.centre().y}, widgets::Align::kLeft,
      widgets::shown("%.4g to %.4g %s", factor * question.bounds->first, factor * question.bounds->second, unit)
          .c_str());
}

const char* work_words(CalibrationStage stage) {
  if (by_wizard(stage)) return "working: calibration's own simulated machine may move";
  if (stage == CalibrationStage::kHoldOut) return "identifying and checking";
  return "recording calibration's own simulated machine, faster than real time";
}

void question_card(const widgets::Ui& ui, CalibrationPanel& panel, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const CalibrationState& state = panel.state();
  const widgets::Card card(ui, kStageWords[static_cast<std::size_t>(state.stage)], area);
  widgets::Area rest = card.inside();
  widgets::Area row = rest.cut_bottom(t.px(40), t.unit());
  if (widgets::button(ui, row.cut_right(t.px(190), t.unit()), widgets::Icon::kStop, "End, valves closed"))
    panel.cancel();
  if (state.stage == CalibrationStage::kDecision) {
    widgets::put_lines(t.fonts.body, t.colours.text, rest, ui.units.in_words(state.verdict).c_str());
    if (widgets::button(ui, row.cut_left(t.px(130), t.unit()), widgets::Icon::kCheck, "Accept", false, state.usable))
      panel.job()->accept();
    if (widgets::button(ui, row.cut_left(t.px(130), t.unit()), widgets::Icon::kNone, "Discard")) panel.job()->discard();
    return;
  }
  if (!state.question) {
    const float share = static_cast<float>(state.done);
    paragraph(t, t.fonts.body, t.colours.muted, rest, work_words(state.stage));
    if (!by_wizard(state.stage)) widgets::bar(ui, rest.cut_top(t.px(18)), 0, share, t.colours.accent);
    return;
  }
  const bringup::Question question = *state.question;  // an answer takes it away
  paragraph(t, t.fonts.body, t.colours.text, rest, ui.units.in_words(question.text));
  if (!panel.refused().empty()) paragraph(t, t.fonts.body_bold, t.colours.bad, rest, panel.refused());
  for (const std::string& word : question.words)
    if (widgets::button(ui, row.cut_left(t.px(110), t.unit(0.5F)), widgets::Icon::kNone, word.c_str()))
      panel.answer(word);
  if (question.bounds) number_answer(ui, panel, question, row);
}

void said_card(const widgets::Ui& ui, const CalibrationState& state, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "WHAT WAS FOUND", area);
  widgets::Area rest = card.inside();
  const ImFont* font = t.fonts.mono_small;
  const float gap = t.px(4);
  // The newest that fit, each of them whole.
  std::vector<std::string> said;
  for (const std::string& line : state.said) said.push_back(ui.units.in_words(line));
  std::size_t first = said.size();
  for (float left = rest.height(); first > 0; --first) {
    left -= height_of(font, rest.width(), said[first - 1]) + gap;
    if (left < 0) break;
  }
  for (std::size_t i = first; i < said.size(); ++i) {
    const float height = height_of(font, rest.width(), said[i]);
    widgets::put_lines(font, t.colours.text, rest.cut_top(height, gap), said[i].c_str());
  }
}

/// Falls with every pose that adds information.
void condition_card(const widgets::Ui& ui, const CalibrationState& state, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "HOW WELL THE POSES SEPARATE THE LINKS' WEIGHTS", area);
  widgets::Area rest = card.inside();
  const std::vector<double>& all = state.condition_numbers;
  widgets::Area line = rest.cut_top(t.px(44), t.unit());
  widgets::value_large(ui, line, "condition number", all.empty() ? "-" : widgets::shown("%.1f", all.back()).c_str(),
                       widgets::shown("after %zu poses", state.poses).c_str());
  if (all.size() < 2) {
    if (!state.question)
      widgets::put_text(t.fonts.title, t.colours.muted, rest.centre(), widgets::Align::kCentre, "recording ...");
    return;
  }
  const widgets::Area numbers = rest.cut_left(t.px(44));
  const double high = std::log10(*std::max_element(all.begin(), all.end()) * 1.2), low = 0;
  std::vector<ImVec2> points;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const float x = static_cast<float>(i) / static_cast<float>(all.size() - 1);
    const float y = static_cast<float>((std::log10(std::max(1.0, all[i])) - low) / (high - low));
    points.push_back({rest.min.x + x * rest.width(), rest.max.y - y * rest.height()});
  }
  ImDrawList& list = *ImGui::GetWindowDrawList();
  float free_below = rest.max.y + t.px(10);
  for (double decade = 1; decade < 1e12; decade *= 10) {
    for (const double step : {1.0, 2.0, 5.0}) {
      const auto share = static_cast<float>(std::log10(step * decade) / high);
      const float y = rest.max.y - share * rest.height();
      if (share > 1 || y > free_below) continue;
      free_below = y - t.px(22);
      list.AddLine({rest.min.x, y}, {rest.max.x, y}, widgets::ink(t.colours.border), t.px(1));
      widgets::put_text(t.fonts.small, t.colours.muted, {numbers.max.x - t.px(8), y}, widgets::Align::kRight,
                        widgets::shown("%.0f", step * decade).c_str());
    }
  }
  list.AddPolyline(points.data(), static_cast<int>(points.size()), widgets::ink(t.colours.series[0]), 0, t.px(2));
  for (const ImVec2& point : points) list.AddCircleFilled(point, t.px(3), widgets::ink(t.colours.series[0]));
}

void hold_out_card(const widgets::Ui& ui, const CalibrationState& state, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const widgets::Card card(ui, "TORQUE ERROR ON HELD-OUT MOTION (RMS / STANDARD DEVIATION)", area);
  widgets::Area rest = card.inside();
  const auto line = [&](const char* what, const std::array<std::string, kJoints>& cells, const ImFont* font) {
    const widgets::Area row = rest.cut_top(t.px(28));
    widgets::put_fitted(t.fonts.body, t.colours.text, {row.min, {row.min.x + 0.46F * row.width(), row.max.y}}, what);
    for (int j = 0; j < kJoints; ++j) {
      const float x = row.min.x + row.width() * (0.64F + 0.18F * static_cast<float>(j));
      widgets::put_text(font, t.colours.text, {x, row.centre().y}, widgets::Align::kRight,
                        cells[static_cast<std::size_t>(j)].c_str());
    }
  };
  line("", {"boom", "arm", "bucket"}, t.fonts.small);
  const auto cells = [](const std::optional<JointVector>& nrmse) {
    std::array<std::string, kJoints> text;
    for (int j = 0; j < kJoints; ++j)
      text[static_cast<std::size_t>(j)] =
          nrmse && std::isfinite((*nrmse)[j]) ? widgets::shown("%.1f %%", 100 * (*nrmse)[j]).c_str() : "-";
    return text;
  };
  for (const HoldOutRow& row : state.hold_out) {
    line((row.recording + ", new").c_str(), cells(row.new_nrmse), t.fonts.mono);
    line((row.recording + (row.old_nrmse ? ", before" : ", before: none")).c_str(), cells(row.old_nrmse), t.fonts.mono);
  }
}

}  // namespace

std::optional<widgets::Area> calibrate_screen(const widgets::Ui& ui, const ConsoleData& data, widgets::Area area) {
  const widgets::Theme& t = ui.theme;
  CalibrationPanel& panel = data.calibration;
  const float gap = t.px(10);
  steps_card(ui, panel, area.cut_left(t.px(250), gap));
  const CalibrationStage stage = panel.state().stage;
  const bool after = panel.begun() && stage >= CalibrationStage::kHoldOut && !panel.state().hold_out.empty();
  if (!panel.running()) {
    begin_card(ui, data, panel, after ? area.cut_top(t.px(330), gap) : area);
    if (after) hold_out_card(ui, panel.state(), area);
    return std::nullopt;
  }
  question_card(ui, panel, area.cut_bottom(t.px(150), gap));
  if (by_wizard(stage)) {
    said_card(ui, panel.state(), area.cut_bottom(0.5F * area.height(), gap));
    widgets::put_text(t.fonts.small, t.colours.muted, {area.min.x + t.unit(1.5F), area.min.y + t.px(18)},
                      widgets::Align::kLeft, "calibration's own simulated machine, not the session's");
    return area;
  }
  if (after)
    hold_out_card(ui, panel.state(), area);
  else
    condition_card(ui, panel.state(), area);
  return std::nullopt;
}

}  // namespace knuckle::console::screens
