// A machine file's text by its tables, changed line by line: comments and what was set by hand stay.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace knuckle::eds {

class FrameTables {
 public:
  enum class Kind : unsigned char { kBroadcast, kCommand };
  /// @param source its name, in what is refused. @throws InputError where a header is indented.
  FrameTables(const std::string& text, std::string source);

  /// Of this kind, in the order of the file.
  [[nodiscard]] std::size_t count(Kind kind) const noexcept { return places(kind).size(); }

  /// Takes nodes out, with their [bus.node.*] tables. @param all names of the nodes, in their order. @return whether
  /// each was found.
  bool erase_nodes(const std::vector<std::string>& all, const std::vector<std::string>& names);
  /// Of the keys of a line "name = { ... }" that is there which stay as they are.
  using Keeps = std::function<bool(const std::string& key)>;
  /// A line "name = { ... }" of a signal or a field takes the place of the one of this name, whose comment stays, and
  /// of its keys those that `keeps` says; without one it is put behind the others.
  /// @throws InputError where the table has it in another way than on a line of its own.
  void set(Kind kind, std::size_t table, const std::string& name, const std::string& line, bool is_there,
           const Keeps& keeps);
  /// What set() makes of a line that is there. @param name of both
  [[nodiscard]] std::string merged(const std::string& name, const std::string& there, const std::string& line,
                                   const Keeps& keeps) const;
  /// Whether a signal or a field of this name is on a line of its own.
  [[nodiscard]] bool has(Kind kind, std::size_t table, const std::string& name);
  /// As it is. @throws InputError where it is not on a line of its own.
  [[nodiscard]] std::string line(Kind kind, std::size_t table, const std::string& name);
  /// Of a key of the table itself; nothing where it is not on a line of its own.
  [[nodiscard]] std::optional<std::string> key_line(Kind kind, std::size_t table, const std::string& key);
  /// Takes a signal or a field out, and the table of a broadcast where that was the last. @return whether it is gone.
  bool erase(Kind kind, std::size_t table, const std::string& name);
  /// A whole frame; comments behind its last value stay, as those of what follows.
  void erase(Kind kind, std::size_t table);
  /// Likewise a key of the table itself: "counter = { ... }".
  void set_key(Kind kind, std::size_t table, const std::string& key, const std::string& line, const Keeps& keeps);
  /// A whole table behind the last one of a bus.
  void append(const std::string& table, std::size_t bus);
  /// Makes a second [[bus]]. @param first the name of the one that is there where it has none.
  void add_bus(const std::optional<std::string>& first, const std::string& name, int bit_rate_kbps);

  [[nodiscard]] std::string text() const;

 private:
  /// From its header to the next one; signals of a broadcast and fields of a command are within its table.
  struct Table {
    std::string kind;  ///< Its header; empty before the first.
    std::size_t bus = 0;
    /// Its own, where something is behind it up to its last value; that; and what the file has then.
    std::vector<std::string> lines{}, behind{}, rest{};
  };
  using Line = std::vector<std::string>::iterator;
  [[nodiscard]] const std::vector<std::size_t>& places(Kind kind) const noexcept {
    return kind == Kind::kBroadcast ? broadcasts_ : commands_;
  }
  [[nodiscard]] Table& table(Kind kind, std::size_t place) { return tables_[places(kind)[place]]; }
  [[nodiscard]] static Line end_of_values(Line from, Line to);
  [[nodiscard]] static Line line_of(Line from, Line to, const std::string& name);
  /// Of the lines with signals or fields.
  [[nodiscard]] std::pair<Line, Line> values_of(Kind kind, Table& table) const;
  [[nodiscard]] std::string ended(const std::string& line) const {
    return line.ends_with('\r') ? line : line + line_end_;
  }

  std::string source_;
  std::vector<Table> tables_;
  std::vector<std::size_t> broadcasts_, commands_;  // places in tables_
  std::string line_end_;                            // but '\n'
};

}  // namespace knuckle::eds
