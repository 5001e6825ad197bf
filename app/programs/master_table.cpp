#include "app/programs/master_table.h"

#include <algorithm>

#include "app/recordings/csv_row.h"
#include "machine/device_joints.h"

namespace knuckle::programs {
namespace {

constexpr double kLongestSilence_ms = 1e6;  // also where no packet was ever received

void write_line(std::ostream& out, const MasterRow& row, bool names) {
  recordings::RowWriter cells(out, names);
  const auto flag = [&cells](const char* name, bool on) { cells.number(name, on ? 1 : 0); };
  cells.number("time_s", to_seconds(row.at));
  cells.joints("", "_rad", row.device.joint_rad, kDeviceJointNames);
  cells.joints("", "_radps", row.device.rate_radps, kDeviceJointNames);
  flag("presence", row.device.presence);
  flag("enable", row.device.enable);
  flag("clutch", row.device.clutch);
  flag("stop", row.device.stop);
  cells.word("device", name(row.device.reason.code));
  cells.joints("setpoint_", "_rad", row.setpoint_rad);
  cells.joints("setpoint_", "_radps", row.setpoint_radps);
  cells.planar("sent_force", "N", row.sent_force_N);
  cells.number("round_trip_ms", row.round_trip_ms);
  cells.number("silence_ms", row.silence_ms);
  cells.word("mode", name(row.mode));
  cells.word("blocking", name(row.blocking));
  cells.word("fault", name(row.fault));
  cells.joints("", "_rad", row.machine_rad);
  cells.planar("tip_force", "N", row.tip_force_N);
  cells.number("confidence", row.confidence);
  cells.end_row();
}

}  // namespace

MasterRow row_of(Time now, const master::MasterLoop& master) noexcept {
  MasterRow row;
  row.at = now;
  row.device = master.device();
  row.setpoint_rad = master.set_point().position_rad();
  row.setpoint_radps = master.set_point().velocity_radps();
  row.sent_force_N = master.sent_force_N();
  row.round_trip_ms = 1e3 * master.round_trip_s();
  row.silence_ms = std::min(1e3 * master.silence_s(), kLongestSilence_ms);
  if (const auto& told = master.machine()) {
    row.mode = told->mode;
    row.blocking = told->blocking.code;
    row.fault = told->fault.code;
    row.machine_rad = told->position_rad;
    row.tip_force_N = told->tip_force_N;
    row.confidence = told->confidence;
  }
  return row;
}

void write_master_header(std::ostream& out) {
  write_line(out, {}, true);
}

void write_master_row(std::ostream& out, const MasterRow& row) {
  write_line(out, row, false);
}

}  // namespace knuckle::programs
