#include "app/eds/dbc_broadcasts.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/cli/command.h"
#include "machine/signal_units.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

/// As machine files write it.
std::string unit_name(const std::string& unit) {
  if (unit == "°" || unit == "\xB0" || unit == "degree" || unit == "degrees") return "deg";
  if (unit == "°C" || unit == std::string("\xB0") + "C" || unit == "deg C" || unit == "C") return "degC";
  return unit;
}

/// "boom_angle = { start = 0, ... }" @throws InputError where its unit is none that machine files know of it.
std::string line_of(const DbcFile& dbc, const DbcMessage& message, const DbcSignal& signal,
                    const WantedSignal& wanted) {
  const std::string begin = fmt::format("{} = {{ {}", wanted.info->name, bits_text(signal.field, signal.first_byte));
  if (is_yes_or_no(*wanted.info)) return begin + ", on = 1 }";
  std::string units, travel;
  bool is_known = false;
  for (const Unit& unit : units_of(*wanted.info)) {
    is_known = is_known || unit.name == unit_name(signal.unit);
    units += (units.empty() ? "" : ", ") + std::string(unit.name);
  }
  if (!is_known)
    dbc.refuse(signal.line, fmt::format("signal {} of {} has the unit \"{}\": must be {}", signal.name, message.name,
                                        signal.unit, units));
  if (wanted.shut) travel = fmt::format(", shut = {}, full = {}", number_text(*wanted.shut), number_text(*wanted.full));
  return fmt::format("{}{}, unit = \"{}\"{} }}", begin, scale_text(signal.field), unit_name(signal.unit), travel);
}

/// The one of Knuckle's signals that is taken from there; nullptr where none is.
const SignalInfo* taken_as(const std::vector<DbcFrame>& frames, const PlaceInDbc& place) {
  for (const DbcFrame& frame : frames)
    for (const DbcFrame::Signal& signal : frame.signals)
      if (signal.wanted->place == place) return signal.wanted->info;
  return nullptr;
}

}  // namespace

std::vector<DbcFrame> frames_of(const DbcFile& dbc, const std::vector<WantedSignal>& wanted) {
  std::vector<DbcFrame> frames;
  for (const WantedSignal& one : wanted) {
    const DbcMessage& message = dbc.usable(one.place.message);
    const DbcSignal& signal = signal_of(dbc, message, one.place.signal);
    const auto by = multiplexing_of(dbc, message, signal);
    DbcFrame* frame = nullptr;
    for (DbcFrame& other : frames) {
      if (other.message != &message) continue;
      const std::string& its = other.signals.front().source->name;
      if (other.by.has_value() != by.has_value())
        dbc.refuse(message.line,
                   fmt::format("of {} signal {} is in every frame, and {} only with one value of a multiplexer: a "
                               "machine file can have but one of both kinds",
                               message.name, by ? its : signal.name, by ? signal.name : its));
      if (!by || by->value == other.by->value) frame = &other;
    }
    if (frame == nullptr) frame = &frames.emplace_back(DbcFrame{&message, by, {}});
    frame->signals.push_back({&one, &signal, line_of(dbc, message, signal, one)});
  }
  return frames;
}

Closings take_closings(const DbcFile& dbc, const std::vector<DbcFrame>& frames, Wanted& wanted,
                       const std::function<bool(const DbcMessage&)>& is_there, std::vector<std::string>& to_do) {
  Closings closings;
  for (const DbcFrame& frame : frames) {
    if (!closings.try_emplace(frame.message).second || is_there(*frame.message)) continue;
    const auto own = counter_of(dbc, *frame.message, wanted, to_do);
    if (own && taken_as(frames, own->place) == nullptr) wanted.closings.insert(wanted.closings.begin(), *own);
  }
  std::erase_if(wanted.closings, [&](const WantedClosing& one) {
    const DbcMessage& message = dbc.usable(one.place.message);
    if (!closings.contains(&message) && !is_there(message)) return false;
    const DbcSignal& signal = signal_of(dbc, message, one.place.signal);
    const std::string option = "--" + one.key(), text = one.place.text();
    if (const SignalInfo* const other = taken_as(frames, one.place))
      cli::refuse_option(option, text, std::string("is named as ") + other->name + ", too");
    if (signal.condition)
      cli::refuse_option(option, text, "is not in every frame of its message: a multiplexer says in which");
    if (signal.is_multiplexer) cli::refuse_option(option, text, "is the multiplexer of its message");
    closings[&message].push_back({one, &signal});
    return true;
  });
  std::erase_if(closings, [](const auto& one) { return one.second.empty(); });
  return closings;
}

}  // namespace knuckle::eds
