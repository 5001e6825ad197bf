#include "app/programs/slave_table.h"

#include "app/recordings/csv_row.h"
#include "app/recordings/recording_reader.h"

namespace knuckle::programs {
namespace {

void write_line(std::ostream& out, const slave::SlaveState& row, bool names) {
  recordings::RowWriter cells(out, names);
  const estimation::Measurement measurement{row.pressure_Pa, row.cylinder_m, row.hull_pitch_rad};
  cells.number("time_s", to_seconds(row.at));
  for (std::size_t c = 0; c < recordings::kSignalChannels; ++c)
    cells.number(recordings::kSignalNames[c], recordings::signal(measurement, c));
  cells.joints("", "_valve", row.valve_command);
  cells.word("mode", name(row.mode));
  cells.word("blocking", name(row.blocking.code));
  cells.word("fault", name(row.fault.code));
  cells.joints("", "_rad", row.joint_rad);
  cells.joints("", "_radps", row.joint_radps);
  cells.joints("setpoint_", "_rad", row.setpoint_rad);
  cells.joints("", "_spool", row.spool);
  cells.planar("tip_force", "N", row.tip_force_N);
  cells.number("confidence", row.confidence);
  cells.number("contact", row.contact ? 1 : 0);
  cells.number("payload_kg", row.payload_kg);
  cells.number("round_trip_ms", 1e3 * row.round_trip_s);
  cells.end_row();
}

}  // namespace

void write_slave_header(std::ostream& out) {
  write_line(out, {}, true);
}

void write_slave_row(std::ostream& out, const slave::SlaveState& row) {
  write_line(out, row, false);
}

}  // namespace knuckle::programs
