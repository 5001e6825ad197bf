#include "app/eds/dbc_import.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "app/cli/command.h"
#include "app/eds/dbc_text.h"
#include "app/eds/dbc_to_machine.h"
#include "app/eds/frame_tables.h"
#include "core/error.h"
#include "machine/bus_description.h"
#include "machine/load.h"
#include "machine/load_broadcasts.h"
#include "machine/load_bus_lines.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

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

/// One frame with what is wanted of it: of a message, those with one value of its multiplexer.
struct Frame {
  const DbcMessage* message = nullptr;
  std::optional<DbcMultiplexing> by;
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
    const auto by = multiplexing_of(dbc, message, *signal);
    auto frame = frames.end();
    for (auto other = frames.begin(); other != frames.end(); ++other) {
      if (other->message != &message) continue;
      if (other->by.has_value() != by.has_value())
        throw InputError(fmt::format(
            "{}:{}: of {} signal {} is in every frame, and {} only with one value of a multiplexer: a machine file can "
            "have but one of both kinds",
            dbc.source, message.line, message.name, by ? other->signals.front().source->name : signal->name,
            by ? signal->name : other->signals.front().source->name));
      if (!by || by->value == other->by->value) frame = other;
    }
    if (frame == frames.end()) frame = frames.insert(frames.end(), Frame{&message, by, {}});
    for (const Frame& other : frames) {
      for (const Frame::Signal& known : other.signals)
        if (known.name == one.signal) cli::refuse_option("--signal", one.signal, "is wanted twice");
    }
    frame->signals.push_back({one.signal, signal, travel_text(one)});
  }
  return frames;
}

std::string line_of(const DbcFile& dbc, const Frame& frame, const Frame::Signal& signal) {
  return fmt::format("{} = {}", signal.name,
                     field_text(dbc, *frame.message, *signal.source, signal_info(signal.name), signal.travel));
}

std::string table_of(const DbcFile& dbc, const Frame& frame) {
  std::string text = head_text(dbc, *frame.message, "[[bus.broadcast]]", true, frame.by) + "[bus.broadcast.signals]\n";
  for (const Frame::Signal& signal : frame.signals) text += line_of(dbc, frame, signal) + '\n';
  return text;
}

/// Nodes all of whose signals the frames have, or which are told what frames are to tell from now on. @throws
/// InputError where a node would lose but some.
std::vector<std::string> nodes_in_place(const BusDescription& bus, const std::vector<WantedSignal>& wanted,
                                        bool commands, const std::string& source) {
  std::vector<std::string> names;
  for (const NodeDescription& node : bus.nodes) {
    if (commands && !bus.by_frames() && node.is_told()) {
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

std::vector<std::string> names_in(const std::string& text, const std::string& source, const char* key) {
  std::vector<std::string> names;
  TomlTable file = TomlTable::parse(text, source), bus = bus_tables(file).front();
  if (!bus.has(key)) return names;
  for (TomlTable& table : bus.tables(key)) names.push_back(table.text("name"));
  return names;
}

/// What a DBC does not say of a signal that the file did not have.
void note(const std::string& name, Import& import) {
  if (name.ends_with("_angle") || name == "slope")
    import.to_do.push_back(name +
                           ": sign and zero_rad are those of the installation: set them where they are not 1 and 0");
  if (is_yes_or_no(signal_info(name)))
    import.to_do.push_back(name + ": on = 1 is a guess: set the raw value that says yes");
}

/// Likewise of a frame.
void note(const Frame& frame, Import& import) {
  const std::string name = frame_name(*frame.message, frame.by);
  if (frame.message->j1939)
    import.to_do.push_back(name + ": is taken from whichever address sends it: set source where several devices may");
  else if ((frame.message->id & kExtendedId) != 0)
    import.to_do.push_back(name + ": set invalid_from where values can say that there is none, as in J1939");
  if (frame.by)
    import.to_do.push_back(fmt::format("{}: period_ms is that of its {} frames in turn: set how often this one comes",
                                       name, frame.by->of));
}

bool same_value(const BroadcastField& field, const SignalInfo& signal) {
  return field.info().role == signal.role && field.info().index == signal.index;
}

/// Whether a key says where a number is and what kind it is.
bool is_place(const std::string& key) {
  return key == "start" || key == "bits" || key == "order" || key == "type";
}

/// Puts frames into a machine file's text: into tables that are there already, else into new ones.
class Importer {
 public:
  Importer(const BusDescription& before, FrameTables& tables, const DbcFile& dbc, std::size_t bus)
      : before_(before), tables_(tables), dbc_(dbc), bus_(bus) {}

  void put(const Frame& frame) {
    const auto there = place_of(frame);
    std::vector<std::string> names;
    std::vector<std::pair<std::size_t, std::string>> moved;
    for (const Frame::Signal& signal : frame.signals) {
      const std::string& name = signal.name;
      names.push_back(name);
      bool is_there = false;
      for (std::size_t place = 0; place < tables_.count(Kind::kBroadcast); ++place) {
        for (const BroadcastField& field : before_.broadcasts[place].fields) {
          if (!same_value(field, signal_info(name))) continue;
          if (place == there && field.info().name == name)
            is_there = true;
          else
            moved.emplace_back(place, field.info().name);
        }
      }
      if (!is_there) note(name, import);
      if (there) set(*there, frame, signal, is_there);
    }
    for (const auto& [place, name] : moved) tables_.erase(Kind::kBroadcast, place, name);
    if (!there) {
      tables_.append(table_of(dbc_, frame), bus_);
      note(frame, import);
    }
    import.frames.push_back(fmt::format("{} ({}): {}{}", frame_name(*frame.message, frame.by),
                                        id_text(frame.message->id), fmt::join(names, ", "),
                                        there ? ", in the table that was there" : ""));
  }

  void put(const CommandTable& table) {
    import.frames.push_back(table.summary + (table.there ? ", in the table that was there" : ""));
    if (!table.there) return tables_.append(table.text(), bus_);
    const CommandFrame& there = before_.commands[*table.there];
    for (const CommandTable::Field& field : table.fields) {
      const auto was = std::find_if(there.fields.begin(), there.fields.end(),
                                    [&](const CommandField& one) { return one.name == field.name; });
      const bool is_there = was != there.fields.end(), moved = is_there && was->joint && field.moves;
      tables_.set(Kind::kCommand, *table.there, field.name, field.line, is_there,
                  [moved](const std::string& key) { return moved && (key == "neutral" || key == "direction"); });
    }
    for (const auto& [key, line] : table.closing)
      tables_.set_key(Kind::kCommand, *table.there, key, line,
                      [](const std::string& of) { return !is_place(of) && of != "kind"; });
  }

  Import import;

 private:
  using Kind = FrameTables::Kind;

  [[nodiscard]] std::optional<std::size_t> place_of(const Frame& frame) const {
    const std::uint32_t on = bus_ == 0 ? 0 : kSecondBus;
    for (std::size_t place = 0; place < before_.broadcasts.size(); ++place) {
      const BroadcastFrame& there = before_.broadcasts[place];
      const bool same = there.multiplexer && frame.by ? there.multiplexer->value == frame.by->value
                                                      : there.multiplexer.has_value() == frame.by.has_value();
      if (there.module == 0 && same && there.filter().lets(frame.message->id | on)) return place;
    }
    return std::nullopt;
  }

  /// What the DBC says is its again; sign, zero and what else was set by hand stays.
  void set(std::size_t place, const Frame& frame, const Frame::Signal& signal, bool is_there) {
    tables_.set(Kind::kBroadcast, place, signal.name, line_of(dbc_, frame, signal), is_there,
                [&](const std::string& key) {
                  if (!signal.travel.empty() && (key == "shut" || key == "full")) return false;
                  return !is_place(key) && key != "scale" && key != "offset" && key != "unit";
                });
    if (!is_there) return;
    const std::string& name = signal.name;
    const BroadcastField* const was = before_.broadcast(signal_info(name).role, signal_info(name).index).field;
    const bool is_length = was->info().role == NodeRole::kEncoder && !was->info().is_angle;
    if (is_length) import.to_do.push_back(name + ": its offset is the DBC's again: set or commission its zero");
  }

  const BusDescription& before_;
  FrameTables& tables_;
  const DbcFile& dbc_;
  std::size_t bus_;
};

/// Which bus the frames are on, which is made where the file does not have it.
std::size_t bus_of(const std::optional<WantedBus>& wanted, const BusDescription& before, const std::string& source,
                   FrameTables& tables, Import& import) {
  if (!wanted) {
    if (before.second)
      cli::refuse_option("--bus", "", "is required: " + source + " has two buses, " + before.line_names());
    return 0;
  }
  for (std::size_t bus = 0; bus < before.lines(); ++bus) {
    if (before.line(bus).name != wanted->name) continue;
    if (wanted->bit_rate_kbps) cli::refuse_option("--bus", wanted->name, source + " has that bus: give its name alone");
    return bus;
  }
  if (before.second) cli::refuse_option("--bus", wanted->name, "must be one of " + before.line_names());
  if (!wanted->bit_rate_kbps)
    cli::refuse_option(
        "--bus", wanted->name,
        source + " has no such bus: for a second one give its bit rate in kbit/s, such as " + wanted->name + "=250");
  const bool nameless = before.name.empty();
  const std::string first = wanted->name == "first" ? "other" : "first";
  tables.add_bus(nameless ? std::optional(first) : std::nullopt, wanted->name, *wanted->bit_rate_kbps);
  if (nameless)
    import.to_do.push_back(first + ": is the name of the bus that was there: change it where another is better");
  import.to_do.push_back(wanted->name + ": set foreign_load_percent where others send on this bus, too");
  return 1;
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

WantedBus wanted_bus(const std::string& text) {
  const auto equals = text.find('=');
  WantedBus wanted{text.substr(0, equals), {}};
  if (equals == std::string::npos && !text.empty()) return wanted;
  const auto kbps = equals == std::string::npos ? std::nullopt : cli::whole_number(text.substr(equals + 1), 1000);
  if (wanted.name.empty() || !kbps) cli::refuse_option("--bus", text, "must be such as machine, or machine=250");
  wanted.bit_rate_kbps = static_cast<int>(*kbps);
  return wanted;
}

Import with_frames(const std::string& machine_text, const std::string& machine_source, const DbcFile& dbc,
                   const std::vector<WantedSignal>& signals, const WantedFrames& commands,
                   const std::optional<WantedBus>& on) {
  const BusDescription before = parse_machine(machine_text, machine_source).bus;
  TomlTable file = TomlTable::parse(machine_text, machine_source);
  if (bus_tables(file).front().has("nodes"))
    throw InputError(machine_source + ": needs [[bus.node]] tables: write them by knuckle bus migrate");
  FrameTables tables(machine_text, machine_source);
  const auto own = [](const auto& frames) {
    return static_cast<std::size_t>(
        std::count_if(frames.begin(), frames.end(), [](const auto& frame) { return frame.module == 0; }));
  };
  if (tables.count(FrameTables::Kind::kBroadcast) != own(before.broadcasts) ||
      tables.count(FrameTables::Kind::kCommand) != own(before.commands))
    throw InputError(machine_source +
                     ": its [[bus.broadcast]] and [[bus.command]] headers must each begin a line, written as here");
  Import import;
  const std::size_t bus = bus_of(on, before, machine_source, tables, import);
  const std::vector<Frame> frames = frames_of(dbc, signals);
  const std::vector<CommandTable> told = command_tables(dbc, commands, before, bus == 0 ? 0 : kSecondBus);
  for (const CommandTable& table : told) {
    for (const Frame& frame : frames)
      if (table.message->sender == frame.message->sender)
        throw InputError(fmt::format("{}: {} is sent by {}, who sends {} as well: Knuckle must not send it", dbc.source,
                                     table.message->name, frame.message->sender, frame.message->name));
  }
  import.gone_nodes = nodes_in_place(before, signals, !told.empty(), machine_source);
  if (!tables.erase_nodes(names_in(machine_text, machine_source, "node"), import.gone_nodes))
    throw InputError(machine_source + ": its [[bus.node]] headers must each begin a line, written as here");
  Importer importer(before, tables, dbc, bus);
  importer.import = std::move(import);
  for (const Frame& frame : frames) importer.put(frame);
  for (const CommandTable& table : told) importer.put(table);
  import = std::move(importer.import);
  if (std::any_of(told.begin(), told.end(), [](const CommandTable& table) { return !table.there; })) {
    import.to_do.emplace_back("commands: neutral is 0 of every joint's value: set it where that moves something");
    import.to_do.emplace_back(
        "commands: set send = \"while_led\" where a frame may not come while nobody leads, and counter and checksum "
        "where the machine's controller wants them");
    import.to_do.emplace_back(
        "valve_watchdog_ms: must be how long the machine's controller waits for command frames before it stops");
  }
  import.text = tables.text();
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
