// Any mapping file, a line "---", any CSV: refused in one line, or a table of even columns whose time increases and
// whose cells are finite or left out.
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include "app/recordings/csv_reader.h"
#include "tests/fuzz/file_in_memory.h"
#include "tests/fuzz/require.h"

namespace {

using knuckle::test::refused_or;
using knuckle::test::require;

void check(const knuckle::recordings::MappedTable& table) {
  const std::size_t rows = table.time_s.size();
  require(rows >= 4 && rows <= table.rows_read && table.time_s.front() == 0);
  require(table.rows.size() == rows && table.until_s.size() == rows);
  for (std::size_t i = 0; i < rows; ++i) {
    require(std::isfinite(table.time_s[i]) && table.until_s[i] >= table.time_s[i]);
    require(i == 0 || table.time_s[i] > table.time_s[i - 1]);
  }
  require(!table.channels.empty());
  for (const knuckle::recordings::MappedChannel& channel : table.channels) {
    require(channel.values.size() == rows);
    for (const double value : channel.values) require(!std::isinf(value));
  }
  for (const std::string& line : table.report()) require(!line.empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view kBetween = "\n---\n";
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t at = text.find(kBetween);
  const bool both = at != std::string_view::npos;
  const knuckle::test::FileInMemory map(text.substr(0, at)), csv(both ? text.substr(at + kBetween.size()) : "");
  refused_or([&] { check(knuckle::recordings::read_mapped_csv(csv.path(), map.path())); });
  return 0;
}
