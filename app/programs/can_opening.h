// Opens the CAN interface of the machine's bus: at once, or once there is one that is up.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "core/time.h"
#include "transport/socket_can.h"

namespace knuckle::programs {

/// How something is waited for.
struct Waiting {
  static constexpr Duration kLookAgain = 500ms, kSayAgain = 10s;
  std::function<std::string()> why_not_yet;  ///< Empty: it is there.
  std::function<void(const std::string& why, bool first)> say;
  std::function<bool()> keep_on;  ///< False: nobody waits any more.
  std::function<void(Duration)> sleep;
};
/// Says what is missing at once, then every 10 s. @return false where keep_on ended it.
[[nodiscard]] bool wait_until_there(const Waiting& waiting);

/// Waits for an interface that is not there yet or down, and tells console and service manager what it waits for.
/// @return nullptr where keep_on ended the waiting. @throws InputError where waiting is in vain (no CAN interface, no
/// permission).
[[nodiscard]] std::unique_ptr<SocketCanBus> open_when_up(const std::string& interface,
                                                         std::span<const std::uint32_t> hear,
                                                         const std::function<void(const std::string&)>& note,
                                                         const std::function<bool()>& keep_on);

}  // namespace knuckle::programs
