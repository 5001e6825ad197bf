// What a program waits for and tells whoever started it: the CAN interface of the machine's bus, at once or once there
// is one that is up; and systemd, that its loop runs, that it still does, and how things stand.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "core/descriptor.h"
#include "core/time.h"
#include "transport/socket_can.h"

namespace knuckle::programs {

/// Started otherwise, it does nothing. For one thread, which is not a loop's. It speaks the protocol of sd_notify(3)
/// itself: libsystemd's call waits for a manager that does not read, and who calls this also ends the program.
class ServiceWatch {
 public:
  /// Whether systemd listens, and how often it wants to hear, is in the environment.
  ServiceWatch();
  ServiceWatch(const ServiceWatch&) = delete;
  ServiceWatch& operator=(const ServiceWatch&) = delete;

  /// Before the loop: it is not ready yet, and need not be within this time from now.
  void wait(const std::string& status, Duration at_most) noexcept;
  /// The service is ready with the loop's first step. From then on the watchdog is fed only when the loop has stepped
  /// since: that this thread runs does not prove that the loop does. @param status one line, for `systemctl status`.
  void tell(Time now, std::uint64_t steps, const std::string& status);
  /// An orderly end has begun. Nothing is said after it: what the end does to the loop's mode is no news any more.
  void stopping() noexcept { stopping_ = send("STOPPING=1"); }

 private:
  /// @return whether it has arrived. Never waits.
  [[nodiscard]] bool send(const std::string& line) const noexcept;

  Descriptor socket_;      ///< None: nobody listens.
  Duration feed_every_{};  ///< 0: there is no watchdog.
  bool ready_ = false;
  bool stopping_ = false;
  std::uint64_t steps_fed_ = 0;
  Time fed_at_ = kNever;
  std::string status_;
};

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
[[nodiscard]] std::unique_ptr<SocketCanBus> open_when_up(const std::string& interface, std::span<const CanFilter> hear,
                                                         const std::function<void(const std::string&)>& note,
                                                         const std::function<bool()>& keep_on);

}  // namespace knuckle::programs
