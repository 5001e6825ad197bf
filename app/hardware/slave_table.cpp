#include "app/hardware/slave_table.h"

#include <charconv>
#include <string>
#include <string_view>

#include "app/commissioning/recording_reader.h"

namespace knuckle::app {
namespace {

/// Header and rows go through the same calls, so that they cannot disagree: a row is written as names or as values.
class Cells {
 public:
  explicit Cells(bool names) : names_(names) {}
  void number(const std::string& name, double value) {
    if (names_) return cell(name);
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 10);
    cell({digits.data(), end.ptr});
  }
  void word(std::string_view name, std::string_view value) { cell(names_ ? name : value); }
  void joints(const std::string& prefix, const std::string& suffix, const JointVector& values) {
    for (int j = 0; j < kJoints; ++j) number(prefix + kJointNames[static_cast<std::size_t>(j)] + suffix, values[j]);
  }
  [[nodiscard]] const std::string& line() const { return line_; }

 private:
  void cell(std::string_view value) {
    if (!line_.empty()) line_ += ',';
    line_.append(value);
  }
  bool names_;
  std::string line_;
};

void write_line(std::ostream& out, const SlaveRow& row, bool names) {
  Cells cells(names);
  cells.number("time_s", to_seconds(row.at));
  for (std::size_t c = 0; c < kSignalChannels; ++c) cells.number(kSignalNames[c], signal(row.measurement, c));
  cells.joints("", "_valve", row.valve);
  cells.word("mode", name(row.mode));
  cells.word("blocking", name(row.blocking));
  cells.word("fault", name(row.fault));
  cells.joints("", "_rad", row.joint_rad);
  cells.joints("", "_radps", row.joint_radps);
  cells.joints("setpoint_", "_rad", row.setpoint_rad);
  cells.joints("", "_spool", row.spool);
  cells.number("tip_force_x_N", row.tip_force_N.x());
  cells.number("tip_force_z_N", row.tip_force_N.y());
  cells.number("confidence", row.confidence);
  cells.number("contact", row.contact ? 1 : 0);
  cells.number("payload_kg", row.payload_kg);
  cells.number("round_trip_ms", row.round_trip_ms);
  out << cells.line() << '\n';
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

}  // namespace knuckle::app
