// States of the loops (slave/slave_state.h, master/master_state.h) and rows of a session as CSV: a row a step, every
// field by its name. The one dialect of tables: what `simulate`, `slave`, `master` and `export` write and `identify`
// reads.
#pragma once

#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/recordings/csv_row.h"
#include "core/fields.h"
#include "slave/slave_state.h"

namespace knuckle::recordings {

/// What the columns of a field are called: joint_rad is boom_rad, arm_rad, bucket_rad; setpoint_rad begins with
/// setpoint_boom_rad; tip_force_N is tip_force_x_N and tip_force_z_N; sensors are called as in recordings that
/// `knuckle identify` reads. In front of each stands the part of the struct that the field is of: truth_boom_rad.
[[nodiscard]] std::vector<std::string> column_names(const Field& field);

/// Makes NaN of what nobody knows and the loop has as 0: pressures of a cylinder without transmitters, and the line of
/// a force that has none.
void show_unknown(slave::SlaveState& state) noexcept;
/// Where a state has nothing of that kind.
template <typename State>
void show_unknown(State& /*state*/) noexcept {}

/// Time in seconds first, then all other fields in their order, numbers with all their digits; modes and reasons as
/// words. Times of other clocks are left out. All is out when it is gone.
class StateTable {
 public:
  /// @param fields of the struct whose rows are added; the first is their time. @param more columns of words behind it.
  StateTable(std::ostream& out, std::span<const Field> fields, std::span<const std::string_view> more = {});
  /// @param row a struct that the fields are of. @param more words.
  void add(const void* row, std::span<const std::string_view> more = {});
  void flush() { rows_.flush(); }

 private:
  std::span<const Field> fields_;
  RowWriter rows_;
};

}  // namespace knuckle::recordings
