// Reads a CSV through a mapping file (app/recordings/csv_mapping.h). What is wrong with the data is found and named
// with row and column, never silently used.
#pragma once

#include <string>
#include <vector>

#include "app/recordings/csv_cells.h"
#include "app/recordings/csv_mapping.h"

namespace knuckle::recordings {

/// One thing found in the data. Rows count from 1 with the header as row 1, as a spreadsheet shows them.
struct Finding {
  enum class Kind : unsigned char {
    kRaggedRow,  ///< Another number of cells than the header, empty ones at the end aside: none of its cells is used.
    kRepeatedTime,    ///< Two rows for one time: the first is used.
    kTimeOutOfOrder,  ///< Left out, as are the fewest rows that leave time increasing.
    kStrayTime,       ///< One of the first or last few, by hours or ten times the rest from it: left out.
    kGap,             ///< A step in time longer than the mapping's gap_s ends at this row.
    kUnevenStep,      ///< A step in time off the median by over half of it ends at this row; the row is used.
    kRepeatedRow,     ///< Every cell but the time is that of the row before: left out.
    kMissing,         ///< Empty cell. This and what follows: the cell is not used; nor the row, where it is the time's.
    kNotANumber,
    kDropOut,     ///< Zero in a column that reads zero when it fails.
    kOutOfRange,  ///< Outside the mapping's min ... max.
    kCount
  };
  Kind kind;
  std::size_t row;
  std::string column;  ///< Empty where it is about the whole row.
};
[[nodiscard]] const char* name(Finding::Kind kind) noexcept;

struct MappedChannel {
  std::string name;               ///< Knuckle's, with its unit: "boom_rad"
  std::vector<double> values;     ///< SI; NaN where the cell is not usable.
  std::string column{};           ///< In the file, for messages.
  double factor = 1, offset = 0;  ///< value = cell * factor + offset, as the mapping says.
};

struct MappedTable {
  std::string source;
  std::vector<double> time_s;  ///< Strictly increasing, first row 0.
  /// Until when repeated rows, with no gap between, went on reporting this row's cells; its own time where none did.
  std::vector<double> until_s;
  std::vector<std::size_t> rows;  ///< Where each is in the file.
  std::vector<MappedChannel> channels;
  std::vector<Finding> findings;   ///< By row.
  std::vector<std::string> notes;  ///< What else was found, one line each.
  std::size_t rows_read = 0;
  double gap_s = 0;  ///< The mapping's.
  /// @throws InputError where the mapping has no such channel.
  [[nodiscard]] const MappedChannel& channel(const std::string& channel_name) const;
  /// One line on what is used, then one for each kind of finding and column: "9 x repeated row (left out): 4, 8-9,
  /// ...", then the notes.
  [[nodiscard]] std::vector<std::string> report() const;
  /// Refuses the recording: the file, `why`, and in short what was found in it.
  [[noreturn]] void refuse(const std::string& why) const;
};

/// "4, 8-9, 12", after `most` stretches "and 30 more". @param rows increasing.
[[nodiscard]] std::string row_list(const std::vector<std::size_t>& rows, std::size_t most);

/// @throws InputError for an unreadable file, a wrong mapping, a column that is not there or twice, quotes that do not
/// close, or fewer than 4 usable rows.
[[nodiscard]] MappedTable read_mapped_csv(const std::string& csv_path, const std::string& map_path);
[[nodiscard]] MappedTable read_mapped_csv(const std::string& csv_path, const Mapping& mapping);
/// Of a file whose cells were read with the mapping's columns wanted.
[[nodiscard]] MappedTable read_mapped_csv(CsvFile file, const Mapping& mapping);

// Columns whose meaning changes half-way, as where a logger was set up anew: the unit (bar after Pa), or two channels
// that exchange their values.

/// Pressures (..._Pa), lengths (..._m) and angles (..._rad) do not jump from one row to the next by the ratio of two
/// units, or to each other's value, and stay there. What changes while they move fast, or by less than they move within
/// some rows, cannot be told from motion; nor can what changes near zero, as in a chamber that is open to the tank.
/// One pressure alone may jump so by less than hundreds, as where a held load is let down: that is only noted.
/// @throws InputError naming columns, row and values.
void refuse_halfway_changes(MappedTable& table);

}  // namespace knuckle::recordings
