// Words for limits and for trust in the force.
#include <string>
#include <vector>

#include "app/console/machine_words.h"
#include "app/console/screens/screens.h"
#include "estimation/force_estimator.h"

namespace knuckle::console::screens {

bool limit_chips(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const float row = t.px(34);
  float x = area.min.x, y = area.min.y + t.px(16);
  const std::vector<std::string> words = limits_in_words(data.view, data.facts.machine, data.kinematics, data.loads,
                                                         !measured_freshness(data.view).stale());
  for (std::size_t i = 0; i < words.size(); ++i) {
    const float width = widgets::chip_width(ui, words[i].c_str());
    if (x > area.min.x && x + width > area.max.x) {
      x = area.min.x;
      y += row;
    }
    const bool last_row = y + row > area.max.y - t.px(16);
    if (last_row && x > area.min.x && i + 1 < words.size()) {
      widgets::put_text(t.fonts.small, t.colours.muted, {x, y}, widgets::Align::kLeft,
                        widgets::shown("+%zu", words.size() - i).c_str());
      break;
    }
    widgets::chip(ui, {x, y}, widgets::Icon::kWarning, words[i].c_str(), t.colours.notice);
    x += width + t.unit();
  }
  return !words.empty();
}

std::string confidence_words(const ConsoleView& view) {
  if (valves_freshness(view).stale()) return "the machine reports no cause";
  const std::string words = estimation::doubt_words(view.status.force_doubts);
  return words.empty() ? "no known disturbance" : words;
}

}  // namespace knuckle::console::screens
