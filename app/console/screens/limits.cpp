// Words for limits and for trust in the force.
#include <string>

#include "app/console/screens/screens.h"
#include "estimation/force_estimator.h"

namespace knuckle::console::screens {

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
  if (valves_freshness(view).stale()) return "the machine reports no cause";
  const std::string words = estimation::doubt_words(view.status.force_doubts);
  return words.empty() ? "no known disturbance" : words;
}

}  // namespace knuckle::console::screens
