#include "app/eds/dbc_import.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "app/cli/command.h"
#include "app/eds/bus_command.h"
#include "app/eds/dbc_broadcasts.h"
#include "app/eds/dbc_commands.h"
#include "app/eds/dbc_to_machine.h"
#include "app/eds/frame_tables.h"
#include "app/eds/migrate.h"
#include "core/error.h"
#include "core/joints.h"
#include "machine/bus_description.h"
#include "machine/load.h"
#include "machine/load_bus_lines.h"
#include "machine/reason_text.h"
#include "machine/signal_units.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

/// Lines that are the same in all frames under one identifier.
struct IdentifierKeys {
  std::string ids, closing;
};

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
    std::vector<std::string> kept;
    for (const NodeChannel& channel : node.channels) {
      const SignalInfo& info = channel.info();
      const auto is_it = [&](const WantedSignal& one) {
        return one.info->role == info.role && one.info->index == info.index;
      };
      if (std::none_of(wanted.begin(), wanted.end(), is_it)) kept.emplace_back(info.name);
    }
    if (kept.size() == node.channels.size()) continue;
    if (!kept.empty())
      throw InputError(source + ": node '" + node.name + "' also has " + kept.back() + ": import that, too");
    names.push_back(node.name);
  }
  return names;
}

/// What a DBC does not say of a signal that the file did not have.
void note(const SignalInfo& signal, Import& import) {
  const std::string name = signal.name;
  if (is_angle(signal))
    import.to_do.push_back(name +
                           ": sign and zero_rad are those of the installation: set them where they are not 1 and 0");
  if (is_yes_or_no(signal)) import.to_do.push_back(name + ": on = 1 is a guess: set the raw value that says yes");
}

/// Likewise of a frame.
void note(const DbcFrame& frame, Import& import) {
  const std::string name = frame_name(*frame.message, frame.by);
  if (frame.message->j1939)
    import.to_do.push_back(name + ": is taken from whichever address sends it: set source where several devices may");
  else if ((frame.message->id & kExtendedId) != 0)
    import.to_do.push_back(name + ": set invalid_from where values can say that there is none, as in J1939");
  if (frame.by)
    import.to_do.push_back(fmt::format("{}: period_ms is that of its {} frames in turn: set how often this one comes",
                                       name, frame.by->of));
}

/// Whether a frame of the file is this message's.
template <typename There>
bool is_of(const There& there, const DbcMessage& message, std::size_t bus) {
  return there.module == 0 && there.filter().lets(message.id | (bus == 0 ? 0 : kSecondBus));
}

template <typename Frames>
bool has(const Frames& frames, const DbcMessage& message, std::size_t bus) {
  return std::any_of(frames.begin(), frames.end(), [&](const auto& there) { return is_of(there, message, bus); });
}

/// Puts frames into a machine file's text: into tables that are there already, else into new ones.
class Importer {
 public:
  /// @param closings of frames that the machine sends @param import gets what was done
  Importer(const BusDescription& before, FrameTables& tables, const DbcFile& dbc, std::size_t bus,
           const Closings& closings, Import& import)
      : before_(before), tables_(tables), dbc_(dbc), bus_(bus), closings_(closings), import_(import) {}

  /// Of frames that are there: before others come under their identifier.
  void put_closings() {
    for (const auto& [message, closing] : closings_) {
      FrameClosing was;
      for (std::size_t place = 0; place < tables_.count(Kind::kBroadcast); ++place) {
        if (!is_of(before_.broadcasts[place], *message, bus_)) continue;
        was = before_.broadcasts[place].closing;
        for (const ClosingLine& one : closing) close(Kind::kBroadcast, place, one);
      }
      import_.frames.push_back(
          fmt::format("{} ({}): {}", message->name, id_text(message->id), closing_text(closing, was)));
    }
  }

  void put(const DbcFrame& frame) {
    const auto there = place_of(frame);
    std::string lines;
    std::vector<std::string> names;
    for (const DbcFrame::Signal& signal : frame.signals) {
      const SignalInfo& info = *signal.wanted->info;
      const std::string name = info.name;
      const auto [was_in, was] = before_.broadcast(info.role, info.index);
      const bool own = was_in != nullptr && was_in->module == 0, known = own && was->info().name == name;
      const std::size_t at = own ? static_cast<std::size_t>(was_in - before_.broadcasts.data()) : 0;
      const bool stays = known && at == there;
      std::string line = signal.line;
      if (own && !stays) {
        moved_.emplace_back(at, was->info().name);
        if (known) line = tables_.merged(name, tables_.line(Kind::kBroadcast, at, name), line, kept(*signal.wanted));
      }
      names.push_back(name + (own && at != there ? " (moved from " + was_in->name + ")" : ""));
      if (!known)
        note(info, import_);
      else if (info.role == NodeRole::kEncoder && !info.is_angle)
        import_.to_do.push_back(name + ": its offset is the DBC's again: set or commission its zero");
      if (there)
        tables_.set(Kind::kBroadcast, *there, name, line, stays, kept(*signal.wanted));
      else
        lines += line + '\n';
    }
    if (!there) {
      made_.insert(frame.message->name);
      const auto [ids, closing] = beside(frame);
      tables_.append(head_text(dbc_, *frame.message, "[[bus.broadcast]]", ids, frame.by) + closing +
                         "[bus.broadcast.signals]\n" + lines,
                     bus_);
      note(frame, import_);
    }
    import_.frames.push_back(fmt::format("{} ({}): {}{}", frame_name(*frame.message, frame.by),
                                         id_text(frame.message->id), fmt::join(names, ", "),
                                         there ? ", in the table that was there" : ""));
  }

  /// When all frames are put: until then a table may get a signal in place of its last one.
  void take_out_moved() {
    for (const auto& [place, name] : moved_)
      if (tables_.erase(Kind::kBroadcast, place, name)) import_.gone_frames.push_back(before_.broadcasts[place].name);
  }

  void put(const CommandTable& table) {
    import_.frames.push_back(table.summary + (table.there ? ", in the table that was there" : ""));
    if (!table.there) {
      made_.insert(table.message->name);
      return tables_.append(table.text(), bus_);
    }
    const CommandFrame& there = before_.commands[*table.there];
    for (const CommandTable::Field& field : table.fields) {
      const auto was = std::find_if(there.fields.begin(), there.fields.end(),
                                    [&](const CommandField& one) { return one.name == field.name; });
      const bool is_there = was != there.fields.end(), moves = !field.joint.empty();
      tables_.set(Kind::kCommand, *table.there, field.name, field.line, is_there,
                  [moves](const std::string& key) { return moves && (key == "neutral" || key == "direction"); });
      if (moves && !(is_there && was->joint && kJointNames[static_cast<std::size_t>(*was->joint)] == field.joint))
        import_.to_do.push_back(fmt::format("{} in {}: its neutral {}: set it where that moves the {}", field.name,
                                            there.name, is_there ? "stays" : "is 0", field.joint));
    }
    for (const std::string& name : table.gone) (void)tables_.erase(Kind::kCommand, *table.there, name);
    for (const ClosingLine& one : table.closing) close(Kind::kCommand, *table.there, one);
  }

  /// When all commands are put: a joint is told by one frame alone. What another one had for it rests, for what is in
  /// no field is sent as raw 0, which may be full speed; without a joint the frame goes with its constants.
  void take_out_moved(const std::vector<CommandTable>& told) {
    for (std::size_t place = 0; place < tables_.count(Kind::kCommand); ++place) {
      const CommandFrame& there = before_.commands[place];
      const auto is_it = [&](const CommandTable& table) { return table.there == place; };
      const bool is_named = std::any_of(told.begin(), told.end(), is_it);
      std::vector<const CommandField*> moved;
      std::vector<std::string> constants;
      bool moves = false;
      for (const CommandField& field : there.fields) {
        if (!field.joint)
          constants.push_back(field.name);
        else if (is_told_elsewhere(told, *field.joint, place))
          moved.push_back(&field);
        else
          moves = true;
      }
      if (moved.empty()) continue;
      const std::string more = moves || is_named ? "" : not_of_dbc(place);
      if (!moves && !is_named && more.empty()) {
        const std::string with =
            fmt::format(" (with its constant{} {})", constants.size() == 1 ? "" : "s", fmt::join(constants, ", "));
        tables_.erase(Kind::kCommand, place);
        import_.gone_frames.push_back(there.name + (constants.empty() ? "" : with));
        continue;
      }
      for (const CommandField* const field : moved) put_to_rest(place, *field);
      if (!more.empty())
        import_.to_do.push_back(
            fmt::format("{}: moves no joint any more, but has {}, which {} has not: take it out "
                        "where nothing needs it",
                        there.name, more, dbc_.source));
    }
  }

  /// A period is a new frame's.
  void check_periods(const std::vector<WantedPeriod>& periods, const std::string& machine_source) const {
    for (const WantedPeriod& period : periods) {
      if (made_.contains(period.message)) continue;
      const DbcMessage& message = dbc_.usable(period.message);
      const bool is_there = has(before_.broadcasts, message, bus_) || has(before_.commands, message, bus_);
      cli::refuse_option("--period", period.message,
                         is_there ? "is in " + machine_source + " already: set its period_ms there"
                                  : "nothing is taken of it: give its --signal, --command or --constant, too");
    }
  }

 private:
  using Kind = FrameTables::Kind;

  void close(Kind kind, std::size_t place, const ClosingLine& one) {
    tables_.set_key(kind, place, one.wanted.key(), one.text(), [&](const std::string& key) { return one.keeps(key); });
  }

  [[nodiscard]] static bool is_told_elsewhere(const std::vector<CommandTable>& told, int joint, std::size_t place) {
    const char* const name = kJointNames[static_cast<std::size_t>(joint)];
    return std::any_of(told.begin(), told.end(), [&](const CommandTable& table) {
      const auto moves = [&](const CommandTable::Field& field) { return field.joint == name; };
      return table.there != place && std::any_of(table.fields.begin(), table.fields.end(), moves);
    });
  }

  /// A constant that the DBC does not say, as one by hand; empty where there is none.
  [[nodiscard]] std::string not_of_dbc(std::size_t place) const {
    if (tables_.key_line(Kind::kCommand, place, "iso11783_valve")) return "";
    const CommandFrame& there = before_.commands[place];
    const auto message = std::find_if(dbc_.messages.begin(), dbc_.messages.end(), [&](const DbcMessage& one) {
      return one.unusable.empty() && is_of(there, one, bus_);
    });
    for (const CommandField& field : there.fields) {
      const auto is_it = [&](const DbcSignal& signal) {
        return signal.name == field.name || overlap(signal.field, field.bits);
      };
      const bool is_said =
          message != dbc_.messages.end() && std::any_of(message->signals.begin(), message->signals.end(), is_it);
      if (!field.joint && !is_said) return field.name;
    }
    return "";
  }

  /// A constant of what it was while nobody moved it, and so its direction.
  void put_to_rest(std::size_t place, const CommandField& field) {
    const auto stays = [](const std::string& key) {
      return key != "unit" && key != "joint" && key != "extend" && key != "retract" && key != "direction";
    };
    tables_.set(Kind::kCommand, place, field.name, field.name + " = { }", true, stays);
    if (const auto& way = field.direction) {
      const std::string name = free_name(place, field.name);
      tables_.set(Kind::kCommand, place, name,
                  fmt::format("{} = {{ {}, neutral = {} }}", name, bits_text(way->bits), way->neutral), false, stays);
    }
    import_.at_rest.push_back(fmt::format("{} in {}", field.name, before_.commands[place].name));
  }

  /// "boom_way", or with a number where the frame has that.
  [[nodiscard]] std::string free_name(std::size_t place, const std::string& field) {
    constexpr std::size_t kLongest = 32;
    const std::vector<CommandField>& fields = before_.commands[place].fields;
    for (int number = 1;; ++number) {
      const std::string end = number == 1 ? "_way" : fmt::format("_way{}", number);
      const std::string name = field.substr(0, kLongest - end.size()) + end;
      const auto is_it = [&](const CommandField& one) { return one.name == name; };
      if (std::none_of(fields.begin(), fields.end(), is_it) && !tables_.has(Kind::kCommand, place, name)) return name;
    }
  }

  [[nodiscard]] std::optional<std::size_t> place_of(const DbcFrame& frame) const {
    for (std::size_t place = 0; place < before_.broadcasts.size(); ++place) {
      const BroadcastFrame& there = before_.broadcasts[place];
      const bool same = there.multiplexer && frame.by ? there.multiplexer->value == frame.by->value
                                                      : there.multiplexer.has_value() == frame.by.has_value();
      if (same && is_of(there, *frame.message, bus_)) return place;
    }
    return std::nullopt;
  }

  /// What the DBC says is its again; sign, zero and what else was set by hand stays.
  [[nodiscard]] static FrameTables::Keeps kept(const WantedSignal& signal) {
    return [has_travel = signal.shut.has_value()](const std::string& key) {
      if (has_travel && (key == "shut" || key == "full")) return false;
      return !is_place(key) && key != "scale" && key != "offset" && key != "unit";
    };
  }

  /// Of another frame that a multiplexer tells apart from this one; without one what is said of it.
  [[nodiscard]] IdentifierKeys beside(const DbcFrame& frame) const {
    IdentifierKeys keys;
    for (std::size_t place = 0; frame.by && place < tables_.count(Kind::kBroadcast); ++place) {
      const BroadcastFrame& other = before_.broadcasts[place];
      if (!other.multiplexer || !is_of(other, *frame.message, bus_)) continue;
      for (const char* const key : {"id", "extended", "pgn", "source"})
        if (const auto line = tables_.key_line(Kind::kBroadcast, place, key)) keys.ids += *line + '\n';
      for (const char* const key : {"counter", "checksum"})
        if (const auto line = tables_.key_line(Kind::kBroadcast, place, key)) keys.closing += *line + '\n';
      if (keys.ids.empty()) keys.ids = id_lines(*frame.message, true);  // its own are written otherwise
      return keys;
    }
    keys.ids = id_lines(*frame.message, true);
    if (const auto closing = closings_.find(frame.message); closing != closings_.end())
      for (const ClosingLine& one : closing->second) keys.closing += one.text() + '\n';
    return keys;
  }

  const BusDescription& before_;
  FrameTables& tables_;
  const DbcFile& dbc_;
  std::size_t bus_;
  const Closings& closings_;
  Import& import_;
  std::set<std::string> made_;                              // messages of new frames
  std::vector<std::pair<std::size_t, std::string>> moved_;  // signals, and the frames that had them
};

/// Knuckle must not send what the sender of a frame sends that the file has or gets.
void refuse_machines_own(const DbcFile& dbc, const std::vector<DbcFrame>& frames, const std::vector<CommandTable>& told,
                         const BusDescription& before, std::size_t bus) {
  const auto refuse_one_sender = [&](const DbcMessage& ours, const DbcMessage& theirs) {
    if (ours.sender.empty() || ours.sender != theirs.sender) return;
    throw InputError(fmt::format("{}: {} is sent by {}, who sends {} as well: Knuckle must not send it", dbc.source,
                                 ours.name, theirs.sender, theirs.name));
  };
  for (const CommandTable& table : told)
    for (const DbcFrame& frame : frames) refuse_one_sender(*table.message, *frame.message);
  for (const DbcMessage& message : dbc.messages) {
    if (has(before.broadcasts, message, bus))
      for (const CommandTable& table : told) refuse_one_sender(*table.message, message);
    if (has(before.commands, message, bus))
      for (const DbcFrame& frame : frames) refuse_one_sender(message, *frame.message);
  }
}

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

Import with_frames(const std::string& machine_text, const std::string& machine_source, const DbcFile& as_read,
                   const Wanted& wanted) {
  const std::string text = with_node_tables(machine_text, machine_source);
  const BusDescription before = parse_machine(text, machine_source).bus;
  FrameTables tables(text, machine_source);
  const auto own = [](const auto& frames) {
    return static_cast<std::size_t>(
        std::count_if(frames.begin(), frames.end(), [](const auto& frame) { return frame.module == 0; }));
  };
  if (tables.count(FrameTables::Kind::kBroadcast) != own(before.broadcasts) ||
      tables.count(FrameTables::Kind::kCommand) != own(before.commands))
    throw InputError(machine_source +
                     ": its [[bus.broadcast]] and [[bus.command]] headers must each begin a line, written as here");
  Import import;
  const std::size_t bus = bus_of(wanted.bus, before, machine_source, tables, import);
  const DbcFile dbc = with_periods(as_read, wanted.periods);
  const std::vector<DbcFrame> frames = frames_of(dbc, wanted.signals);
  Wanted commands = wanted;
  const auto sends = [&](const DbcMessage& message) { return has(before.broadcasts, message, bus); };
  const Closings closings = take_closings(dbc, frames, commands, sends, import.to_do);
  const std::vector<CommandTable> told = command_tables(dbc, commands, before, bus == 0 ? 0 : kSecondBus, import.to_do);
  refuse_machines_own(dbc, frames, told, before, bus);
  import.gone_nodes = nodes_in_place(before, wanted.signals, !told.empty(), machine_source);
  TomlTable file = TomlTable::parse(text, machine_source), bus_table = bus_tables(file).front();
  std::vector<std::string> nodes;
  for (TomlTable& node : bus_table.tables("node")) nodes.push_back(node.text("name"));
  if (!tables.erase_nodes(nodes, import.gone_nodes))
    throw InputError(machine_source + ": its [[bus.node]] headers must each begin a line, written as here");
  Importer importer(before, tables, dbc, bus, closings, import);
  importer.put_closings();
  for (const DbcFrame& frame : frames) importer.put(frame);
  importer.take_out_moved();
  for (const CommandTable& table : told) importer.put(table);
  importer.take_out_moved(told);
  importer.check_periods(wanted.periods, machine_source);
  if (std::any_of(told.begin(), told.end(), [](const CommandTable& table) { return !table.there; })) {
    import.to_do.emplace_back("commands: neutral is 0 of every joint's value: set it where that moves something");
    import.to_do.emplace_back(
        "commands: set send = \"while_led\" where a frame may not come while nobody leads, and counter and checksum "
        "where the machine's controller wants them");
    import.to_do.emplace_back(
        "valve_watchdog_ms: must be how long the machine's controller waits for command frames before it stops");
  }
  import.text = tables.text();
  (void)parse_changed(import.text, machine_source, "these frames of " + dbc.source);
  return import;
}

}  // namespace knuckle::eds
