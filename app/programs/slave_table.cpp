#include "app/programs/slave_table.h"

#include "app/recordings/csv_row.h"
#include "app/recordings/recording_reader.h"

namespace knuckle::programs {
namespace {

void write_line(std::ostream& out, const SlaveRow& row, bool names) {
  recordings::RowWriter cells(out, names);
  cells.number("time_s", to_seconds(row.at));
  for (std::size_t c = 0; c < recordings::kSignalChannels; ++c)
    cells.number(recordings::kSignalNames[c], recordings::signal(row.measurement, c));
  cells.joints("", "_valve", row.valve);
  cells.word("mode", name(row.mode));
  cells.word("blocking", name(row.blocking));
  cells.word("fault", name(row.fault));
  cells.joints("", "_rad", row.joint_rad);
  cells.joints("", "_radps", row.joint_radps);
  cells.joints("setpoint_", "_rad", row.setpoint_rad);
  cells.joints("", "_spool", row.spool);
  cells.planar("tip_force", "N", row.tip_force_N);
  cells.number("confidence", row.confidence);
  cells.number("contact", row.contact ? 1 : 0);
  cells.number("payload_kg", row.payload_kg);
  cells.number("round_trip_ms", row.round_trip_ms);
  cells.end_row();
}

}  // namespace

SlaveRow row_of(Time now, const slave::SlaveLoop& slave, const estimation::Measurement& measurement) noexcept {
  SlaveRow row;
  const SlaveMessage& told = slave.sent();
  row.at = now;
  row.measurement = measurement;
  row.valve = slave.commands();
  row.spool = slave.client().spool();
  row.mode = told.mode;
  row.blocking = told.blocking.code;
  row.fault = told.fault.code;
  row.joint_rad = told.position_rad;
  row.joint_radps = told.velocity_radps;
  row.setpoint_rad = slave.master().position_rad;
  row.tip_force_N = told.tip_force_N;
  row.confidence = told.confidence;
  row.contact = told.contact;
  row.payload_kg = told.payload_kg;
  row.round_trip_ms = 1e3 * to_seconds(slave.round_trip());
  return row;
}

void write_slave_header(std::ostream& out) {
  write_line(out, {}, true);
}

void write_slave_row(std::ostream& out, const SlaveRow& row) {
  write_line(out, row, false);
}

}  // namespace knuckle::programs
