#include "app/eds/frame_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <sstream>
#include <string_view>
#include <utility>

#include "core/error.h"

namespace knuckle::eds {
namespace {

constexpr const char* kNodeTable = "[[bus.node]]";
constexpr const char* kPartOfNode = "[bus.node.";
constexpr std::string_view kBlanks = " \t\r";

std::string without_blanks(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return "";
  return std::string(text.substr(first, text.find_last_not_of(kBlanks) - first + 1));
}

bool is_value(const std::string& line) {
  const auto first = line.find_first_not_of(kBlanks);
  return first != std::string::npos && line[first] != '#';
}

/// "name = { start = 0, bits = 8 }  # comment"
struct InlineTable {
  std::string before, after;  ///< To "{" and from "}" on, both with it.
  std::vector<std::pair<std::string, std::string>> keys;
  [[nodiscard]] const std::string* find(const std::string& key) const {
    for (const auto& [name, value] : keys)
      if (name == key) return &value;
    return nullptr;
  }
};

std::optional<InlineTable> inline_table(const std::string& line) {
  const auto opens = line.find('{');
  if (opens == std::string::npos) return std::nullopt;
  InlineTable table{.before = line.substr(0, opens + 1), .after = {}, .keys = {}};
  int depth = 0;
  bool quoted = false;
  std::string one;
  const auto end_one = [&] {
    const auto equals = one.find('=');
    if (equals != std::string::npos)
      table.keys.emplace_back(without_blanks(one.substr(0, equals)), without_blanks(one.substr(equals + 1)));
    one.clear();
  };
  for (std::size_t i = opens + 1; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"') quoted = !quoted;
    if (!quoted && depth == 0 && c == '}') {
      end_one();
      table.after = line.substr(i);
      return table;
    }
    if (!quoted && (c == '[' || c == '{')) ++depth;
    if (!quoted && (c == ']' || c == '}')) --depth;
    if (!quoted && depth == 0 && c == ',')
      end_one();
    else
      one += c;
  }
  return std::nullopt;
}

/// Blank lines in front of what is left of a table.
void erase_front_gap(std::vector<std::string>& lines) {
  while (!lines.empty() && lines.front().find_first_not_of(kBlanks) == std::string::npos) lines.erase(lines.begin());
}

/// "  [bus.node]": no value, though values of several lines may begin with a bracket, too.
bool is_indented_header(const std::string& line) {
  const auto opens = line.find_first_not_of(kBlanks);
  if (opens == 0 || opens == std::string::npos || line[opens] != '[') return false;
  const std::string header = without_blanks(line.substr(0, line.find('#')));
  const auto name = header.find_first_not_of("[ \t");
  return header.ends_with(']') && name != std::string::npos && header[name] >= 'a' && header[name] <= 'z' &&
         header.find_first_of(",\"'") == std::string::npos;
}

}  // namespace

FrameTables::FrameTables(const std::string& text, std::string source)
    : source_(std::move(source)), tables_(1), line_end_(text.find("\r\n") != std::string::npos ? "\r" : "") {
  std::istringstream in(text);
  std::size_t buses = 0;
  for (std::string line; std::getline(in, line);) {
    if (is_indented_header(line))
      throw InputError(fmt::format("{}: headers must each begin a line: {}", source_, without_blanks(line)));
    const bool begins =
        line.starts_with('[') && !line.starts_with("[bus.broadcast.") && !line.starts_with("[bus.command.");
    if (begins) {
      Table table{.kind = line.substr(0, line.find_first_of("# \t\r"))};
      if (table.kind == "[[bus]]") ++buses;
      table.bus = buses > 0 ? buses - 1 : 0;
      if (table.kind == "[[bus.broadcast]]") broadcasts_.push_back(tables_.size());
      if (table.kind == "[[bus.command]]") commands_.push_back(tables_.size());
      tables_.push_back(std::move(table));
    }
    tables_.back().lines.push_back(line);
  }
}

std::string FrameTables::text() const {
  std::string text;
  for (const Table& table : tables_)
    for (const auto* lines : {&table.lines, &table.behind, &table.rest})
      for (const std::string& line : *lines) text += line + '\n';
  return text;
}

/// Behind the last line that is more than a comment: what follows is said of the next table.
FrameTables::Line FrameTables::end_of_values(Line from, Line to) {
  return std::find_if(std::make_reverse_iterator(to), std::make_reverse_iterator(from), is_value).base();
}

FrameTables::Line FrameTables::line_of(Line from, Line to, const std::string& name) {
  return std::find_if(from, to, [&](const std::string& line) {
    const auto equals = line.find('=');
    return is_value(line) && equals != std::string::npos && without_blanks(line.substr(0, equals)) == name;
  });
}

std::pair<FrameTables::Line, FrameTables::Line> FrameTables::values_of(Kind kind, Table& table) const {
  const char* const header = kind == Kind::kBroadcast ? "[bus.broadcast.signals]" : "[bus.command.fields]";
  const auto opens = [](const std::string& line) { return line.starts_with('['); };
  auto from = std::find_if(table.lines.begin(), table.lines.end(),
                           [&](const std::string& line) { return line.starts_with(header); });
  if (from == table.lines.end())
    throw InputError(fmt::format("{}: a frame that is to be changed needs {} in a line of its own", source_, header));
  return {from + 1, std::find_if(from + 1, table.lines.end(), opens)};
}

bool FrameTables::erase_nodes(const std::vector<std::string>& all, const std::vector<std::string>& names) {
  std::size_t place = 0;
  bool is_gone = false;
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    const auto is_part = [&](std::size_t table) {
      return table < tables_.size() && tables_[table].kind.starts_with(kPartOfNode);
    };
    if (!is_part(i)) {
      is_gone = tables_[i].kind == kNodeTable && place < all.size() &&
                std::find(names.begin(), names.end(), all[place]) != names.end();
      if (tables_[i].kind == kNodeTable) ++place;
    }
    if (!is_gone) continue;
    std::vector<std::string>& lines = tables_[i].lines;
    lines.erase(lines.begin(), is_part(i + 1) ? lines.end() : end_of_values(lines.begin(), lines.end()));
    erase_front_gap(lines);
  }
  return place == all.size();
}

std::string FrameTables::merged(const std::string& name, const std::string& there, const std::string& line,
                                const Keeps& keeps) const {
  const auto was = inline_table(there);
  if (!was) throw InputError(fmt::format("{}: {} must be a table in one line: {} = {{ ... }}", source_, name, name));
  const InlineTable is = inline_table(line).value();
  std::string keys;
  const auto add = [&](const std::string& key, const std::string& value) {
    keys += fmt::format("{}{} = {}", keys.empty() ? "" : ", ", key, value);
  };
  for (const auto& [key, value] : is.keys) {
    const std::string* const before = keeps(key) ? was->find(key) : nullptr;
    add(key, before != nullptr ? *before : value);
  }
  for (const auto& [key, value] : was->keys)
    if (keeps(key) && is.find(key) == nullptr) add(key, value);
  return was->before + " " + keys + " " + was->after;
}

void FrameTables::set(Kind kind, std::size_t place, const std::string& name, const std::string& line, bool is_there,
                      const Keeps& keeps) {
  Table& frame = table(kind, place);
  const auto [from, to] = values_of(kind, frame);
  const auto found = line_of(from, to, name);
  if (found != to || is_there)
    *found = merged(name, found != to ? *found : "", line, keeps);
  else
    frame.lines.insert(end_of_values(from, to), ended(line));
}

bool FrameTables::has(Kind kind, std::size_t place, const std::string& name) {
  const auto [from, to] = values_of(kind, table(kind, place));
  return line_of(from, to, name) != to;
}

std::string FrameTables::line(Kind kind, std::size_t place, const std::string& name) {
  const auto [from, to] = values_of(kind, table(kind, place));
  const auto found = line_of(from, to, name);
  if (found == to) throw InputError(fmt::format("{}: {} must be on a line of its own", source_, name));
  return *found;
}

std::optional<std::string> FrameTables::key_line(Kind kind, std::size_t place, const std::string& key) {
  Table& frame = table(kind, place);
  const auto opens = [](const std::string& line) { return line.starts_with('['); };
  const Line end = std::find_if(frame.lines.begin() + 1, frame.lines.end(), opens);  // of its values, where it has any
  const auto found = line_of(frame.lines.begin(), end, key);
  return found != end ? std::optional(*found) : std::nullopt;
}

bool FrameTables::erase(Kind kind, std::size_t place, const std::string& name) {
  Table& frame = table(kind, place);
  const auto [from, to] = values_of(kind, frame);
  const auto found = line_of(from, to, name);
  if (found == to) throw InputError(fmt::format("{}: {} must be on a line of its own", source_, name));
  const bool last = kind == Kind::kBroadcast && std::count_if(from, to, is_value) == 1;
  if (last)
    erase(kind, place);
  else
    frame.lines.erase(found);
  return last;
}

void FrameTables::erase(Kind kind, std::size_t place) {
  std::vector<std::string>& lines = table(kind, place).lines;
  lines.erase(lines.begin(), end_of_values(lines.begin(), lines.end()));
  erase_front_gap(lines);
}

void FrameTables::set_key(Kind kind, std::size_t place, const std::string& key, const std::string& line,
                          const Keeps& keeps) {
  Table& frame = table(kind, place);
  const Line end = values_of(kind, frame).first - 1;
  const auto found = line_of(frame.lines.begin(), end, key);
  if (found != end)
    *found = merged(key, *found, line, keeps);
  else
    frame.lines.insert(end, ended(line));
}

void FrameTables::append(const std::string& added, std::size_t bus) {
  const auto last = std::find_if(tables_.rbegin(), tables_.rend(), [&](const Table& table) {
    return table.bus == bus && (table.kind.starts_with("[bus") || table.kind.starts_with("[[bus"));
  });
  if (last == tables_.rend()) throw InputError(source_ + ": has no [bus] or [[bus]] that begins a line");
  const Line end = end_of_values(last->lines.begin(), last->lines.end());
  last->rest.insert(last->rest.begin(), end, last->lines.end());
  last->lines.erase(end, last->lines.end());
  const bool is_gone = last->lines.empty() && last->behind.empty();  // what is above ends with a blank line
  if (!is_gone) last->behind.push_back(line_end_);
  if (is_gone && last->rest.empty()) last->rest.push_back(line_end_);
  std::istringstream in(added);
  for (std::string line; std::getline(in, line);) last->behind.push_back(ended(line));
}

void FrameTables::add_bus(const std::optional<std::string>& first, const std::string& name, int bit_rate_kbps) {
  const auto only = std::find_if(tables_.begin(), tables_.end(),
                                 [](const Table& table) { return table.kind == "[bus]" || table.kind == "[[bus]]"; });
  if (only == tables_.end()) throw InputError(source_ + ": has no [bus] that begins a line");
  if (only->kind == "[bus]") only->lines.front().replace(0, only->kind.size(), "[[bus]]");
  only->kind = "[[bus]]";
  if (first) only->lines.insert(only->lines.begin() + 1, ended("name = \"" + *first + "\""));
  append(fmt::format("[[bus]]\nname = \"{}\"\nbit_rate_kbps = {}\n", name, bit_rate_kbps), 0);
  // What follows is put behind it.
  const auto last = std::find_if(tables_.rbegin(), tables_.rend(), [](const Table& table) {
    return table.kind.starts_with("[bus") || table.kind.starts_with("[[bus");
  });
  last->bus = 1;
}

}  // namespace knuckle::eds
