// The recorded states of one loop as CSV: a row a step.
#pragma once

#include <ostream>

#include "app/export/state_fields.h"
#include "app/recordings/csv_row.h"

namespace knuckle::exporting {

/// Time in seconds first, then all fields in their order, numbers with all their digits; modes and reasons as words.
/// All is out when it is gone.
template <typename State>
class StateTable {
 public:
  explicit StateTable(std::ostream& out) : rows_(out, false) {
    recordings::RowWriter names(out, true);
    write(names, State{}, true);
  }

  void add(const State& state) { write(rows_, state, false); }

 private:
  /// @param header names are asked for: else none is made.
  static void write(recordings::RowWriter& row, const State& state, bool header) {
    row.exact("time_s", to_seconds(state.at));
    for_each_field(state, [&](const char* name, const char* suffix, const auto& value) {
      using Value = std::remove_cvref_t<decltype(value)>;
      if constexpr (std::is_same_v<Value, Time>) {
        return;  // in seconds already
      } else if constexpr (std::is_enum_v<Value>) {
        row.word(name, knuckle::name(value));
      } else if constexpr (recording::ScalarField<Value>) {
        row.exact(header ? std::string(name) + suffix : "", recording::number_of(value));
      } else {
        const auto size = static_cast<std::size_t>(value.size());
        const auto names = header ? element_names(name, size, joints_of<State>(name)) : std::vector<std::string>(size);
        for (std::size_t i = 0; i < size; ++i) row.exact(names[i], value.data()[i]);
      }
    });
    row.end_row();
  }

  recordings::RowWriter rows_;
};

}  // namespace knuckle::exporting
