#include "app/report/metric_words.h"

#include <algorithm>
#include <array>
#include <utility>

namespace knuckle::report {
namespace {

using Words = std::pair<std::string_view, std::string_view>;

constexpr std::array kMetrics{
    Words{"tip_rms_m", "error of the tip in free motion, RMS"},
    Words{"tip_max_m", "error of the tip in free motion, largest"},
    Words{"path_rms_m", "error of the tip along the recorded path, RMS"},
    Words{"steady_drift_m", "error of the tip at rest, largest mean over a second"},
    Words{"no_load_rms_N", "estimated force where there is none, RMS"},
    Words{"contact_error_rel", "error of the estimated force in contact, as a share of the true one"},
    Words{"direction_error_deg", "error of the estimated force's direction"},
    Words{"detection_ms", "delay until a contact is detected, slowest"},
    Words{"false_contact_share", "share of free motion in which a contact is reported"},
    Words{"free_estimate_peak_N", "largest estimated force in free motion"},
    Words{"peak_N", "largest true force on the tip"},
    Words{"pipe_peak_N", "largest true force on a buried pipe"},
    Words{"payload_truth_kg", "true load"},
    Words{"payload_estimate_kg", "estimated load"},
    Words{"payload_sigma_kg", "standard deviation of the estimated load"},
    Words{"payload_error_kg", "error of the estimated load"},
    Words{"payload_contact_error_kg", "error of the estimated load while the bucket touches something, largest"},
    Words{"contact_losses", "times that contact was lost during a press"},
    Words{"rise_t90_s", "time until a press is felt to 90 %, slowest"},
    Words{"settle_s", "time until the felt force of a press has settled, slowest"},
    Words{"hold_peak_to_peak_N", "swing of the felt force during a hold, worst"},
    Words{"hold_error_N", "error of the felt force during a hold, worst"},
    Words{"hold_error_share", "error of the felt force during a hold, as a share of what is allowed"},
    Words{"hold_true_swing_share", "swing of the true force during a hold, as a share of what is allowed"},
    Words{"drag_rms_N", "force felt in free motion, RMS"},
    Words{"max_slew_N_per_ms", "fastest change of the felt force"},
    Words{"net_energy_J", "largest net work done on the hand"},
    Words{"felt_error_rms_N", "error of the felt force while engaged, RMS"},
    Words{"felt_error_rel", "error of the felt force while engaged, as a share of the true one"},
    Words{"felt_error_worst_N", "error of the felt force, worst mean over half a second"},
    Words{"felt_onset_ms", "delay until a contact or load is felt, slowest"},
    Words{"unfelt_s", "time in which the machine presses and the operator does not feel it"},
    Words{"unfelt_showable_s", "unfelt time in which the device could have shown the force"},
    Words{"free_felt_peak_N", "largest force felt in free motion"},
    Words{"contact_swing_N", "swing of the true force within a quarter of a second of contact, largest"},
    Words{"contact_bounces", "bounces on contact"},
    Words{"fault_rise_N", "rise of the true force after a fault, largest"},
    Words{"fault_slew_N_per_ms", "fastest change of the felt force after a fault"},
    Words{"peak_over_asked", "largest true force of a press over what it asks for"},
    Words{"engaged_s", "time engaged"},
    Words{"faults", "latched faults"},
    Words{"command_neutral_ms", "time from a fault to the neutral command, slowest"},
    Words{"spool_neutral_ms", "time from a fault to closed valves, slowest"},
    Words{"pieces_broken", "pieces broken"},
    Words{"phases_timed_out", "whether the operator's plan ran out of time"},
    Words{"resumed_by_itself", "faults after which motion resumed by itself"},
    Words{"records_lost", "records lost"},
    Words{"pump_short_share", "share of engaged time in which the pump delivered too little"},
};

constexpr std::array kHops{
    Words{"hand_to_master", "from the hand's device to the operator's side"},
    Words{"master_to_slave", "from the operator's side to the machine's"},
    Words{"hand_to_valve", "from the hand's device to the valves' wire"},
    Words{"pressure_to_slave", "from the pressures' wire to the estimated force"},
    Words{"slave_to_master", "from the machine's side to the operator's"},
    Words{"pressure_to_hand", "from the pressures' wire to the force in the hand"},
};

template <std::size_t N>
std::string words_of(const std::array<Words, N>& table, std::string_view name) {
  const auto known = std::find_if(table.begin(), table.end(), [name](const Words& w) { return w.first == name; });
  return std::string(known == table.end() ? name : known->second);
}

}  // namespace

std::string metric_words(std::string_view name) {
  return words_of(kMetrics, name);
}

std::string hop_words(std::string_view hop) {
  return words_of(kHops, hop);
}

}  // namespace knuckle::report
