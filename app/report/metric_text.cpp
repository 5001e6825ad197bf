#include "app/report/metric_text.h"

#include <algorithm>
#include <array>
#include <utility>

namespace knuckle::report {
namespace {

using MetricName = std::pair<std::string_view, std::string_view>;

constexpr std::array kMetrics{
    MetricName{"tip_rms_m", "error of the tip in free motion, RMS"},
    MetricName{"tip_max_m", "error of the tip in free motion, largest"},
    MetricName{"path_rms_m", "error of the tip along the recorded path, RMS"},
    MetricName{"steady_drift_m", "error of the tip at rest, largest mean over a second"},
    MetricName{"no_load_rms_N", "estimated force where there is none, RMS"},
    MetricName{"contact_error_rel", "error of the estimated force in contact, as a share of the true one"},
    MetricName{"direction_error_deg", "error of the estimated force's direction"},
    MetricName{"detection_ms", "delay until a contact is detected, slowest"},
    MetricName{"false_contact_share", "share of free motion in which a contact is reported"},
    MetricName{"free_estimate_peak_N", "largest estimated force in free motion"},
    MetricName{"peak_N", "largest true force on the tip"},
    MetricName{"pipe_peak_N", "largest true force on a buried pipe"},
    MetricName{"payload_truth_kg", "true load"},
    MetricName{"payload_estimate_kg", "estimated load"},
    MetricName{"payload_sigma_kg", "standard deviation of the estimated load"},
    MetricName{"payload_error_kg", "error of the estimated load"},
    MetricName{"payload_contact_error_kg", "error of the estimated load while the bucket touches something, largest"},
    MetricName{"contact_losses", "times that contact was lost during a press"},
    MetricName{"rise_t90_s", "time until a press is felt to 90 %, slowest"},
    MetricName{"settle_s", "time until the felt force of a press has settled, slowest"},
    MetricName{"hold_peak_to_peak_N", "swing of the felt force during a hold, worst"},
    MetricName{"hold_error_N", "error of the felt force during a hold, worst"},
    MetricName{"hold_error_share", "error of the felt force during a hold, as a share of what is allowed"},
    MetricName{"hold_true_swing_share", "swing of the true force during a hold, as a share of what is allowed"},
    MetricName{"drag_rms_N", "force felt in free motion, RMS"},
    MetricName{"max_slew_N_per_ms", "fastest change of the felt force"},
    MetricName{"net_energy_J", "largest net work done on the hand"},
    MetricName{"felt_error_rms_N", "error of the felt force while engaged, RMS"},
    MetricName{"felt_error_rel", "error of the felt force while engaged, as a share of the true one"},
    MetricName{"felt_error_worst_N", "error of the felt force, worst mean over half a second"},
    MetricName{"felt_onset_ms", "delay until a contact or load is felt, slowest"},
    MetricName{"unfelt_s", "time in which the machine presses and the operator does not feel it"},
    MetricName{"unfelt_showable_s", "unfelt time in which the device could have shown the force"},
    MetricName{"free_felt_peak_N", "largest force felt in free motion"},
    MetricName{"contact_swing_N", "swing of the true force within a quarter of a second of contact, largest"},
    MetricName{"contact_bounces", "bounces on contact"},
    MetricName{"fault_rise_N", "rise of the true force after a fault, largest"},
    MetricName{"fault_slew_N_per_ms", "fastest change of the felt force after a fault"},
    MetricName{"peak_over_asked", "largest true force of a press over what it asks for"},
    MetricName{"engaged_s", "time engaged"},
    MetricName{"faults", "latched faults"},
    MetricName{"command_neutral_ms", "time from a fault to the neutral command, slowest"},
    MetricName{"spool_neutral_ms", "time from a fault to closed valves, slowest"},
    MetricName{"pieces_broken", "pieces broken"},
    MetricName{"phases_timed_out", "whether the operator's plan ran out of time"},
    MetricName{"resumed_by_itself", "faults after which motion resumed by itself"},
    MetricName{"records_lost", "records lost"},
    MetricName{"pump_short_share", "share of engaged time in which the pump delivered too little"},
};

constexpr std::array kHops{
    MetricName{"hand_to_master", "from the hand's device to the operator's side"},
    MetricName{"master_to_slave", "from the operator's side to the machine's"},
    MetricName{"hand_to_valve", "from the hand's device to the valves' wire"},
    MetricName{"pressure_to_slave", "from the pressures' wire to the estimated force"},
    MetricName{"slave_to_master", "from the machine's side to the operator's"},
    MetricName{"pressure_to_hand", "from the pressures' wire to the force in the hand"},
};

template <std::size_t N>
std::string text_of(const std::array<MetricName, N>& table, std::string_view name) {
  const auto known = std::find_if(table.begin(), table.end(), [name](const MetricName& w) { return w.first == name; });
  return std::string(known == table.end() ? name : known->second);
}

}  // namespace

std::string metric_text(std::string_view name) {
  return text_of(kMetrics, name);
}

std::string hop_text(std::string_view hop) {
  return text_of(kHops, hop);
}

}  // namespace knuckle::report
