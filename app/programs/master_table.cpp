#include "app/programs/master_table.h"

#include <algorithm>

#include "app/recordings/csv_row.h"
#include "machine/device_joints.h"

namespace knuckle::programs {
namespace {

constexpr double kLongestSilence_ms = 1e6;  // also where no packet was ever received

void write_line(std::ostream& out, const master::MasterState& row, bool names) {
  recordings::RowWriter cells(out, names);
  const auto flag = [&cells](const char* name, bool on) { cells.number(name, on ? 1 : 0); };
  cells.number("time_s", to_seconds(row.at));
  cells.joints("", "_rad", row.device_rad, kDeviceJointNames);
  cells.joints("", "_radps", row.device_radps, kDeviceJointNames);
  flag("presence", row.presence);
  flag("enable", row.enable);
  flag("clutch", row.clutch);
  flag("stop", row.stop);
  cells.word("device", name(row.device.code));
  cells.joints("setpoint_", "_rad", row.setpoint_rad);
  cells.joints("setpoint_", "_radps", row.setpoint_radps);
  cells.planar("sent_force", "N", row.sent_force_N);
  cells.number("round_trip_ms", 1e3 * row.round_trip_s);
  cells.number("silence_ms", std::min(1e3 * row.silence_s, kLongestSilence_ms));
  cells.word("mode", name(row.mode));
  cells.word("blocking", name(row.blocking.code));
  cells.word("fault", name(row.fault.code));
  cells.joints("", "_rad", row.machine_rad);
  cells.planar("tip_force", "N", row.tip_force_N);
  cells.number("confidence", row.confidence);
  cells.end_row();
}

}  // namespace

void write_master_header(std::ostream& out) {
  write_line(out, {}, true);
}

void write_master_row(std::ostream& out, const master::MasterState& row) {
  write_line(out, row, false);
}

}  // namespace knuckle::programs
