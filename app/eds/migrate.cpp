#include "app/eds/migrate.h"

#include <fmt/format.h>

#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "app/eds/bus_command.h"
#include "core/error.h"
#include "machine/bus_description.h"
#include "machine/file_text.h"
#include "machine/load.h"
#include "machine/load_bus_lines.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

constexpr std::string_view kNodes = "[bus.nodes]", kBlank = " \t\r";

std::string_view bare(std::string_view text, std::string_view around = kBlank) {
  const auto first = text.find_first_not_of(around);
  return first == std::string_view::npos ? "" : text.substr(first, text.find_last_not_of(around) - first + 1);
}

/// The comment behind what stands before `from`.
std::string_view comment_of(std::string_view line, std::size_t from) {
  const auto begin = line.find('#', from);
  return begin == std::string_view::npos ? "" : bare(line.substr(begin));
}

/// "id = 0x10" and the others of `boom_valve = { id = 0x10, ... }`. No value of a node has a comma or a bracket.
std::vector<std::string> pairs_of(std::string_view line) {
  const auto begin = line.find('{') + 1;
  std::string_view inside = line.substr(begin, line.find('}', begin) - begin);
  std::vector<std::string> pairs;
  while (!inside.empty()) {
    const auto comma = inside.find(',');
    const std::string_view one = bare(inside.substr(0, comma));
    const auto equals = one.find('=');
    pairs.push_back(fmt::format("{} = {}", bare(one.substr(0, equals), " \t\"'"), bare(one.substr(equals + 1))));
    inside.remove_prefix(comma == std::string_view::npos ? inside.size() : comma + 1);
  }
  return pairs;
}

class Migration {
 public:
  /// @param nodes [bus.nodes]
  Migration(const BusDescription& bus, TomlTable nodes) : bus_(bus) {
    for (const std::string& name : nodes.keys())
      if (nodes.table(name).has("profile")) with_profile_.insert(name);
  }

  /// Whether every node has become a table.
  [[nodiscard]] bool done() const noexcept { return !odd() && tables_.size() == bus_.nodes.size(); }
  /// The line that could not be rewritten; 0: none was found.
  [[nodiscard]] int odd() const noexcept { return odd_; }
  /// The first node that is no table yet.
  [[nodiscard]] std::string missing() const {
    for (const NodeDescription& node : bus_.nodes)
      if (!tables_.contains(node.name)) return node.name;
    return bus_.nodes.front().name;
  }

  void edit(const std::string& table, const std::string& key, std::string& line) {
    ++number_;
    const std::string end = line.ends_with('\r') ? "\r" : "";
    const bool in_nodes = table == kNodes, after_node = std::exchange(after_node_, false);
    if (in_nodes && key == kNodes) {
      if (std::exchange(headed_, true)) odd_ = odd_ == 0 ? number_ : odd_;
      line = comment_of(line, line.find(']'));
      if (!line.empty()) line += end;
    } else if (in_nodes && !key.empty()) {
      keyed(key, line, end);
      if (after_node) line.insert(0, end + '\n');
    } else if (in_nodes && after_node) {
      if (!bare(line).empty()) line.insert(0, end + '\n');
    } else if (key.starts_with("[bus.nodes.")) {
      own_table(key, line, end);
    }
  }

 private:
  /// The node of this key, which is met for the first time.
  const NodeDescription* take(std::string_view name) {
    for (const NodeDescription& node : bus_.nodes)
      if (node.name == name && tables_.insert(node.name).second) return &node;
    if (odd_ == 0) odd_ = number_;
    return nullptr;
  }

  /// What an older file does not say of a node, behind its header: lines, each ended.
  [[nodiscard]] std::string opening(const NodeDescription& node, std::string_view comment,
                                    const std::string& end) const {
    std::string lines = "\nname = " + toml_quoted(node.name);
    if (!comment.empty()) lines += fmt::format("  {}", comment);
    lines += end;
    if (!with_profile_.contains(node.name)) lines += fmt::format("\nprofile = \"{}\"{}", profile_name(node), end);
    return lines + fmt::format("\nchannels = {{ 1 = \"{}\" }}{}", node.channels.front().info().name, end);
  }

  /// boom_valve = { id = 0x10, ... }
  void keyed(std::string_view key, std::string& line, const std::string& end) {
    const NodeDescription* const node = take(bare(key, "\"'"));
    if (node == nullptr) return;
    std::string block = "[[bus.node]]" + end + opening(*node, comment_of(line, line.find('}')), end);
    for (const std::string& pair : pairs_of(line)) block += '\n' + pair + end;
    line = block;
    after_node_ = true;
  }

  /// [bus.nodes.boom_valve]: its keys stay below it.
  void own_table(const std::string& key, std::string& line, const std::string& end) {
    const std::string before = "[bus.nodes.";
    const NodeDescription* const node =
        take(bare(std::string_view(key).substr(before.size(), key.size() - before.size() - 1), "\"'"));
    if (node == nullptr) return;
    line.replace(line.find(key), key.size(), "[[bus.node]]");
    line += opening(*node, "", end);
  }

  const BusDescription& bus_;
  std::set<std::string> with_profile_, tables_;
  int number_ = 0, odd_ = 0;
  bool headed_ = false, after_node_ = false;
};

bool same_bus(const std::string& text, const std::string& source, const BusDescription& bus) {
  try {
    return parse_machine(text, source).bus == bus;
  } catch (const InputError&) {
    return false;  // its lines are none of the person's file
  }
}

}  // namespace

std::string with_node_tables(const std::string& machine_text, const std::string& machine_source) {
  const BusDescription bus = parse_machine(machine_text, machine_source).bus;
  TomlTable file = TomlTable::parse(machine_text, machine_source), bus_table = bus_tables(file).front();
  if (!bus_table.has("nodes")) return machine_text;
  Migration migration(bus, bus_table.table("nodes"));
  const std::string text = edited_toml(
      machine_text, [&](const auto& table, const auto& key, std::string& line) { migration.edit(table, key, line); });
  if (!migration.done()) {
    const std::string node = migration.missing();
    throw InputError(machine_source + ": " +
                     (migration.odd() > 0 ? fmt::format("line {}: ", migration.odd()) : std::string()) + "needs " +
                     node + " = { ... } on one line in [bus.nodes], or [bus.nodes." + node + "]");
  }
  if (!same_bus(text, machine_source, bus))
    throw InputError(machine_source + ": its nodes as [[bus.node]] tables would not be the same: cannot be rewritten");
  return text;
}

}  // namespace knuckle::eds
