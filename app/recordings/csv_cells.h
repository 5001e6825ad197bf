// The cells of a CSV file, whoever wrote it: any line ending, a byte order mark, quoted cells.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace knuckle::recordings {

inline constexpr std::size_t kLargestCsv_MB = 512;

using Cells = std::vector<std::string>;

/// Every row of the file, blank ones as rows without cells; cells without the blanks around them.
/// @throws InputError for a file that cannot be read, is empty, larger than kLargestCsv_MB or has quotes that do not
/// close.
[[nodiscard]] std::vector<Cells> read_cells(const std::string& path);

}  // namespace knuckle::recordings
