#include "app/eds/dbc_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "app/cli/command.h"
#include "app/eds/dbc_checks.h"
#include "app/eds/dbc_text.h"
#include "app/eds/dbc_to_machine.h"
#include "core/error.h"
#include "core/joints.h"
#include "machine/load_frames.h"
#include "machine/reason_text.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

/// MESSAGE.SIGNAL, or MESSAGE alone.
PlaceInDbc place_in(const std::string& text) {
  const auto point = text.find('.');
  if (point == std::string::npos) return {text, ""};
  return {text.substr(0, point), text.substr(point + 1)};
}

bool is(const PlaceInDbc& place, const DbcMessage& message, const DbcSignal& signal) {
  return place.message == message.name && place.signal == signal.name;
}

template <typename Wanted>
const Wanted* find(const std::vector<Wanted>& all, const DbcMessage& message, const DbcSignal& signal) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Wanted& one) { return is(one.place, message, signal); });
  return found == all.end() ? nullptr : &*found;
}

/// As something else than a counter.
bool is_named(const WantedFrames& wanted, const DbcMessage& message, const DbcSignal& signal) {
  return find(wanted.commands, message, signal) != nullptr || find(wanted.constants, message, signal) != nullptr ||
         find(wanted.checksums, message, signal) != nullptr;
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

/// Messages in the order in which they are named; each place must be there.
class NamedMessages {
 public:
  explicit NamedMessages(const DbcFile& dbc) : dbc_(dbc) {}
  void add(const PlaceInDbc& place) {
    const DbcMessage& message = dbc_.usable(place.message);
    if (message.is_of_packets())
      throw InputError(fmt::format("{}:{}: {} has {} bytes: what Knuckle sends must be one frame, of at most 8",
                                   dbc_.source, message.line, message.name, message.size));
    if (!place.signal.empty()) (void)signal_of(dbc_, message, place.signal);
    if (!has(message)) all.push_back(&message);
  }
  [[nodiscard]] bool has(const DbcMessage& message) const {
    return std::find(all.begin(), all.end(), &message) != all.end();
  }
  std::vector<const DbcMessage*> all;

 private:
  const DbcFile& dbc_;
};

class TableWriter {
 public:
  /// @param there what the machine file has of it already.
  TableWriter(const DbcFile& dbc, const DbcMessage& message, const WantedFrames& wanted, const CommandFrame* there)
      : dbc_(dbc), message_(message), wanted_(wanted), there_(there) {}

  [[nodiscard]] CommandTable table() {
    for (const DbcSignal& signal : message_.signals) add(signal);
    if (there_ == nullptr) table_.head = head_text(dbc_, message_, "[[bus.command]]") + "send = \"always\"\n";
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
      throw InputError(fmt::format("{}:{}: {} is multiplexed by {}: command frames must always be the same",
                                   dbc_.source, message_.line, message_.name, signal.name));
    const CommandField* const has = field_there(signal);
    const WantedCounter* const counter = find(wanted_.counters, message_, signal);
    const WantedChecksum* const sum = find(wanted_.checksums, message_, signal);
    if (counter != nullptr || sum != nullptr) {
      if (has != nullptr && !has->joint) table_.gone.push_back(has->name);
      table_.closing.push_back(counter != nullptr ? closing_line(*counter, signal) : closing_line(*sum, signal));
      return;
    }
    if (there_ != nullptr && !is_named(wanted_, message_, signal) &&
        (has != nullptr || closes(signal) || rest_of_all() == nullptr))
      return;
    const std::string name = has != nullptr ? has->name : signal.name;
    std::string line = name + " = { " + bits_text(signal.field) + scale_text(signal.field);
    const WantedCommand* const command = find(wanted_.commands, message_, signal);
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
  [[nodiscard]] const WantedConstant* rest_of_all() const {
    const auto all = std::find_if(wanted_.constants.begin(), wanted_.constants.end(), [&](const WantedConstant& one) {
      return one.place.message == message_.name && one.place.signal.empty();
    });
    return all == wanted_.constants.end() ? nullptr : &*all;
  }

  [[nodiscard]] const WantedConstant& constant_of(const DbcSignal& signal) const {
    if (const WantedConstant* const own = find(wanted_.constants, message_, signal)) return *own;
    if (signal.is_checksum)
      throw InputError(
          fmt::format("{}:{}: signal {} of {} is its checksum (SigType): say which by --checksum {}.{}=KIND, or "
                      "--constant {}.{}=VALUE where nothing checks it",
                      dbc_.source, signal.line, signal.name, message_.name, message_.name, signal.name, message_.name,
                      signal.name));
    if (const WantedConstant* const all = rest_of_all()) return *all;
    throw InputError(
        fmt::format("{}:{}: signal {} of {} has no value to rest at: give --constant {}.{}=VALUE, or "
                    "{}=VALUE for all that nothing else is said of",
                    dbc_.source, signal.line, signal.name, message_.name, message_.name, signal.name, message_.name));
  }

  const DbcFile& dbc_;
  const DbcMessage& message_;
  const WantedFrames& wanted_;
  const CommandFrame* there_;
  CommandTable table_;
  std::vector<std::string> moves_, rests_;
};

}  // namespace

WantedCommand wanted_command(const std::string& text) {
  const auto refuse = [&]() -> WantedCommand {
    cli::refuse_option("--command", text, "must be such as boom=MESSAGE.SIGNAL:extend=0.4,retract=-0.4");
  };
  const auto equals = text.find('='), colon = text.find(':');
  if (equals == std::string::npos || colon == std::string::npos || colon < equals) return refuse();
  WantedCommand wanted;
  wanted.joint = text.substr(0, equals);
  if (std::find(kJointNames.begin(), kJointNames.end(), wanted.joint) == kJointNames.end())
    cli::refuse_option("--command", text, fmt::format("must begin with one of {}", fmt::join(kJointNames, ", ")));
  wanted.place = place_in(text.substr(equals + 1, colon - equals - 1));
  if (wanted.place.message.empty() || wanted.place.signal.empty()) return refuse();
  std::string rest = text.substr(colon + 1);
  while (!rest.empty()) {
    const auto comma = rest.find(',');
    const std::string one = rest.substr(0, comma);
    rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
    const auto value = one.find('=');
    const std::string key = one.substr(0, value);
    const auto number = value == std::string::npos ? std::nullopt : number_in<double>(one.substr(value + 1));
    std::optional<double>* const to = key == "extend" ? &wanted.extend : key == "retract" ? &wanted.retract : nullptr;
    if (!number || to == nullptr || *to) return refuse();
    *to = number;
  }
  return wanted.extend || wanted.retract ? wanted : refuse();
}

WantedConstant wanted_constant(const std::string& text) {
  const auto equals = text.find('='), comma = text.find(',', equals == std::string::npos ? 0 : equals);
  const bool has_led = comma != std::string::npos;
  const std::string first = equals == std::string::npos ? "" : text.substr(equals + 1, comma - equals - 1);
  const auto neutral = number_in<double>(first);
  const auto led = has_led ? number_in<double>(text.substr(comma + 1)) : std::nullopt;
  const PlaceInDbc place = place_in(text.substr(0, equals));
  if (place.message.empty() || !neutral || (has_led && (!led || place.signal.empty())))
    cli::refuse_option("--constant", text, "must be such as MESSAGE.SIGNAL=0, MESSAGE.SIGNAL=0,2 or MESSAGE=0");
  return {place, *neutral, led};
}

WantedCounter wanted_counter(const std::string& text) {
  const auto equals = text.find('=');
  const PlaceInDbc place = place_in(text.substr(0, equals));
  const bool has_modulus = equals != std::string::npos;
  const auto modulus = has_modulus ? number_in<std::uint64_t>(text.substr(equals + 1)) : std::nullopt;
  if (place.message.empty() || place.signal.empty() || (has_modulus && !modulus))
    cli::refuse_option("--counter", text,
                       "must be such as MESSAGE.SIGNAL, or MESSAGE.SIGNAL=15 where it counts from 0 to 14");
  return {place, modulus};
}

WantedChecksum wanted_checksum(const std::string& text) {
  const auto equals = text.find('=');
  const PlaceInDbc place = place_in(text.substr(0, equals));
  const std::string kind = equals == std::string::npos ? "" : text.substr(equals + 1);
  if (place.message.empty() || place.signal.empty() ||
      std::find(kChecksumNames.begin(), kChecksumNames.end(), kind) == kChecksumNames.end())
    cli::refuse_option(
        "--checksum", text,
        fmt::format("must be such as MESSAGE.SIGNAL=crc8-j1850, or with one of {}", fmt::join(kChecksumNames, ", ")));
  return {place, kind};
}

WantedPeriod wanted_period(const std::string& text) {
  constexpr double kMost_ms = 10000;  // of several packets; most frames have less
  const auto equals = text.find('=');
  const auto period_ms = equals == std::string::npos ? std::nullopt : number_in<double>(text.substr(equals + 1));
  if (equals == 0 || !period_ms || !(*period_ms >= 1 && *period_ms <= kMost_ms))
    cli::refuse_option("--period", text, fmt::format("must be such as MESSAGE=20, in ms within [1, {}]", kMost_ms));
  return {text.substr(0, equals), *period_ms};
}

void refuse_twice(const WantedFrames& wanted) {
  std::set<std::string> said;
  const auto say = [&](const PlaceInDbc& place, const char* option) {
    const std::string text = place.message + (place.signal.empty() ? "" : "." + place.signal);
    if (!said.insert(text).second) cli::refuse_option(option, text, "is said twice");
  };
  for (const WantedCommand& one : wanted.commands) say(one.place, "--command");
  for (const WantedConstant& one : wanted.constants) say(one.place, "--constant");
  for (const WantedCounter& one : wanted.counters) {
    say(one.place, "--counter");
    say({one.place.message + " (counter)", ""}, "--counter");
  }
  for (const WantedChecksum& one : wanted.checksums) {
    say(one.place, "--checksum");
    say({one.place.message + " (checksum)", ""}, "--checksum");
  }
  std::map<std::string, std::string> moved_by;  // joint, message
  for (const WantedCommand& one : wanted.commands) {
    const std::string& message = moved_by.emplace(one.joint, one.place.message).first->second;
    if (message != one.place.message)
      cli::refuse_option(
          "--command", one.joint,
          fmt::format("is in {} and in {}: one message alone must move a joint", message, one.place.message));
  }
  said.clear();
  for (const WantedPeriod& one : wanted.periods) say({one.message, ""}, "--period");
}

bool ClosingLine::keeps(const std::string& of) const {
  const bool says = of == "kind" || (of == "modulus" && line.find("modulus") != std::string::npos);
  return !says && !is_place(of);
}

ClosingLine closing_line(const WantedCounter& counter, const DbcSignal& signal) {
  const std::string modulus = counter.modulus ? fmt::format(", modulus = {}", *counter.modulus) : "";
  return {"counter", fmt::format("counter = {{ {}{} }}", bits_text(signal.field), modulus), signal.name, signal.field};
}

ClosingLine closing_line(const WantedChecksum& checksum, const DbcSignal& signal) {
  return {"checksum", fmt::format("checksum = {{ kind = \"{}\", {} }}", checksum.kind, bits_text(signal.field)),
          signal.name, signal.field};
}

std::optional<WantedCounter> counter_of(const DbcFile& dbc, const DbcMessage& message, const WantedFrames& wanted,
                                        std::vector<std::string>& to_do) {
  const auto is_own = [&](const WantedCounter& one) { return one.place.message == message.name; };
  if (std::any_of(wanted.counters.begin(), wanted.counters.end(), is_own)) return std::nullopt;
  const DbcSignal* counts = nullptr;
  for (const DbcSignal& signal : message.signals) {
    if (!signal.is_counter || is_named(wanted, message, signal)) continue;
    if (!can_count(message, signal)) {
      to_do.push_back(fmt::format("{}.{}: is a counter (SigType) of a kind that Knuckle does not know: left out",
                                  message.name, signal.name));
      continue;
    }
    if (counts != nullptr)
      throw InputError(fmt::format("{}:{}: {} has two counters (SigType), {} and {}: say which by --counter {}.{}",
                                   dbc.source, signal.line, message.name, counts->name, signal.name, message.name,
                                   counts->name));
    counts = &signal;
  }
  if (counts == nullptr) return std::nullopt;
  return WantedCounter{{message.name, counts->name}, modulus_of(*counts)};
}

std::string closing_text(const std::vector<ClosingLine>& closing, const FrameClosing& there) {
  std::string text;
  for (const ClosingLine& one : closing) {
    std::string was;
    if (one.key == "counter" && there.counter) was = bits_text(there.counter->field);
    if (one.key == "checksum" && there.checksum) was = bits_text(there.checksum->field);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", one.key, one.signal);
    if (!was.empty() && was != bits_text(one.field)) text += " (was " + was + ")";
  }
  return text;
}

std::string CommandTable::text() const {
  std::string text = head;
  for (const ClosingLine& one : closing) text += one.line + '\n';
  text += "[bus.command.fields]\n";
  for (const Field& field : fields) text += field.line + '\n';
  return text;
}

std::vector<CommandTable> command_tables(const DbcFile& dbc, const WantedFrames& as_said, const BusDescription& before,
                                         std::uint32_t on, std::vector<std::string>& to_do) {
  WantedFrames wanted = as_said;
  NamedMessages messages(dbc);
  for (const WantedCommand& one : wanted.commands) messages.add(one.place);
  for (const WantedConstant& one : wanted.constants) messages.add(one.place);
  const auto there_of = [&](const DbcMessage& message) {
    const auto there = std::find_if(before.commands.begin(), before.commands.end(), [&](const CommandFrame& frame) {
      return frame.module == 0 && frame.id == (message.id | on);
    });
    return there != before.commands.end() ? &*there : nullptr;
  };
  const auto add_closing = [&](const PlaceInDbc& place, const char* option) {
    const DbcMessage& message = dbc.usable(place.message);
    if (!messages.has(message) && there_of(message) == nullptr)
      cli::refuse_option(
          option, place.message + "." + place.signal,
          "nothing else is taken of " + place.message + ": give its --signal, --command or --constant, too");
    messages.add(place);
  };
  for (const WantedCounter& one : as_said.counters) add_closing(one.place, "--counter");
  for (const WantedChecksum& one : as_said.checksums) add_closing(one.place, "--checksum");
  for (const DbcMessage* const message : messages.all) {
    const DbcMessage& first = *messages.all.front();
    if (message->sender != first.sender)
      throw InputError(fmt::format("{}:{}: {} is sent by {}, and {} by {}: what Knuckle sends has one sender",
                                   dbc.source, message->line, message->name, message->sender, first.name,
                                   first.sender));
  }
  std::vector<CommandTable> tables;
  for (const DbcMessage* const message : messages.all) {
    const CommandFrame* const there = there_of(*message);
    if (const auto own = there == nullptr ? counter_of(dbc, *message, wanted, to_do) : std::nullopt)
      wanted.counters.push_back(*own);
    CommandTable table = TableWriter(dbc, *message, wanted, there).table();
    if (there != nullptr) table.there = static_cast<std::size_t>(there - before.commands.data());
    tables.push_back(std::move(table));
  }
  return tables;
}

}  // namespace knuckle::eds
