// Words for limits and for trust in the force.
#include <array>
#include <utility>

#include "app/console/screens/screens.h"
#include "estimation/force_estimator.h"

namespace knuckle::console::screens {

const char* limit_word(unsigned bit) noexcept {
  constexpr std::array<const char*, 10> kWords{"full stroke",  "spool rate",   "joint range", "virtual wall",
                                               "pressure",     "power",        "pump flow",   "joint velocity",
                                               "assist force", "force ceiling"};
  return bit < kWords.size() ? kWords[bit] : nullptr;
}

bool limit_chips(const widgets::Ui& ui, std::uint16_t limits, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  float x = area.min.x, y = area.min.y + t.px(16);
  bool any = false;
  for (unsigned bit = 0; limit_word(bit) != nullptr; ++bit) {
    if ((limits & (1U << bit)) == 0) continue;
    const float width = widgets::chip_width(ui, limit_word(bit));
    if (any && x + width > area.max.x) {
      x = area.min.x;
      y += t.px(34);
    }
    widgets::chip(ui, {x, y}, widgets::Icon::kWarning, limit_word(bit), t.colours.notice);
    x += width + t.unit();
    any = true;
  }
  return any;
}

std::string confidence_words(const ConsoleView& view) {
  constexpr std::array<std::pair<estimation::ConfidenceReason, const char*>, 8> kWords{
      {{estimation::kBadInput, "sensor values are not usable"},
       {estimation::kNearSingular, "arm near straight or bucket near its end"},
       {estimation::kResidual, "the joints disagree: contact elsewhere than at the tip, or a sensor error"},
       {estimation::kEndStop, "a cylinder is at its end stop"},
       {estimation::kReliefOpen, "a relief valve is open"},
       {estimation::kStuckFriction, "at rest: friction hides small forces"},
       {estimation::kFastMotion, "fast motion"},
       {estimation::kNotTared, "still learning this machine's free motion"}}};
  if (status_freshness(view).stale()) return "the machine reports no cause";
  std::string words;
  for (const auto& [bit, why] : kWords)
    if ((view.status.force_doubts & bit) != 0) words += (words.empty() ? "" : ", ") + std::string(why);
  return words.empty() ? "no known disturbance" : words;
}

}  // namespace knuckle::console::screens
