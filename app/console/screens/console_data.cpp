#include "app/console/screens/console_data.h"

#include <cmath>

#include "app/console/screens/player_panel.h"

namespace knuckle::console::screens {
namespace {
constexpr Duration kDwell = 1s;          // an estimate that jumps for a moment is no load
constexpr Duration kLongestGap = 250ms;  // what was not seen for longer is not taken to have gone on
}  // namespace

bool payload_is_known(const SlaveMessage& machine, double full_scale_kg) noexcept {
  return machine.payload_sigma_kg <= std::max(std::abs(machine.payload_kg) / 3, 0.05 * full_scale_kg);
}

void PayloadTotal::clear() {
  *this = PayloadTotal(least_kg_);
}

void PayloadTotal::watch(const SlaveMessage& machine, Time now) {
  const double heavy_kg = std::max(least_kg_, 2 * machine.payload_sigma_kg);
  const bool heavy = machine.payload_kg > heavy_kg;
  const bool light = machine.payload_kg + 2 * machine.payload_sigma_kg < least_kg_;  // known to be, not only unknown
  if (now - seen_ > kLongestGap || (carrying_ ? !light : !heavy)) since_ = now;
  seen_ = now;
  if (!carrying_ && !heavy) load_kg_ = load_sigma_kg_ = 0;
  if (heavy && (load_sigma_kg_ == 0 || machine.payload_sigma_kg <= load_sigma_kg_)) {
    load_kg_ = machine.payload_kg;  // what was known best while it hung there
    load_sigma_kg_ = machine.payload_sigma_kg;
  }
  if (now - since_ < kDwell) return;
  since_ = now;
  carrying_ = !carrying_;
  if (carrying_) return;
  total_kg_ += load_kg_;
  ++loads_;
  load_kg_ = load_sigma_kg_ = 0;
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
