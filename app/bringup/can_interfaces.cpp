#include "app/bringup/can_interfaces.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/cli/command.h"
#include "core/realtime_thread.h"

namespace knuckle::bringup {

std::vector<std::string> can_interfaces(const std::vector<std::string>& given, const BusDescription& bus) {
  std::vector<std::string> interfaces(bus.lines());
  for (const std::string& one : given) {
    const auto equals = one.find('=');
    const std::string name = one.substr(0, equals);
    const bool named = equals != std::string::npos;
    if (!named && bus.second)
      cli::refuse_option("--can", one, "the machine has two buses: must be NAME=INTERFACE with " + bus.line_names());
    const auto on = named ? bus.line_named(name) : 0;
    if (!on)
      cli::refuse_option("--can", one,
                         "no bus \"" + name + "\"; " +
                             (bus.name.empty() ? "the machine has one, without a name"
                                               : (bus.second ? "there are " : "there is ") + bus.line_names()));
    const std::string interface = named ? one.substr(equals + 1) : one;
    if (!interfaces[*on].empty()) cli::refuse_option("--can", one, "this bus was given before");
    if (!interface.empty() && interface == interfaces[bus.lines() - 1 - *on])
      cli::refuse_option("--can", one, "is the interface of the other bus");
    interfaces[*on] = interface;
  }
  for (std::size_t on = 0; on < interfaces.size(); ++on)
    if (interfaces[on].empty())
      cli::refuse_option("--can", "", "needs " + (bus.second ? bus.line(on).name + "=" : "") + "INTERFACE, too");
  return interfaces;
}

std::string can_text(const std::vector<std::string>& given) {
  return fmt::format("{}", fmt::join(given, " and "));
}

std::string can_arguments(const std::vector<std::string>& given) {
  std::string text;
  for (const std::string& interface : given) text += " --can " + interface;
  return text;
}

std::string can_text(const std::vector<std::string>& given, const BusDescription& bus) {
  std::vector<std::string> ordered = can_interfaces(given, bus);
  for (std::size_t on = 0; bus.second && on < ordered.size(); ++on) ordered[on] = bus.line(on).name + "=" + ordered[on];
  return can_text(ordered);
}

std::vector<std::string> OpenInterfaces::diagnoses() const {
  std::vector<std::string> lines;
  for (const auto& bus : each_)
    if (std::string wrong = bus->diagnosis(); !wrong.empty()) lines.push_back(std::move(wrong));
  return lines;
}

std::shared_ptr<OpenInterfaces> open_interfaces(const std::vector<std::string>& given, const BusDescription& bus) {
  std::vector<std::unique_ptr<SocketCanBus>> opened;
  for (const std::string& name : can_interfaces(given, bus)) opened.push_back(std::make_unique<SocketCanBus>(name));
  return std::make_shared<OpenInterfaces>(std::move(opened));
}

BusAccess machine_access(const std::vector<std::string>& given, const BusDescription& bus) {
  const auto interfaces = open_interfaces(given, bus);
  const RealtimeClock clock;
  return {can_text(given, bus), {interfaces, &interfaces->bus()}, [clock](Time due) {
            clock.sleep_until(due);
            return clock.now();
          }};
}

}  // namespace knuckle::bringup
