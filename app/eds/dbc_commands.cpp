#include "app/eds/dbc_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/cli/command.h"
#include "app/eds/dbc_checks.h"
#include "app/eds/dbc_text.h"
#include "app/eds/dbc_to_machine.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

/// The one that is said of this place; nullptr where none is.
template <typename Said>
const Said* find(const std::vector<Said>& all, const PlaceInDbc& place) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const Said& one) { return one.place == place; });
  return found == all.end() ? nullptr : &*found;
}

/// Whether machine files can have it as a counter: in every frame, and whole.
bool can_count(const DbcMessage& message, const DbcSignal& signal) {
  constexpr unsigned kMostBits = 32;
  return !message.is_of_packets() && !signal.condition && !signal.is_multiplexer &&
         signal.field.type == BitField::Type::kUnsigned && signal.field.bits <= kMostBits;
}

/// Of a counter: nothing where it counts as far as its bits can, or its range is none of a count.
std::optional<std::uint64_t> modulus_of(const DbcSignal& signal) {
  if (!signal.range) return std::nullopt;
  const auto raw = [&](double value) { return (value - signal.field.offset) / signal.field.scale; };
  const double last = raw(signal.range->second), most = static_cast<double>(most_of(signal.field));
  if (raw(signal.range->first) != 0 || !(last >= 1 && last < most) || last != std::floor(last)) return std::nullopt;
  return static_cast<std::uint64_t>(last) + 1;
}

/// The one that the file has already; nullptr where it has none.
const CommandFrame* frame_there(const BusDescription& before, const DbcMessage& message, std::uint32_t on) {
  const auto there = std::find_if(before.commands.begin(), before.commands.end(), [&](const CommandFrame& frame) {
    return frame.module == 0 && frame.id == (message.id | on);
  });
  return there == before.commands.end() ? nullptr : &*there;
}

/// Messages in the order in which they are named; each place must be there.
std::vector<const DbcMessage*> named_messages(const DbcFile& dbc, const Wanted& wanted, const BusDescription& before,
                                              std::uint32_t on) {
  std::vector<const DbcMessage*> all;
  const auto has = [&](const DbcMessage& message) { return std::find(all.begin(), all.end(), &message) != all.end(); };
  const auto add = [&](const PlaceInDbc& place) {
    const DbcMessage& message = dbc.usable(place.message);
    if (message.is_of_packets())
      dbc.refuse(message.line, fmt::format("{} has {} bytes: what Knuckle sends must be one frame, of at most 8",
                                           message.name, message.size));
    if (!place.signal.empty()) (void)signal_of(dbc, message, place.signal);
    if (!has(message)) all.push_back(&message);
  };
  for (const WantedCommand& one : wanted.commands) add(one.place);
  for (const WantedConstant& one : wanted.constants) add(one.place);
  for (const WantedClosing& one : wanted.closings) {
    const DbcMessage& message = dbc.usable(one.place.message);
    if (!has(message) && frame_there(before, message, on) == nullptr)
      cli::refuse_option(
          "--" + one.key(), one.place.text(),
          "nothing else is taken of " + message.name + ": give its --signal, --command or --constant, too");
    add(one.place);
  }
  for (const DbcMessage* const message : all)
    if (const DbcMessage& first = *all.front(); message->sender != first.sender)
      dbc.refuse(message->line, fmt::format("{} is sent by {}, and {} by {}: what Knuckle sends has one sender",
                                            message->name, message->sender, first.name, first.sender));
  return all;
}

class TableWriter {
 public:
  /// @param there what the machine file has of it already.
  TableWriter(const DbcFile& dbc, const DbcMessage& message, const Wanted& wanted, const CommandFrame* there)
      : dbc_(dbc), message_(message), wanted_(wanted), there_(there) {}

  [[nodiscard]] CommandTable table() {
    for (const DbcSignal& signal : message_.signals) add(signal);
    if (there_ == nullptr)
      table_.head = head_text(dbc_, message_, "[[bus.command]]", id_lines(message_, false)) + "send = \"always\"\n";
    table_.message = &message_;
    table_.summary = fmt::format("{} ({})", message_.name, id_text(message_.id));
    if (!moves_.empty()) table_.summary += fmt::format(": {}", fmt::join(moves_, ", "));
    if (!rests_.empty())
      table_.summary += fmt::format("{} constant: {}", moves_.empty() ? ":" : ";", fmt::join(rests_, ", "));
    if (!table_.closing.empty())
      table_.summary += "; " + closing_text(table_.closing, there_ != nullptr ? there_->closing : FrameClosing{});
    if (!table_.gone.empty()) table_.summary += fmt::format(", no constant any more: {}", fmt::join(table_.gone, ", "));
    return std::move(table_);
  }

 private:
  void add(const DbcSignal& signal) {
    if (signal.condition || signal.is_multiplexer)
      dbc_.refuse(message_.line, fmt::format("{} is multiplexed by {}: command frames must always be the same",
                                             message_.name, signal.name));
    const CommandField* const has = field_there(signal);
    const PlaceInDbc place{message_.name, signal.name};
    if (const WantedClosing* const closing = find(wanted_.closings, place)) {
      if (has != nullptr && !has->joint) table_.gone.push_back(has->name);
      table_.closing.push_back({*closing, &signal});
      return;
    }
    const WantedCommand* const command = find(wanted_.commands, place);
    const bool is_named = command != nullptr || find(wanted_.constants, place) != nullptr;
    if (there_ != nullptr && !is_named && (has != nullptr || closes(signal) || rest_of_all() == nullptr)) return;
    const std::string name = has != nullptr ? has->name : signal.name;
    std::string line = name + " = { " + bits_text(signal.field) + scale_text(signal.field);
    if (command != nullptr) {
      line += fmt::format(", unit = \"{}\", joint = \"{}\", neutral = 0", signal.unit, command->joint);
      if (command->extend) line += ", extend = " + number_text(*command->extend);
      if (command->retract) line += ", retract = " + number_text(*command->retract);
      moves_.push_back(command->joint);
    } else {
      const WantedConstant& constant = constant_of(signal);
      line += ", neutral = " + number_text(constant.neutral);
      if (constant.led) line += ", led = " + number_text(*constant.led);
      rests_.push_back(signal.name);
    }
    table_.fields.push_back({name, line + " }", command != nullptr ? command->joint : ""});
  }

  /// Also by another name, where a person gave it one.
  [[nodiscard]] const CommandField* field_there(const DbcSignal& signal) const {
    const CommandField* there = nullptr;
    for (std::size_t i = 0; there_ != nullptr && i < there_->fields.size(); ++i) {
      const CommandField& field = there_->fields[i];
      const bool same = field.bits.start_bit == signal.field.start_bit && field.bits.bits == signal.field.bits &&
                        field.bits.order == signal.field.order;
      if (field.name == signal.name) return &field;
      if (same) there = &field;
    }
    return there;
  }
  /// Whether the file has its bits as counter or checksum.
  [[nodiscard]] bool closes(const DbcSignal& signal) const {
    const FrameClosing& closing = there_->closing;
    return (closing.counter && overlap(closing.counter->field, signal.field)) ||
           (closing.checksum && overlap(closing.checksum->field, signal.field));
  }
  [[nodiscard]] const WantedConstant* rest_of_all() const { return find(wanted_.constants, {message_.name, ""}); }

  [[nodiscard]] const WantedConstant& constant_of(const DbcSignal& signal) const {
    const PlaceInDbc place{message_.name, signal.name};
    if (const WantedConstant* const own = find(wanted_.constants, place)) return *own;
    if (signal.is_checksum)
      dbc_.refuse(signal.line,
                  fmt::format("signal {} of {} is its checksum (SigType): say which by --checksum {}=KIND, or "
                              "--constant {}=VALUE where nothing checks it",
                              signal.name, message_.name, place.text(), place.text()));
    if (const WantedConstant* const all = rest_of_all()) return *all;
    dbc_.refuse(signal.line, fmt::format("signal {} of {} has no value to rest at: give --constant {}=VALUE, or "
                                         "{}=VALUE for all that nothing else is said of",
                                         signal.name, message_.name, place.text(), message_.name));
  }

  const DbcFile& dbc_;
  const DbcMessage& message_;
  const Wanted& wanted_;
  const CommandFrame* there_;
  CommandTable table_;
  std::vector<std::string> moves_, rests_;
};

}  // namespace

std::string ClosingLine::text() const {
  std::string bits = bits_text(signal->field);
  if (!wanted.kind.empty()) bits = fmt::format("kind = \"{}\", {}", wanted.kind, bits);
  if (wanted.modulus) bits += fmt::format(", modulus = {}", *wanted.modulus);
  return fmt::format("{} = {{ {} }}", wanted.key(), bits);
}

bool ClosingLine::keeps(const std::string& key) const {
  return !is_place(key) && key != "kind" && !(key == "modulus" && wanted.modulus);
}

std::optional<WantedClosing> counter_of(const DbcFile& dbc, const DbcMessage& message, const Wanted& wanted,
                                        std::vector<std::string>& to_do) {
  for (const WantedClosing& one : wanted.closings)
    if (one.place.message == message.name && one.kind.empty()) return std::nullopt;
  const DbcSignal* counts = nullptr;
  for (const DbcSignal& signal : message.signals) {
    const PlaceInDbc place{message.name, signal.name};
    const bool is_named = find(wanted.commands, place) != nullptr || find(wanted.constants, place) != nullptr ||
                          find(wanted.closings, place) != nullptr;
    if (!signal.is_counter || is_named) continue;
    if (!can_count(message, signal)) {
      to_do.push_back(place.text() + ": is a counter (SigType) of a kind that Knuckle does not know: left out");
      continue;
    }
    if (counts != nullptr)
      dbc.refuse(signal.line, fmt::format("{} has two counters (SigType), {} and {}: say which by --counter {}.{}",
                                          message.name, counts->name, signal.name, message.name, counts->name));
    counts = &signal;
  }
  if (counts == nullptr) return std::nullopt;
  return WantedClosing{{message.name, counts->name}, modulus_of(*counts)};
}

std::string closing_text(const std::vector<ClosingLine>& closing, const FrameClosing& there) {
  std::string text;
  for (const ClosingLine& one : closing) {
    std::string was;
    if (one.wanted.kind.empty() && there.counter) was = bits_text(there.counter->field);
    if (!one.wanted.kind.empty() && there.checksum) was = bits_text(there.checksum->field);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", one.wanted.key(), one.signal->name);
    if (!was.empty() && was != bits_text(one.signal->field)) text += " (was " + was + ")";
  }
  return text;
}

std::string CommandTable::text() const {
  std::string text = head;
  for (const ClosingLine& one : closing) text += one.text() + '\n';
  text += "[bus.command.fields]\n";
  for (const Field& field : fields) text += field.line + '\n';
  return text;
}

std::vector<CommandTable> command_tables(const DbcFile& dbc, Wanted wanted, const BusDescription& before,
                                         std::uint32_t on, std::vector<std::string>& to_do) {
  std::vector<CommandTable> tables;
  for (const DbcMessage* const message : named_messages(dbc, wanted, before, on)) {
    const CommandFrame* const there = frame_there(before, *message, on);
    if (const auto own = there == nullptr ? counter_of(dbc, *message, wanted, to_do) : std::nullopt)
      wanted.closings.push_back(*own);
    CommandTable table = TableWriter(dbc, *message, wanted, there).table();
    if (there != nullptr) table.there = static_cast<std::size_t>(there - before.commands.data());
    tables.push_back(std::move(table));
  }
  return tables;
}

}  // namespace knuckle::eds
