// What a program that systemd started as a service tells it: that its loop runs, that it still does, and how things
// stand.
#pragma once

#include <cstdint>
#include <string>

#include "core/descriptor.h"
#include "core/time.h"

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

}  // namespace knuckle::programs
