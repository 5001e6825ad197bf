#include "app/console/screens/console_data.h"

#include "app/console/machine_words.h"
#include "app/console/screens/player_panel.h"

namespace knuckle::console::screens {

std::string in_words(const widgets::Ui& ui, const ConsoleData& data, const std::string& text) {
  return ui.units.in_words(with_node_names(text, data.facts.machine.bus));
}

std::optional<Time> chosen_time(const ConsoleData& data) {
  return data.player != nullptr ? data.player->timeline().cursor() : data.live_plots.chosen();
}

void choose_time(const ConsoleData& data, Time at) {
  if (data.player != nullptr)
    data.player->timeline().seek(at);
  else
    data.live_plots.choose(at);
}

}  // namespace knuckle::console::screens
