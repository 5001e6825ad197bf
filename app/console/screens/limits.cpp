// Words for limits and for trust in the force.
#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "app/console/machine_words.h"
#include "app/console/screens/screens.h"
#include "estimation/force_estimator.h"

namespace knuckle::console::screens {

namespace {

/// "boom up: end stop" and "boom up: oil at relief" in one.
std::vector<std::string> by_direction(const std::vector<std::string>& words) {
  std::vector<std::string> joined;
  for (const std::string& word : words) {
    const std::size_t colon = word.find(": ");
    const auto same = std::find_if(joined.begin(), joined.end(), [&](const std::string& before) {
      return colon != std::string::npos && before.starts_with(word.substr(0, colon + 2));
    });
    if (same == joined.end())
      joined.push_back(word);
    else
      *same += ", " + word.substr(colon + 2);
  }
  return joined;
}

/// Rows of chips, each of this height. @return the height that all take. @param draws false: they are measured alone.
float chip_rows(const widgets::Ui& ui, std::span<const std::string> words, const widgets::Area& area, float row,
                bool draws) {
  const widgets::Theme& t = ui.theme;
  float x = area.min.x, y = area.min.y + t.px(16);
  for (const std::string& word : words) {
    const float width = widgets::chip_width(ui, word.c_str());
    if (x > area.min.x && x + width > area.max.x) {
      x = area.min.x;
      y += row;
    }
    if (draws) widgets::chip(ui, {x, y}, widgets::Icon::kWarning, word.c_str(), t.colours.notice);
    x += width + t.unit();
  }
  return y + t.px(14) - area.min.y;
}

}  // namespace

bool limit_chips(const widgets::Ui& ui, const ConsoleData& data, const widgets::Area& area) {
  const widgets::Theme& t = ui.theme;
  const std::vector<std::string> words = by_direction(limits_in_words(
      data.view, data.facts.machine, data.kinematics, data.loads, !measured_freshness(data.view).stale()));
  const bool wide = std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return widgets::chip_width(ui, word.c_str()) > area.width();
  });
  for (const float row : {t.px(34), t.px(30)}) {
    if (wide || chip_rows(ui, words, area, row, false) > area.height()) continue;
    chip_rows(ui, words, area, row, true);
    return !words.empty();
  }
  // Too many for chips: the words alone.
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : "; ") + word;
  widgets::put_lines(t.fonts.small, t.colours.notice, area, all.c_str());
  return true;
}

std::string confidence_words(const ConsoleView& view) {
  if (valves_freshness(view).stale()) return "the machine reports no cause";
  const std::string words = estimation::doubt_text(view.status.force_doubts);
  return words.empty() ? "no known disturbance" : words;
}

}  // namespace knuckle::console::screens
