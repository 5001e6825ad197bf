#include "app/eds/dbc_import.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <utility>

#include "app/cli/command.h"
#include "app/eds/dbc_text.h"
#include "app/eds/dbc_to_machine.h"
#include "core/error.h"
#include "machine/bus_description.h"
#include "machine/load.h"
#include "machine/load_broadcasts.h"
#include "machine/load_bus_lines.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

constexpr const char* kNodeTable = "[[bus.node]]";

const SignalInfo& signal_info(const std::string& name) {
  if (const auto place = measured_signal(name)) return kSignals[*place];
  cli::refuse_option("--signal", name, fmt::format("must be one of {}", fmt::join(measured_signal_names(), ", ")));
}

constexpr std::array kUnitNames{"bar", "Pa",    "kPa",  "MPa", "mm", "m", "rad", "deg",
                                "rpm", "rad/s", "degC", "h",   "s",  "V", "%"};

/// As machine files write it; empty where they know none such.
std::string unit_name(std::string unit) {
  if (unit == "°" || unit == "\xB0" || unit == "degree" || unit == "degrees") unit = "deg";
  if (unit == "°C" ||
      unit ==
          "\xB0"
          "C" ||
      unit == "deg C" || unit == "C")
    unit = "degC";
  return std::find(kUnitNames.begin(), kUnitNames.end(), unit) != kUnitNames.end() ? unit : "";
}

/// ", shut = 0.6, full = 2.8"
std::string travel_text(const WantedSignal& wanted) {
  if (wanted.travel.empty()) return "";
  const auto comma = wanted.travel.find(','), full = wanted.travel.find("full=", comma);
  const bool ordered = wanted.travel.starts_with("shut=") && comma != std::string::npos && full == comma + 1;
  const auto shut_at = ordered ? number_in<double>(wanted.travel.substr(5, comma - 5)) : std::nullopt;
  const auto full_at = ordered ? number_in<double>(wanted.travel.substr(full + 5)) : std::nullopt;
  if (!shut_at || !full_at)
    cli::refuse_option("--signal", wanted.travel, "must be such as shut=0.6,full=2.8, in the DBC's unit");
  return fmt::format(", shut = {}, full = {}", number_text(*shut_at), number_text(*full_at));
}

std::string field_text(const DbcFile& dbc, const DbcMessage& message, const DbcSignal& signal, const SignalInfo& info,
                       const std::string& travel) {
  if (is_yes_or_no(info)) return "{ " + bits_text(signal.field) + ", on = 1 }";
  const std::string unit = unit_name(signal.unit);
  if (unit.empty())
    throw InputError(fmt::format("{}:{}: signal {} of {} has the unit \"{}\": must be {}", dbc.source, signal.line,
                                 signal.name, message.name, signal.unit, fmt::join(kUnitNames, ", ")));
  return "{ " + bits_text(signal.field) + scale_text(signal.field) + ", unit = \"" + unit + "\"" + travel + " }";
}

/// One message with what is wanted of it.
struct Frame {
  const DbcMessage* message = nullptr;
  struct Signal {
    std::string name;  ///< Knuckle's.
    const DbcSignal* source;
    std::string travel;  ///< travel_text()
  };
  std::vector<Signal> signals;
};

std::vector<Frame> frames_of(const DbcFile& dbc, const std::vector<WantedSignal>& wanted) {
  std::vector<Frame> frames;
  for (const WantedSignal& one : wanted) {
    (void)signal_info(one.signal);
    const DbcMessage& message = dbc.usable(one.message);
    const DbcSignal* const signal = &signal_of(dbc, message, one.source);
    auto frame = std::find_if(frames.begin(), frames.end(), [&](const Frame& f) { return f.message == &message; });
    if (frame == frames.end()) frame = frames.insert(frames.end(), Frame{&message, {}});
    for (const Frame& other : frames) {
      for (const Frame::Signal& known : other.signals)
        if (known.name == one.signal) cli::refuse_option("--signal", one.signal, "is wanted twice");
    }
    frame->signals.push_back({one.signal, signal, travel_text(one)});
  }
  return frames;
}

std::string table_of(const DbcFile& dbc, const Frame& frame) {
  std::string text = head_text(dbc, *frame.message, "[[bus.broadcast]]", true) + "[bus.broadcast.signals]\n";
  for (const auto& [name, signal, travel] : frame.signals)
    text += fmt::format("{} = {}\n", name, field_text(dbc, *frame.message, *signal, signal_info(name), travel));
  return text;
}

/// From its header to the next one; signals of a broadcast and fields of a command are within its table.
struct Table {
  std::string kind;  ///< Its header; empty before the first.
  std::vector<std::string> lines;
};

std::vector<Table> tables_of(const std::string& text) {
  std::vector<Table> tables(1);
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    const bool begins =
        line.starts_with('[') && !line.starts_with("[bus.broadcast.") && !line.starts_with("[bus.command.");
    if (begins) tables.push_back({line.substr(0, line.find_first_of("# \t\r")), {}});
    tables.back().lines.push_back(line);
  }
  return tables;
}

std::string text_of(const std::vector<Table>& tables) {
  std::string text;
  for (const Table& table : tables)
    for (const std::string& line : table.lines) text += line + '\n';
  return text;
}

/// Nodes all of whose signals the frames have, or which are told what the frames tell. @throws InputError where a node
/// would lose but some.
std::vector<std::string> nodes_in_place(const BusDescription& bus, const std::vector<WantedSignal>& wanted,
                                        bool commands, const std::string& source) {
  std::vector<std::string> names;
  for (const NodeDescription& node : bus.nodes) {
    if (commands && node.is_told()) {
      names.push_back(node.name);
      continue;
    }
    std::string kept;
    std::size_t lost = 0;
    for (const NodeChannel& channel : node.channels) {
      const bool is_lost = std::any_of(wanted.begin(), wanted.end(), [&](const WantedSignal& one) {
        const SignalInfo& signal = signal_info(one.signal);
        return signal.role == channel.info().role && signal.index == channel.info().index;
      });
      if (is_lost)
        ++lost;
      else
        kept = channel.info().name;
    }
    if (lost == 0) continue;
    if (lost < node.channels.size())
      throw InputError(source + ": node '" + node.name + "' also has " + kept + ": import that, too");
    names.push_back(node.name);
  }
  return names;
}

/// Behind the last line that is more than a comment: what follows is said of the next table.
std::vector<std::string>::iterator end_of_values(Table& table) {
  const auto is_value = [](const std::string& line) {
    const auto first = line.find_first_not_of(" \t\r");
    return first != std::string::npos && line[first] != '#';
  };
  return std::find_if(table.lines.rbegin(), table.lines.rend(), is_value).base();
}

/// @param all names of the nodes, in their order. @return whether each was found.
bool erase_nodes(std::vector<Table>& tables, const std::vector<std::string>& all,
                 const std::vector<std::string>& names) {
  std::size_t place = 0;
  for (Table& table : tables) {
    if (table.kind != kNodeTable || place++ >= all.size()) continue;
    const std::string& name = all[place - 1];
    if (std::find(names.begin(), names.end(), name) == names.end()) continue;
    table.lines.erase(table.lines.begin(), end_of_values(table));
    table.kind.clear();
  }
  return place == all.size();
}

std::vector<std::string> names_in(const std::string& text, const std::string& source, const char* key) {
  std::vector<std::string> names;
  TomlTable file = TomlTable::parse(text, source), bus = bus_tables(file).front();
  if (!bus.has(key)) return names;
  for (TomlTable& table : bus.tables(key)) names.push_back(table.text("name"));
  return names;
}

/// What a person may have changed is not replaced.
void refuse_again(const std::string& text, const std::string& source, const std::string& kind,
                  const std::string& name) {
  const std::vector<std::string> there = names_in(text, source, kind.c_str());
  if (std::find(there.begin(), there.end(), name) == there.end()) return;
  throw InputError(source + ": has a " + kind + " '" + name +
                   "' already, perhaps with values set by hand: take its table out first");
}

/// What it has, and what a DBC does not say of it.
void note(const Frame& frame, Import& import) {
  const std::string& message = frame.message->name;
  if (frame.message->j1939)
    import.to_do.push_back(message +
                           ": is taken from whichever address sends it: set source where several devices may");
  else if ((frame.message->id & kExtendedId) != 0)
    import.to_do.push_back(message + ": set invalid_from where values can say that there is none, as in J1939");
  std::vector<std::string> names;
  for (const Frame::Signal& signal : frame.signals) names.push_back(signal.name);
  import.frames.push_back(fmt::format("{} ({}): {}", message, id_text(frame.message->id), fmt::join(names, ", ")));
  for (const std::string& name : names) {
    if (name.ends_with("_angle") || name == "slope")
      import.to_do.push_back(name +
                             ": sign and zero_rad are those of the installation: set them where they are not 1 and 0");
    if (is_yes_or_no(signal_info(name)))
      import.to_do.push_back(name + ": on = 1 is a guess: set the raw value that says yes");
  }
}

/// The file's text with these tables behind the last one of the bus, and without these nodes.
std::string with_tables(const std::string& text, const std::string& source, const std::vector<std::string>& added,
                        const std::vector<std::string>& nodes, const std::vector<std::string>& gone) {
  std::vector<Table> tables = tables_of(text);
  const bool found = erase_nodes(tables, nodes, gone);
  const auto last = std::find_if(tables.rbegin(), tables.rend(), [](const Table& table) {
    return table.kind.starts_with("[bus") || table.kind.starts_with("[[bus");
  });
  if (!found || last == tables.rend())
    throw InputError(source + ": its [[bus.node]] headers must each begin a line, written as here");
  const std::string line_end = text.find("\r\n") != std::string::npos ? "\r" : "";
  std::vector<std::string> lines;
  for (const std::string& table : added) {
    lines.push_back(line_end);
    std::istringstream in(table);
    for (std::string line; std::getline(in, line);) lines.push_back(line + line_end);
  }
  last->lines.insert(end_of_values(*last), lines.begin(), lines.end());
  return text_of(tables);
}

}  // namespace

WantedSignal wanted_signal(const std::string& text) {
  const auto equals = text.find('='), point = text.find('.', equals == std::string::npos ? 0 : equals);
  if (equals == std::string::npos || equals == 0 || point == std::string::npos || point == equals + 1 ||
      point + 1 == text.size())
    cli::refuse_option("--signal", text, "must be such as boom_angle=MESSAGE.SIGNAL, both as the DBC calls them");
  const auto colon = text.find(':', point);
  return {text.substr(0, equals), text.substr(equals + 1, point - equals - 1),
          text.substr(point + 1, colon - point - 1), colon == std::string::npos ? "" : text.substr(colon + 1)};
}

Import with_frames(const std::string& machine_text, const std::string& machine_source, const DbcFile& dbc,
                   const std::vector<WantedSignal>& signals, const WantedFrames& commands) {
  const BusDescription before = parse_machine(machine_text, machine_source).bus;
  if (before.second)
    throw InputError(machine_source +
                     ": has two buses: import into a file with one [bus], then move each table below the "
                     "[[bus]] that it is on");
  TomlTable file = TomlTable::parse(machine_text, machine_source);
  if (bus_tables(file).front().has("nodes"))
    throw InputError(machine_source + ": needs [[bus.node]] tables: write them by knuckle bus migrate");
  const std::vector<std::string> nodes = names_in(machine_text, machine_source, "node");
  const std::vector<Frame> frames = frames_of(dbc, signals);
  const std::vector<CommandTable> told = command_tables(dbc, commands);
  for (const CommandTable& table : told) {
    for (const Frame& frame : frames)
      if (dbc.usable(table.name).sender == frame.message->sender)
        throw InputError(fmt::format("{}: {} is sent by {}, who sends {} as well: Knuckle must not send it", dbc.source,
                                     table.name, frame.message->sender, frame.message->name));
  }
  Import import;
  import.gone_nodes = nodes_in_place(before, signals, !told.empty(), machine_source);
  std::vector<std::string> added;
  for (const Frame& frame : frames) {
    refuse_again(machine_text, machine_source, "broadcast", frame.message->name);
    added.push_back(table_of(dbc, frame));
    note(frame, import);
  }
  for (const CommandTable& table : told) {
    refuse_again(machine_text, machine_source, "command", table.name);
    added.push_back(table.text);
    import.frames.push_back(table.summary);
  }
  if (!told.empty()) {
    import.to_do.emplace_back("commands: neutral is 0 of every joint's value: set it where that moves something");
    import.to_do.emplace_back(
        "commands: set send = \"while_led\" where a frame may not come while nobody leads, and counter and checksum "
        "where the machine's controller wants them");
    import.to_do.emplace_back(
        "valve_watchdog_ms: must be how long the machine's controller waits for command frames before it stops");
  }
  import.text = with_tables(machine_text, machine_source, added, nodes, import.gone_nodes);
  try {
    (void)parse_machine(import.text, machine_source);
  } catch (const FileErrors& errors) {
    std::string all;
    for (const std::string& line : errors.lines())
      all += (all.empty() ? "" : "; ") + line.substr(line.find(": ", machine_source.size()) + 2);
    throw InputError(machine_source + ": is as it was: with these frames of " + dbc.source +
                     " it would be refused: " + all);
  }
  return import;
}

}  // namespace knuckle::eds
