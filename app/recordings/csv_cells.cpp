#include "app/recordings/csv_cells.h"

#include <csv.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <utility>

#include "app/cli/interrupt.h"
#include "core/error.h"
#include "machine/whole_file.h"

namespace knuckle::recordings {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;  // parsed before a signal is looked for again

std::string trimmed(std::string text) {
  const auto space = [](unsigned char c) { return std::isspace(c) != 0; };
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), space));
  text.erase(std::find_if_not(text.rbegin(), text.rend(), space).base(), text.end());
  return text;
}

/// The file with every line ending as one '\n', so that blank lines can be counted, and without a byte order mark.
std::string read_text(const std::string& path) {
  const std::string bytes = whole_file(path, kLargestCsv_MB);
  std::string text;
  text.reserve(bytes.size());
  for (std::size_t i = bytes.starts_with("\xEF\xBB\xBF") ? 3 : 0; i < bytes.size(); ++i) {
    if (bytes[i] != '\r') {
      text += bytes[i];
    } else if (i + 1 == bytes.size() || bytes[i + 1] != '\n') {
      text += '\n';
    }
  }
  if (trimmed(text).empty()) throw InputError(path + ": is empty");
  return text;
}

}  // namespace

std::vector<Cells> read_cells(const std::string& path) {
  const std::string text = read_text(path);
  struct Sink {
    std::vector<Cells> rows;
    Cells row;
  } sink;
  csv_parser parser;
  if (csv_init(&parser, CSV_STRICT | CSV_STRICT_FINI | CSV_REPALL_NL) != 0) {
    throw InputError(path + ": cannot start the CSV parser");
  }
  const std::unique_ptr<csv_parser, void (*)(csv_parser*)> guard(&parser, csv_free);
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
  if (!parsed || csv_fini(&parser, cell, end, &sink) != 0) {
    throw InputError(path + ": row " + std::to_string(sink.rows.size() + 1) +
                     ": a quote that does not open or close a cell");
  }
  return std::move(sink.rows);
}

}  // namespace knuckle::recordings
