#include "app/eds/dbc_wanted.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "app/cli/command.h"
#include "app/eds/dbc_text.h"
#include "core/joints.h"
#include "machine/load_broadcasts.h"
#include "machine/load_frames.h"

namespace knuckle::eds {
namespace {

/// What stands in front of the first such mark and, where there is one, behind it.
struct Parts {
  std::string first;
  std::optional<std::string> second;
};
Parts parts_of(const std::string& text, char mark) {
  const auto at = text.find(mark);
  if (at == std::string::npos) return {text, std::nullopt};
  return {text.substr(0, at), text.substr(at + 1)};
}

template <typename Number = double>
std::optional<Number> number_of(const std::optional<std::string>& text) {
  return text ? number_in<Number>(*text) : std::nullopt;
}

/// MESSAGE.SIGNAL, or MESSAGE alone.
PlaceInDbc place_in(const std::string& text) {
  const auto [message, signal] = parts_of(text, '.');
  return {message, signal.value_or("")};
}
bool is_signal(const PlaceInDbc& place) {
  return !place.message.empty() && !place.signal.empty();
}

/// "extend=0.4,retract=-0.4". @return whether there are such numbers, each once, and nothing else.
bool read_numbers(const std::string& text, const std::map<std::string, std::optional<double>*>& numbers) {
  const auto [first, rest] = parts_of(text, ',');
  const auto [name, value] = parts_of(first, '=');
  const auto to = numbers.find(name);
  const auto number = number_of(value);
  if (!number || to == numbers.end() || *to->second) return false;
  *to->second = number;
  return !rest || read_numbers(*rest, numbers);
}

WantedSignal signal_in(const std::string& text) {
  const auto [name, rest] = parts_of(text, '=');
  const auto [place, travel] = parts_of(rest.value_or(""), ':');
  WantedSignal wanted{.place = place_in(place)};
  if (name.empty() || !is_signal(wanted.place) || travel == "")
    cli::refuse_option("--signal", text, "must be such as boom_angle=MESSAGE.SIGNAL, both as the DBC calls them");
  const auto measured = measured_signal(name);
  if (!measured)
    cli::refuse_option("--signal", name, fmt::format("must be one of {}", fmt::join(measured_signal_names(), ", ")));
  wanted.info = &kSignals[*measured];
  if (!travel) return wanted;
  if (wanted.info->role != NodeRole::kPilot)
    cli::refuse_option("--signal", name, "is no pilot pressure: has no shut and full");
  if (!read_numbers(*travel, {{"shut", &wanted.shut}, {"full", &wanted.full}}) || !wanted.shut || !wanted.full)
    cli::refuse_option("--signal", *travel, "must be such as shut=0.6,full=2.8, in the DBC's unit");
  return wanted;
}

WantedCommand command_in(const std::string& text) {
  const auto [joint, rest] = parts_of(text, '=');
  const auto [place, values] = parts_of(rest.value_or(""), ':');
  WantedCommand wanted{place_in(place), joint};
  if (!is_signal(wanted.place) ||
      !read_numbers(values.value_or(""), {{"extend", &wanted.extend}, {"retract", &wanted.retract}}))
    cli::refuse_option("--command", text, "must be such as boom=MESSAGE.SIGNAL:extend=0.4,retract=-0.4");
  if (std::find(kJointNames.begin(), kJointNames.end(), joint) == kJointNames.end())
    cli::refuse_option("--command", text, fmt::format("must begin with one of {}", fmt::join(kJointNames, ", ")));
  return wanted;
}

WantedConstant constant_in(const std::string& text) {
  const auto [place, values] = parts_of(text, '=');
  const auto [first, second] = parts_of(values.value_or(""), ',');
  const auto neutral = number_in<double>(first), led = number_of(second);
  const WantedConstant wanted{place_in(place), neutral.value_or(0), led};
  if (wanted.place.message.empty() || !neutral || (second && (!led || wanted.place.signal.empty())))
    cli::refuse_option("--constant", text, "must be such as MESSAGE.SIGNAL=0, MESSAGE.SIGNAL=0,2 or MESSAGE=0");
  return wanted;
}

WantedClosing counter_in(const std::string& text) {
  const auto [place, modulus] = parts_of(text, '=');
  const WantedClosing wanted{.place = place_in(place), .modulus = number_of<std::uint64_t>(modulus)};
  if (!is_signal(wanted.place) || (modulus && !wanted.modulus))
    cli::refuse_option("--counter", text,
                       "must be such as MESSAGE.SIGNAL, or MESSAGE.SIGNAL=15 where it counts from 0 to 14");
  return wanted;
}

WantedClosing checksum_in(const std::string& text) {
  const auto [place, kind] = parts_of(text, '=');
  const WantedClosing wanted{.place = place_in(place), .kind = kind.value_or("")};
  if (!is_signal(wanted.place) ||
      std::find(kChecksumNames.begin(), kChecksumNames.end(), wanted.kind) == kChecksumNames.end())
    cli::refuse_option(
        "--checksum", text,
        fmt::format("must be such as MESSAGE.SIGNAL=crc8-j1850, or with one of {}", fmt::join(kChecksumNames, ", ")));
  return wanted;
}

WantedPeriod period_in(const std::string& text) {
  constexpr double kMost_ms = 10000;  // of several packets; most frames have less
  const auto [message, value] = parts_of(text, '=');
  const double period_ms = number_of(value).value_or(0);
  if (message.empty() || !(period_ms >= 1 && period_ms <= kMost_ms))
    cli::refuse_option("--period", text, fmt::format("must be such as MESSAGE=20, in ms within [1, {}]", kMost_ms));
  return {message, period_ms};
}

WantedBus bus_in(const std::string& text) {
  const auto [name, value] = parts_of(text, '=');
  const auto kbps = value ? cli::whole_number(*value, 1000) : std::nullopt;
  if (name.empty() || (value && !kbps)) cli::refuse_option("--bus", text, "must be such as machine, or machine=250");
  return {name, kbps ? std::optional(static_cast<int>(*kbps)) : std::nullopt};
}

void refuse_twice(const Wanted& wanted) {
  std::set<std::string> said;
  const auto say = [&](const std::string& what, const std::string& option, const char* why = "is said twice") {
    if (!said.insert(what).second) cli::refuse_option(option, what, why);
  };
  for (const WantedCommand& one : wanted.commands) say(one.place.text(), "--command");
  for (const WantedConstant& one : wanted.constants) say(one.place.text(), "--constant");
  for (const WantedClosing& one : wanted.closings) {
    say(one.place.text(), "--" + one.key());
    say(one.place.message + " (" + one.key() + ")", "--" + one.key());
  }
  std::map<std::string, std::string> moved_by;  // joint, message
  for (const WantedCommand& one : wanted.commands) {
    const std::string& message = moved_by.emplace(one.joint, one.place.message).first->second;
    if (message != one.place.message)
      cli::refuse_option(
          "--command", one.joint,
          fmt::format("is in {} and in {}: one message alone must move a joint", message, one.place.message));
  }
  said.clear();  // what follows may have the same names
  for (const WantedPeriod& one : wanted.periods) say(one.message, "--period");
  said.clear();
  for (const WantedSignal& one : wanted.signals) say(one.info->name, "--signal", "is wanted twice");
}

}  // namespace

Wanted wanted_of(const ImportOptions& options) {
  Wanted wanted;
  for (const std::string& one : options.signals) wanted.signals.push_back(signal_in(one));
  for (const std::string& one : options.commands) wanted.commands.push_back(command_in(one));
  for (const std::string& one : options.constants) wanted.constants.push_back(constant_in(one));
  for (const std::string& one : options.counters) wanted.closings.push_back(counter_in(one));
  for (const std::string& one : options.checksums) wanted.closings.push_back(checksum_in(one));
  for (const std::string& one : options.periods) wanted.periods.push_back(period_in(one));
  if (!options.bus.empty()) wanted.bus = bus_in(options.bus);
  if (wanted.signals.empty() && wanted.commands.empty() && wanted.constants.empty() && wanted.closings.empty())
    cli::refuse_option("--signal", "",
                       "is required by bus import, or --command, --constant, --counter or --checksum is");
  refuse_twice(wanted);
  return wanted;
}

}  // namespace knuckle::eds
