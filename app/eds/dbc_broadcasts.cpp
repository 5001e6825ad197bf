#include "app/eds/dbc_broadcasts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "app/cli/command.h"
#include "app/eds/dbc_text.h"
#include "core/error.h"
#include "machine/load_broadcasts.h"
#include "machine/toml_reader.h"

namespace knuckle::eds {
namespace {

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
  const std::string bits = bits_text(signal.field, signal.first_byte);
  if (is_yes_or_no(info)) return "{ " + bits + ", on = 1 }";
  const std::string unit = unit_name(signal.unit);
  if (unit.empty())
    throw InputError(fmt::format("{}:{}: signal {} of {} has the unit \"{}\": must be {}", dbc.source, signal.line,
                                 signal.name, message.name, signal.unit, fmt::join(kUnitNames, ", ")));
  return "{ " + bits + scale_text(signal.field) + ", unit = \"" + unit + "\"" + travel + " }";
}

/// The one of Knuckle's signals that is taken from there; nullptr where none is.
const std::string* taken_as(const std::vector<DbcFrame>& frames, const DbcMessage& message, const std::string& source) {
  for (const DbcFrame& frame : frames)
    for (const DbcFrame::Signal& signal : frame.signals)
      if (frame.message == &message && signal.source->name == source) return &signal.name;
  return nullptr;
}

}  // namespace

const SignalInfo& signal_info(const std::string& name) {
  if (const auto place = measured_signal(name)) return kSignals[*place];
  cli::refuse_option("--signal", name, fmt::format("must be one of {}", fmt::join(measured_signal_names(), ", ")));
}

WantedSignal wanted_signal(const std::string& text) {
  const auto equals = text.find('='), colon = text.find(':', equals == std::string::npos ? 0 : equals);
  const bool has_colon = colon != std::string::npos;
  const std::string place = equals == std::string::npos ? "" : text.substr(equals + 1, colon - equals - 1);
  const auto point = place.find('.');
  if (equals == 0 || point == std::string::npos || point == 0 || point + 1 == place.size() ||
      (has_colon && colon + 1 == text.size()))
    cli::refuse_option("--signal", text, "must be such as boom_angle=MESSAGE.SIGNAL, both as the DBC calls them");
  return {text.substr(0, equals), place.substr(0, point), place.substr(point + 1),
          has_colon ? text.substr(colon + 1) : ""};
}

std::vector<DbcFrame> frames_of(const DbcFile& dbc, const std::vector<WantedSignal>& wanted) {
  std::vector<DbcFrame> frames;
  for (const WantedSignal& one : wanted) {
    if (signal_info(one.signal).role != NodeRole::kPilot && !one.travel.empty())
      cli::refuse_option("--signal", one.signal, "is no pilot pressure: has no shut and full");
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
    if (frame == frames.end()) frame = frames.insert(frames.end(), DbcFrame{&message, by, {}});
    for (const DbcFrame& other : frames) {
      for (const DbcFrame::Signal& known : other.signals)
        if (known.name == one.signal) cli::refuse_option("--signal", one.signal, "is wanted twice");
    }
    frame->signals.push_back({one.signal, signal, travel_text(one)});
  }
  return frames;
}

std::string line_of(const DbcFile& dbc, const DbcFrame& frame, const DbcFrame::Signal& signal) {
  return fmt::format("{} = {}", signal.name,
                     field_text(dbc, *frame.message, *signal.source, signal_info(signal.name), signal.travel));
}

std::vector<DbcClosing> take_closings(const DbcFile& dbc, const std::vector<DbcFrame>& frames, WantedFrames& wanted,
                                      const std::function<bool(const DbcMessage&)>& is_there,
                                      std::vector<std::string>& to_do) {
  std::vector<DbcClosing> closings;
  const auto closing = [&](const DbcMessage& message) -> DbcClosing* {
    for (DbcClosing& one : closings)
      if (one.message == &message) return &one;
    return nullptr;
  };
  for (const DbcFrame& frame : frames) {
    if (closing(*frame.message) != nullptr) continue;
    closings.push_back({frame.message, {}});
    if (is_there(*frame.message)) continue;
    const auto own = counter_of(dbc, *frame.message, wanted, to_do);
    if (own && taken_as(frames, *frame.message, own->place.signal) == nullptr) wanted.counters.push_back(*own);
  }
  const auto take = [&](auto& all, const char* option) {
    std::erase_if(all, [&](const auto& one) {
      const DbcMessage& message = dbc.usable(one.place.message);
      if (closing(message) == nullptr) {
        if (!is_there(message)) return false;
        closings.push_back({&message, {}});
      }
      const DbcSignal& signal = signal_of(dbc, message, one.place.signal);
      const std::string text = message.name + "." + signal.name;
      if (const std::string* const other = taken_as(frames, message, signal.name))
        cli::refuse_option(option, text, "is named as " + *other + ", too");
      if (signal.condition || signal.is_multiplexer)
        cli::refuse_option(option, text,
                           signal.condition ? "is not in every frame of its message: a multiplexer says in which"
                                            : "is the multiplexer of its message");
      closing(message)->lines.push_back(closing_line(one, signal));
      return true;
    });
  };
  take(wanted.counters, "--counter");
  take(wanted.checksums, "--checksum");
  std::erase_if(closings, [](const DbcClosing& one) { return one.lines.empty(); });
  return closings;
}

}  // namespace knuckle::eds
