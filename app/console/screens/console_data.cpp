#include "app/console/screens/console_data.h"

#include "app/console/screens/player_panel.h"

namespace knuckle::console::screens {

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
