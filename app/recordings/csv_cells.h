// The cells of a CSV file, whoever wrote it: UTF-8, UTF-16 or Latin-1, any line ending, delimiter and decimal mark,
// quoted cells.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace knuckle::recordings {

inline constexpr std::size_t kLargestCsv_MB = 512;

using Cells = std::vector<std::string>;

struct CsvFile {
  std::string path;
  /// Blank ones as rows without cells; cells in UTF-8, without the blanks around them. A line "sep=;" in front of the
  /// header is not counted, as spreadsheets do not count it.
  std::vector<Cells> rows;
  std::string encoding = "UTF-8";
  char delimiter = ',';
  char decimal_mark = '.';  ///< As find_decimal_mark() has found it.

  /// "UTF-16, delimiter ';', decimal mark ','": what of it is unusual; empty where nothing is.
  [[nodiscard]] std::string style() const;
  /// The whole cell as a finite number, else NaN.
  [[nodiscard]] double number(const std::string& cell) const;
};

struct EncodedText {
  std::string utf8;      ///< Without a byte order mark.
  std::string encoding;  ///< That it was in: "UTF-8", "UTF-16", "Latin-1".
};
/// Bytes of a text file. UTF-16 by its byte order mark, or by the zero bytes that text has in it; UTF-8 where it is
/// that; else Latin-1.
[[nodiscard]] EncodedText to_utf8(std::string bytes);

/// Every row of the file. Of the usual delimiters (comma, semicolon, tab, bar) it is the one by which most of the
/// columns that are wanted are there, and then the rows fit the header and hold numbers best.
/// @throws InputError for a file that cannot be read, is empty, larger than kLargestCsv_MB or has quotes that do not
/// close.
[[nodiscard]] CsvFile read_cells(const std::string& path, const std::vector<std::string>& wanted = {});

/// By the cells of these columns. @throws InputError where they are not certain: some have a comma and others a point,
/// or "1,278" might be a thousand.
void find_decimal_mark(CsvFile& file, const std::vector<std::size_t>& columns);

/// The whole cell as a finite number, else NaN.
[[nodiscard]] double number_in(std::string_view cell, char decimal_mark = '.');

/// A column of this name in the header, below which it must be once. @throws InputError with the delimiter that was
/// found, and what columns there are.
[[nodiscard]] std::size_t column_index(const CsvFile& file, const std::string& column);

}  // namespace knuckle::recordings
