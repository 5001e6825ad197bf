// --can of commands that work on a machine's buses: INTERFACE, or where the machine has two NAME=INTERFACE for each.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "machine/bus_description.h"
#include "transport/bus_access.h"
#include "transport/can_buses.h"
#include "transport/socket_can.h"

namespace knuckle::bringup {

/// In the order of the machine file. @throws InputError in one line where a bus is missing, unknown or given twice.
[[nodiscard]] std::vector<std::string> can_interfaces(const std::vector<std::string>& given, const BusDescription& bus);

/// What was given, for people: "valves=can0 and machine=can1".
[[nodiscard]] std::string can_text(const std::vector<std::string>& given);
/// As on a command line: " --can valves=can0 --can machine=can1".
[[nodiscard]] std::string can_arguments(const std::vector<std::string>& given);

/// Likewise in the order of the machine file, whatever order they were given in. @throws InputError as can_interfaces()
[[nodiscard]] std::string can_text(const std::vector<std::string>& given, const BusDescription& bus);

/// One interface, or two, as the loop's one bus.
class OpenInterfaces {
 public:
  /// @param each in the order of the machine file; one or two.
  explicit OpenInterfaces(std::vector<std::unique_ptr<SocketCanBus>> each)
      : each_(std::move(each)), both_(*each_.front(), each_.size() > 1 ? each_[1].get() : nullptr) {}
  [[nodiscard]] CanBus& bus() noexcept { return each_.size() > 1 ? static_cast<CanBus&>(both_) : *each_.front(); }
  [[nodiscard]] const std::vector<std::unique_ptr<SocketCanBus>>& each() const noexcept { return each_; }
  /// What is wrong with them, a line each.
  [[nodiscard]] std::vector<std::string> diagnoses() const;

 private:
  std::vector<std::unique_ptr<SocketCanBus>> each_;
  CanBuses both_;
};

/// @throws InputError as can_interfaces(), or where one cannot be opened.
[[nodiscard]] std::shared_ptr<OpenInterfaces> open_interfaces(const std::vector<std::string>& given,
                                                              const BusDescription& bus);
/// All of the machine's buses as one, in real time. @throws InputError as open_interfaces()
[[nodiscard]] BusAccess machine_access(const std::vector<std::string>& given, const BusDescription& bus);

}  // namespace knuckle::bringup
