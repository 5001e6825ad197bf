#include "app/report/csv_table.h"

#include <array>

#include "app/recordings/csv_row.h"
#include "app/session/record_windows.h"

namespace knuckle::report {
namespace {

constexpr double kBarPerPa = 1e-5;

void machine_columns(recordings::RowWriter& row, const session::Sample& s) {
  row.joints("", "_rad", s.joint_rad);
  row.joints("", "_radps", s.joint_radps);
  row.joints("setpoint_", "_rad", s.setpoint_rad);
  row.joints("setpoint_", "_radps", s.setpoint_radps);
  row.joints("valve_", "", s.valve_command);
  constexpr std::array<const char*, 6> kChambers{"boom_A_bar", "boom_B_bar",   "arm_A_bar",
                                                 "arm_B_bar",  "bucket_A_bar", "bucket_B_bar"};
  for (std::size_t i = 0; i < kChambers.size(); ++i) row.number(kChambers[i], s.pressure_Pa[i] * kBarPerPa);
  row.planar("tip_force", "N", s.tip_force_N);
  row.number("force_cov_xx_N2", s.force_cov_N2[0]);
  row.number("force_cov_xz_N2", s.force_cov_N2[1]);
  row.number("force_cov_zz_N2", s.force_cov_N2[2]);
  row.number("confidence", s.confidence);
  row.number("confidence_reasons", s.confidence_reasons);
  row.number("contact", s.contact ? 1 : 0);
  row.number("limits", s.limits);
  row.number("payload_kg", s.payload_kg);
  row.number("payload_sigma_kg", s.payload_sigma_kg);
}

void hand_columns(recordings::RowWriter& row, const session::Sample& s) {
  row.joints("hand_", "_rad", s.hand_rad);
  row.joints("hand_", "_radps", s.hand_radps);
  row.joints("intent_", "_rad", s.intent_rad);
  row.planar("hand_tip", "m", s.hand_tip_m);
  row.planar("hand_setpoint_tip", "m", s.hand_setpoint_tip_m);
  row.planar("felt", "N", s.felt_N);
  row.planar("rendered", "N", s.drag_N);
  row.number("hand_energy_J", s.hand_energy_J);
  row.number("felt_slew_N_per_ms", s.felt_slew_N_per_ms);
  row.number("rtt_ms", 1e3 * s.rtt_s);
}

void truth_columns(recordings::RowWriter& row, const session::Sample& s) {
  row.joints("truth_", "_rad", s.truth_joint_rad);
  row.joints("truth_", "_radps", s.truth_joint_radps);
  row.joints("truth_spool_", "", s.truth_spool);
  row.planar("truth_tip", "m", s.truth_tip_m);
  row.planar("truth_tip_force", "N", s.truth_tip_force_N);
  row.planar("truth_contact", "m", s.truth_contact_m);
  row.number("truth_pipe_N", s.truth_pipe_N);
  row.number("truth_payload_kg", s.truth_payload_kg);
  row.planar("truth_weight", "N", s.truth_weight_N);
  row.number("truth_pump_flow_share", s.truth_pump_flow_share);
  row.number("truth_energy_to_machine_J", s.truth_energy_to_machine_J);
}

void write_row(recordings::RowWriter& row, const session::SessionRecord& record, const session::Sample& s) {
  row.number("t_s", s.t_s);
  row.word("mode", name(s.mode));
  row.word("phase", session::phase_name(record, s));
  row.word("blocking", name(s.blocking));
  row.word("fault", name(s.fault));
  machine_columns(row, s);
  hand_columns(row, s);
  truth_columns(row, s);
  row.end_row();
}

}  // namespace

void write_csv(const session::SessionRecord& record, std::ostream& out) {
  {
    recordings::RowWriter header(out, true);
    write_row(header, record, session::Sample{});
  }
  recordings::RowWriter rows(out, false);
  for (const session::Sample& s : record.samples) write_row(rows, record, s);
}

}  // namespace knuckle::report
