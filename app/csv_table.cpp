#include "app/csv_table.h"

#include <charconv>
#include <string_view>

#include "app/record_windows.h"

namespace knuckle::app {
namespace {

constexpr double kBarPerPa = 1e-5;
constexpr std::size_t kFlushBytes = 1 << 16;

/// Header and rows go through the same calls, so that they cannot disagree: a row is written as names or as values.
class RowWriter {
 public:
  RowWriter(std::ostream& out, bool names) : out_(out), names_(names) { text_.reserve(kFlushBytes + 8192); }
  ~RowWriter() { out_.write(text_.data(), static_cast<std::streamsize>(text_.size())); }
  RowWriter(const RowWriter&) = delete;
  RowWriter& operator=(const RowWriter&) = delete;

  void number(std::string_view name, double value) {
    if (names_) return cell(name);
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 10);
    cell({digits.data(), end.ptr});
  }
  void word(std::string_view name, std::string_view value) { cell(names_ ? name : value); }
  /// Columns prefix + joint + suffix.
  void joints(std::string_view prefix, std::string_view suffix, const JointVector& values) {
    for (int j = 0; j < kJoints; ++j)
      number(joined(prefix, kJointNames[static_cast<std::size_t>(j)], suffix), values[j]);
  }
  void planar(std::string_view name, std::string_view unit, const PlanarVector& value) {
    number(joined(name, "_x_", unit), value.x());
    number(joined(name, "_z_", unit), value.y());
  }
  void end_row() {
    text_ += '\n';
    row_is_empty_ = true;
    if (text_.size() < kFlushBytes) return;
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

 private:
  std::string joined(std::string_view a, std::string_view b, std::string_view c) const {
    std::string name;
    if (names_) name.append(a).append(b).append(c);
    return name;
  }
  void cell(std::string_view value) {
    if (!row_is_empty_) text_ += ',';
    row_is_empty_ = false;
    text_.append(value);
  }
  std::ostream& out_;
  bool names_, row_is_empty_ = true;
  std::string text_;
};

void machine_columns(RowWriter& row, const Sample& s) {
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

void hand_columns(RowWriter& row, const Sample& s) {
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

void truth_columns(RowWriter& row, const Sample& s) {
  row.joints("truth_", "_rad", s.truth_joint_rad);
  row.joints("truth_", "_radps", s.truth_joint_radps);
  row.joints("truth_spool_", "", s.truth_spool);
  row.planar("truth_tip", "m", s.truth_tip_m);
  row.planar("truth_tip_force", "N", s.truth_tip_force_N);
  row.number("truth_pipe_N", s.truth_pipe_N);
  row.number("truth_payload_kg", s.truth_payload_kg);
  row.number("truth_pump_flow_share", s.truth_pump_flow_share);
  row.number("truth_energy_to_machine_J", s.truth_energy_to_machine_J);
}

void write_row(RowWriter& row, const SessionRecord& record, const Sample& s) {
  row.number("t_s", s.t_s);
  row.word("mode", name(s.mode));
  row.word("phase", phase_name(record, s));
  row.word("blocking", name(s.blocking));
  row.word("fault", name(s.fault));
  machine_columns(row, s);
  hand_columns(row, s);
  truth_columns(row, s);
  row.end_row();
}

}  // namespace

void write_csv(const SessionRecord& record, std::ostream& out) {
  {
    RowWriter header(out, true);
    write_row(header, record, Sample{});
  }
  RowWriter rows(out, false);
  for (const Sample& s : record.samples) write_row(rows, record, s);
}

}  // namespace knuckle::app
