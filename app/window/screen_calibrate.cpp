#include <algorithm>
#include <array>
#include <cmath>

#include "app/window/calibrate_panel.h"
#include "app/window/screens.h"

namespace knuckle::app {
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
void paragraph(const Theme& t, const ImFont* font, ImU32 colour, Area& rest, const std::string& text) {
  put_lines(font, colour, rest.cut_top(height_of(font, rest.width(), text), t.unit()), text.c_str());
}

void steps_card(const Ui& ui, const CalibrationPanel& panel, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "STEPS", area);
  Area rest = card.inside();
  const bool begun = panel.begun();
  const int now = begun ? static_cast<int>(panel.state().stage) : -1;
  ImDrawList& list = *ImGui::GetWindowDrawList();
  for (int i = 0; i + 1 < kCalibrationStages; ++i) {
    const Area row = rest.cut_top(t.px(36));
    const bool done = i < now && (panel.running() || panel.state().verdict.size() > 0);
    const Icon icon = done ? Icon::kCheck : i == now ? Icon::kDot : Icon::kRing;
    const ImU32 colour = done ? t.colours.good : i == now ? t.colours.accent : t.colours.muted;
    draw_icon(list, icon, {row.min.x + t.px(10), row.centre().y}, t.px(16), ink(colour));
    put_text(i == now ? t.fonts.body_bold : t.fonts.body, i == now ? t.colours.text : t.colours.muted,
             {row.min.x + t.px(30), row.centre().y}, Align::kLeft,
             shown("%d  %s", i + 1, kStageWords[static_cast<std::size_t>(i)]).c_str());
  }
}

/// Before anything was begun, or after it is over.
void begin_card(const Ui& ui, const ConsoleData& data, CalibrationPanel& panel, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "CALIBRATE", area);
  Area rest = card.inside();
  if (!data.view.simulated) {
    put_lines(
        t.fonts.body, t.colours.text, rest,
        "A real machine is commissioned at its own bus, with a hand on its E-stop: knuckle commission --can, then "
        "knuckle identify. Nothing here moves it.");
    return;
  }
  Area text = rest.cut_top(t.px(84), t.unit());
  paragraph(t, t.fonts.body, t.colours.text, text,
            "Commissions a simulated machine of its own step by step, as knuckle commission does a real one, then "
            "surveys, excites, identifies and validates it. Nothing changes before you accept the result.");
  const Area place = rest.cut_top(t.px(40), t.unit());
  if (button(ui, Area{place.min, {place.min.x + t.px(220), place.max.y}}, Icon::kWrench,
             panel.begun() ? "Begin again" : "Begin"))
    panel.begin();
  if (panel.can_roll_back() &&
      button(ui, Area{{place.min.x + t.px(232), place.min.y}, {place.min.x + t.px(452), place.max.y}}, Icon::kReset,
             "Roll back"))
    panel.take_back();
  paragraph(t, t.fonts.small, t.colours.muted, rest, "result: " + panel.plan.target);
  const std::string& told = panel.problem().empty() ? panel.state().outcome : panel.problem();
  if (!told.empty()) paragraph(t, t.fonts.body_bold, t.colours.text, rest, told);
  if (panel.can_roll_back())
    paragraph(t, t.fonts.body, t.colours.text, rest,
              "This session goes on with the machine file it began with. For the new one: knuckle console --machine " +
                  panel.state().accepted.value_or(Acceptance{}).file);
}

void number_answer(const Ui& ui, CalibrationPanel& panel, const Dialogue::Question& question, Area row) {
  const Theme& t = ui.theme;
  const Area field = row.cut_left(t.px(140), t.unit());
  ImGui::SetCursorScreenPos(field.min);
  ImGui::SetNextItemWidth(field.width());
  const bool entered = ImGui::InputText("##number", panel.typed.data(), panel.typed.size(),
                                        ImGuiInputTextFlags_CharsScientific | ImGuiInputTextFlags_EnterReturnsTrue);
  const bool any = panel.typed[0] != 0;
  if ((button(ui, row.cut_left(t.px(90), t.unit()), Icon::kCheck, "Enter", false, any) || entered) && any)
    panel.enter();
  put_text(t.fonts.small, t.colours.muted, {row.min.x, row.centre().y}, Align::kLeft,
           shown("%g to %g", question.bounds->first, question.bounds->second).c_str());
}

const char* work_words(CalibrationStage stage) {
  if (by_wizard(stage)) return "at work: calibration's own simulated machine may move";
  if (stage == CalibrationStage::kHoldOut) return "identifying and checking";
  return "recording calibration's own simulated machine, faster than real time";
}

void question_card(const Ui& ui, CalibrationPanel& panel, const Area& area) {
  const Theme& t = ui.theme;
  const CalibrationState& state = panel.state();
  const Card card(ui, kStageWords[static_cast<std::size_t>(state.stage)], area);
  Area rest = card.inside();
  Area row = rest.cut_bottom(t.px(40), t.unit());
  if (button(ui, row.cut_right(t.px(190), t.unit()), Icon::kStop, "End, valves closed")) panel.cancel();
  if (state.stage == CalibrationStage::kDecision) {
    put_lines(t.fonts.body, t.colours.text, rest, state.verdict.c_str());
    if (button(ui, row.cut_left(t.px(130), t.unit()), Icon::kCheck, "Accept", false, state.usable))
      panel.job()->accept();
    if (button(ui, row.cut_left(t.px(130), t.unit()), Icon::kNone, "Discard")) panel.job()->discard();
    return;
  }
  if (!state.question) {
    const float share = static_cast<float>(state.done);
    paragraph(t, t.fonts.body, t.colours.muted, rest, work_words(state.stage));
    if (!by_wizard(state.stage)) bar(ui, rest.cut_top(t.px(18)), 0, share, t.colours.accent);
    return;
  }
  const Dialogue::Question question = *state.question;  // an answer takes it away
  paragraph(t, t.fonts.body, t.colours.text, rest, question.text);
  if (!panel.refused().empty()) paragraph(t, t.fonts.body_bold, t.colours.bad, rest, panel.refused());
  for (const std::string& word : question.words)
    if (button(ui, row.cut_left(t.px(110), t.unit(0.5F)), Icon::kNone, word.c_str())) panel.answer(word);
  if (question.bounds) number_answer(ui, panel, question, row);
}

void said_card(const Ui& ui, const CalibrationState& state, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "WHAT WAS FOUND", area);
  Area rest = card.inside();
  const ImFont* font = t.fonts.mono_small;
  const float gap = t.px(4);
  // The newest that fit, each of them whole.
  std::size_t first = state.said.size();
  for (float left = rest.height(); first > 0; --first) {
    left -= height_of(font, rest.width(), state.said[first - 1]) + gap;
    if (left < 0) break;
  }
  for (std::size_t i = first; i < state.said.size(); ++i) {
    const float height = height_of(font, rest.width(), state.said[i]);
    put_lines(font, t.colours.text, rest.cut_top(height, gap), state.said[i].c_str());
  }
}

/// Falls with every pose that tells something new.
void condition_card(const Ui& ui, const CalibrationState& state, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "HOW WELL THE POSES TELL THE LINKS' WEIGHTS APART", area);
  Area rest = card.inside();
  const std::vector<double>& all = state.condition_numbers;
  Area line = rest.cut_top(t.px(44), t.unit());
  value_large(ui, line, "condition number", all.empty() ? "-" : shown("%.1f", all.back()).c_str(),
              shown("after %zu poses", state.poses).c_str());
  if (all.size() < 2) {
    if (!state.question) put_text(t.fonts.title, t.colours.muted, rest.centre(), Align::kCentre, "recording ...");
    return;
  }
  const Area numbers = rest.cut_left(t.px(44));
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
      list.AddLine({rest.min.x, y}, {rest.max.x, y}, ink(t.colours.border), t.px(1));
      put_text(t.fonts.small, t.colours.muted, {numbers.max.x - t.px(8), y}, Align::kRight,
               shown("%.0f", step * decade).c_str());
    }
  }
  list.AddPolyline(points.data(), static_cast<int>(points.size()), ink(t.colours.series[0]), 0, t.px(2));
  for (const ImVec2& point : points) list.AddCircleFilled(point, t.px(3), ink(t.colours.series[0]));
}

void hold_out_card(const Ui& ui, const CalibrationState& state, const Area& area) {
  const Theme& t = ui.theme;
  const Card card(ui, "HELD-OUT TORQUE LEFT UNEXPLAINED (RMS, SHARE OF ITS SPREAD)", area);
  Area rest = card.inside();
  const auto line = [&](const char* what, const std::array<std::string, kJoints>& cells, const ImFont* font) {
    const Area row = rest.cut_top(t.px(28));
    put_fitted(t.fonts.body, t.colours.text, {row.min, {row.min.x + 0.46F * row.width(), row.max.y}}, what);
    for (int j = 0; j < kJoints; ++j) {
      const float x = row.min.x + row.width() * (0.64F + 0.18F * static_cast<float>(j));
      put_text(font, t.colours.text, {x, row.centre().y}, Align::kRight, cells[static_cast<std::size_t>(j)].c_str());
    }
  };
  line("", {"boom", "arm", "bucket"}, t.fonts.small);
  const auto cells = [](const std::optional<JointVector>& nrmse) {
    std::array<std::string, kJoints> text;
    for (int j = 0; j < kJoints; ++j)
      text[static_cast<std::size_t>(j)] =
          nrmse && std::isfinite((*nrmse)[j]) ? shown("%.1f %%", 100 * (*nrmse)[j]).c_str() : "-";
    return text;
  };
  for (const HoldOutRow& row : state.hold_out) {
    line((row.recording + ", new").c_str(), cells(row.new_nrmse), t.fonts.mono);
    line((row.recording + (row.old_nrmse ? ", before" : ", before: none")).c_str(), cells(row.old_nrmse), t.fonts.mono);
  }
}

}  // namespace

std::optional<Area> calibrate_screen(const Ui& ui, const ConsoleData& data, Area area) {
  const Theme& t = ui.theme;
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
    put_text(t.fonts.small, t.colours.muted, {area.min.x + t.unit(1.5F), area.min.y + t.px(18)}, Align::kLeft,
             "calibration's own simulated machine, not the session's");
    return area;
  }
  if (after)
    hold_out_card(ui, panel.state(), area);
  else
    condition_card(ui, panel.state(), area);
  return std::nullopt;
}

}  // namespace knuckle::app
