#include "app/recordings/csv_cells.h"

#include <csv.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "app/cli/interrupt.h"
#include "core/error.h"
#include "core/text.h"
#include "core/units.h"
#include "machine/file_text.h"

namespace knuckle::recordings {
namespace {

constexpr char32_t kReplacement = 0xfffd;

void append(std::string& text, char32_t character) {
  const auto add = [&](char32_t byte) { text += static_cast<char>(byte); };
  if (character < 0x80) return add(character);
  if (character < 0x800) {
    add(0xc0 | (character >> 6));
  } else {
    if (character < 0x10000) {
      add(0xe0 | (character >> 12));
    } else {
      add(0xf0 | (character >> 18));
      add(0x80 | ((character >> 12) & 0x3f));
    }
    add(0x80 | ((character >> 6) & 0x3f));
  }
  add(0x80 | (character & 0x3f));
}

std::string from_utf16(std::string_view bytes, bool big_endian) {
  const auto unit_at = [&](std::size_t at) {
    const auto first = static_cast<std::uint8_t>(bytes[at]), second = static_cast<std::uint8_t>(bytes[at + 1]);
    return static_cast<char32_t>(big_endian ? first << 8 | second : second << 8 | first);
  };
  std::string text;
  text.reserve(bytes.size() / 2);
  for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) {
    const char32_t unit = unit_at(at);
    const bool leads = unit >= 0xd800 && unit < 0xdc00, follows = unit >= 0xdc00 && unit < 0xe000;
    const char32_t next = leads && at + 3 < bytes.size() ? unit_at(at + 2) : 0;
    if (next >= 0xdc00 && next < 0xe000) {
      append(text, 0x10000 + ((unit - 0xd800) << 10) + (next - 0xdc00));
      at += 2;
    } else {
      append(text, leads || follows ? kReplacement : unit);
    }
  }
  return text;
}

bool is_utf8(std::string_view bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const auto lead = static_cast<std::uint8_t>(bytes[at]);
    const std::size_t size = lead < 0x80   ? 1
                             : lead < 0xc2 ? 0
                             : lead < 0xe0 ? 2
                             : lead < 0xf0 ? 3
                             : lead < 0xf5 ? 4
                                           : 0;
    if (size == 0 || at + size > bytes.size()) return false;
    for (std::size_t i = 1; i < size; ++i)
      if ((static_cast<std::uint8_t>(bytes[at + i]) & 0xc0) != 0x80) return false;
    at += size;
  }
  return true;
}

/// Of the first characters' bytes at even or odd places, nearly all are zero: so is text in Latin letters.
bool has_zeros_at(std::string_view bytes, std::size_t offset) {
  constexpr std::size_t kLooked = 64;
  std::size_t zeros = 0, looked = 0;
  for (std::size_t at = offset; at < bytes.size() && looked < kLooked; at += 2, ++looked)
    zeros += bytes[at] == '\0' ? 1U : 0U;
  return looked >= 2 && 10 * zeros >= 9 * looked;
}

}  // namespace

EncodedText to_utf8(std::string bytes) {
  using namespace std::string_view_literals;
  const std::string_view all = bytes;
  if (all.starts_with("\xff\xfe"sv)) return {from_utf16(all.substr(2), false), "UTF-16"};
  if (all.starts_with("\xfe\xff"sv)) return {from_utf16(all.substr(2), true), "UTF-16"};
  if (all.starts_with("\xef\xbb\xbf"sv)) return {bytes.substr(3), "UTF-8"};
  if (has_zeros_at(all, 1)) return {from_utf16(all, false), "UTF-16"};
  if (has_zeros_at(all, 0)) return {from_utf16(all, true), "UTF-16"};
  if (is_utf8(all)) return {std::move(bytes), "UTF-8"};
  std::string text;
  text.reserve(all.size() + all.size() / 8);
  for (const char c : all) append(text, static_cast<std::uint8_t>(c));
  return {std::move(text), "Latin-1"};
}

namespace {

constexpr std::array kDelimiters{',', ';', '\t', '|'};
constexpr std::size_t kPieceBytes = std::size_t{1} << 20;   // parsed before a signal is looked for again
constexpr std::size_t kSampleBytes = std::size_t{1} << 16;  // by which the delimiter is found

std::string trimmed(std::string text) {
  const auto space = [](unsigned char c) { return std::isspace(c) != 0; };
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), space));
  text.erase(std::find_if_not(text.rbegin(), text.rend(), space).base(), text.end());
  return text;
}

/// Every line ending as one '\n', so that blank lines can be counted.
std::string with_plain_ends(const std::string& bytes) {
  std::string text;
  text.reserve(bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] != '\r') {
      text += bytes[i];
    } else if (i + 1 == bytes.size() || bytes[i + 1] != '\n') {
      text += '\n';
    }
  }
  return text;
}

/// Takes away a first line "sep=;", by which spreadsheets say their delimiter.
std::optional<char> take_said_delimiter(std::string& text) {
  const std::size_t end = text.find('\n');
  std::string line = text.substr(0, end);
  std::erase(line, '"');
  while (!line.empty() && line.back() == ' ') line.pop_back();
  constexpr std::string_view kSays = "sep=";
  const bool says = line.size() == kSays.size() + 1 &&
                    std::equal(kSays.begin(), kSays.end(), line.begin(),
                               [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
  if (!says || end == std::string::npos) return std::nullopt;
  text.erase(0, end + 1);
  return line.back();
}

struct Parsed {
  std::vector<Cells> rows;
  bool whole = false;  ///< Else there is a quote that does not open or close a cell, behind these rows.
};

Parsed parse(std::string_view text, char delimiter) {
  struct Sink {
    std::vector<Cells> rows;
    Cells row;
  } sink;
  csv_parser parser;
  if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI | CSV_REPALL_NL) != 0) return {};
  const std::unique_ptr<csv_parser, void (*)(csv_parser*)> guard(&parser, csv_free);
  csv_set_delim(&parser, static_cast<unsigned char>(delimiter));
  // Then a tab is no blank around a cell.
  if (delimiter == '\t') csv_set_space_func(&parser, [](unsigned char c) { return c == ' ' ? 1 : 0; });
  const auto cell = [](void* data, std::size_t size, void* to) {
    static_cast<Sink*>(to)->row.push_back(trimmed(std::string(static_cast<const char*>(data), size)));
  };
  const auto end = [](int, void* to) {
    auto* s = static_cast<Sink*>(to);
    s->rows.push_back(std::exchange(s->row, {}));
  };
  bool parsed = true;
  for (std::size_t at = 0; at < text.size() && parsed; at += kPieceBytes) {
    cli::check_interrupt();
    const std::size_t bytes = std::min(kPieceBytes, text.size() - at);
    parsed = csv_parse(&parser, text.data() + at, bytes, cell, end, &sink) == bytes;
  }
  parsed = parsed && csv_fini(&parser, cell, end, &sink) == 0;
  return {std::move(sink.rows), parsed};
}

/// Without the empty cells at the end of a line.
std::size_t width(const Cells& row) {
  return static_cast<std::size_t>(
      std::find_if(row.rbegin(), row.rend(), [](const std::string& c) { return !c.empty(); }).base() - row.begin());
}

/// How well a delimiter explains the beginning of a file; the larger the better.
auto worth(std::string_view sample, char delimiter, const std::vector<std::string>& wanted) {
  const std::vector<Cells> rows = parse(sample, delimiter).rows;
  std::size_t there = 0, counted = 0, fitting = 0, cells = 0, numbers = 0;
  if (!rows.empty()) {
    const Cells& header = rows.front();
    for (const std::string& name : wanted)
      there += std::find(header.begin(), header.end(), name) != header.end() ? 1U : 0U;
    for (std::size_t r = 1; r < rows.size(); ++r) {
      if (width(rows[r]) == 0) continue;
      ++counted;
      fitting += width(rows[r]) == width(header) ? 1U : 0U;
      for (const std::string& cell : rows[r]) {
        ++cells;
        numbers += std::isfinite(number_in(cell)) || std::isfinite(number_in(cell, ',')) ? 1U : 0U;
      }
    }
  }
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
  };
  return std::tuple(there, share(fitting, counted), share(numbers, cells), rows.empty() ? 0 : width(rows.front()));
}

char best_delimiter(const std::string& text, const std::vector<std::string>& wanted) {
  std::string_view sample = std::string_view(text).substr(0, kSampleBytes);
  if (sample.size() < text.size()) sample = sample.substr(0, sample.rfind('\n') + 1);
  return *std::max_element(kDelimiters.begin(), kDelimiters.end(),
                           [&](char a, char b) { return worth(sample, a, wanted) < worth(sample, b, wanted); });
}

std::string name_of_delimiter(char delimiter) {
  return delimiter == '\t' ? "tab" : fmt::format("'{}'", printable({&delimiter, 1}));
}

/// A cell with a decimal comma; with a comma in front of three digits it may be a thousand, which one writes whose
/// decimal mark is a point and whose delimiter, then, a comma.
enum class Comma { kNone, kThousandPerhaps, kDecimal };
Comma comma_in(const std::string& cell, char delimiter) {
  const std::size_t at = cell.find(',');
  if (at == std::string::npos || !std::isfinite(number_in(cell, ','))) return Comma::kNone;
  const std::size_t before = cell.find_first_not_of("+-"), digits = before < at ? at - before : 0;
  const bool thousand = digits >= 1 && digits <= 3 && cell[before] != '0' && cell.size() - at - 1 == 3;
  return thousand && delimiter == ',' ? Comma::kThousandPerhaps : Comma::kDecimal;
}

}  // namespace

std::string CsvFile::style() const {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  if (encoding != "UTF-8") add(encoding);
  if (delimiter != ',' || decimal_mark != '.') {
    add("delimiter " + name_of_delimiter(delimiter));
    add(fmt::format("decimal mark '{}'", decimal_mark));
  }
  return text;
}

double CsvFile::number(const std::string& cell) const {
  return number_in(cell, decimal_mark);
}

double number_in(std::string_view cell, char decimal_mark) {
  std::string with_point;
  if (decimal_mark != '.') {
    if (cell.find('.') != std::string_view::npos) return kUnknown;
    with_point = cell;
    std::replace(with_point.begin(), with_point.end(), decimal_mark, '.');
    cell = with_point;
  }
  if (cell.starts_with('+')) cell.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  const bool whole = error == std::errc() && end == cell.data() + cell.size();
  return whole && std::isfinite(value) ? value : kUnknown;
}

CsvFile read_cells(const std::string& path, const std::vector<std::string>& wanted) {
  EncodedText text = to_utf8(whole_file(path, kLargestCsv_MB));
  text.utf8 = with_plain_ends(text.utf8);
  CsvFile file{.path = path, .rows = {}, .encoding = text.encoding};
  const std::optional<char> said = take_said_delimiter(text.utf8);
  if (trimmed(text.utf8).empty()) throw InputError(path + ": is empty");
  file.delimiter = said ? *said : best_delimiter(text.utf8, wanted);
  Parsed parsed = parse(text.utf8, file.delimiter);
  file.rows = std::move(parsed.rows);
  if (!parsed.whole) {
    throw InputError(path + ": row " + std::to_string(file.rows.size() + 1) +
                     ": a quote that does not open or close a cell");
  }
  return file;
}

void find_decimal_mark(CsvFile& file, const std::vector<std::size_t>& columns) {
  struct Example {
    std::size_t row = 0;
    std::string cell;
  };
  std::optional<Example> comma, point, thousand;
  for (std::size_t r = 1; r < file.rows.size() && !(comma && point); ++r) {
    for (const std::size_t c : columns) {
      if (c >= file.rows[r].size()) continue;
      const std::string& cell = file.rows[r][c];
      const Comma found = comma_in(cell, file.delimiter);
      if (found == Comma::kDecimal && !comma) comma = {r + 1, cell};
      if (found == Comma::kThousandPerhaps && !thousand) thousand = {r + 1, cell};
      if (!point && cell.find('.') != std::string::npos && std::isfinite(number_in(cell))) point = {r + 1, cell};
    }
  }
  const auto refuse = [&](const std::string& why) {
    throw InputError(fmt::format("{}: delimiter {}: the decimal mark is not certain: {}", file.path,
                                 name_of_delimiter(file.delimiter), why));
  };
  if (comma && point)
    refuse(fmt::format("row {} has '{}', row {} '{}'", comma->row, comma->cell, point->row, point->cell));
  if (thousand && !comma && !point)
    refuse(fmt::format("'{}' in row {} may be a number with a decimal comma, or a thousand", thousand->cell,
                       thousand->row));
  file.decimal_mark = comma ? ',' : '.';
}

std::size_t column_index(const CsvFile& file, const std::string& column) {
  const Cells& header = file.rows.front();
  const auto it = std::find(header.begin(), header.end(), column);
  if (it == header.end()) {
    constexpr std::size_t kMostNamed = 8;
    std::string there;
    for (std::size_t i = 0; i < std::min(header.size(), kMostNamed); ++i)
      there += fmt::format("{}'{}'", i > 0 ? ", " : "", shortened(header[i]));
    if (header.size() > kMostNamed) there += fmt::format(" and {} more", header.size() - kMostNamed);
    throw InputError(fmt::format("{}: row 1: no column '{}'; with delimiter {} there are {}", file.path, column,
                                 name_of_delimiter(file.delimiter), there));
  }
  if (std::find(it + 1, header.end(), column) != header.end())
    throw InputError(file.path + ": row 1: column '" + column + "' appears twice");
  return static_cast<std::size_t>(it - header.begin());
}

}  // namespace knuckle::recordings
