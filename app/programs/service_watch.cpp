#include "app/programs/service_watch.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "core/error.h"

namespace knuckle::programs {
namespace {

std::string_view variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

/// 0 where it is not a number.
std::int64_t number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : 0;
}

/// Connected to the socket of this name; "@NAME" is in the abstract name space. None: there is no such.
Descriptor connected(std::string_view name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (name.empty() || name.size() >= sizeof address.sun_path) return {};
  std::copy(name.begin(), name.end(), address.sun_path);
  if (name.front() == '@') address.sun_path[0] = '\0';
  Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  if (socket && ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), size) == 0) return socket;
  return {};
}

}  // namespace

ServiceWatch::ServiceWatch() : socket_(connected(variable("NOTIFY_SOCKET"))) {
  constexpr int kFeedsInTime = 4;  // before the watchdog ends the program
  const std::string_view whose = variable("WATCHDOG_PID");
  if (whose.empty() || number(whose) == ::getpid())
    feed_every_ =
        std::chrono::microseconds(std::max<std::int64_t>(0, number(variable("WATCHDOG_USEC"))) / kFeedsInTime);
}

bool ServiceWatch::send(const std::string& line) const noexcept {
  return socket_ && ::send(socket_.get(), line.data(), line.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(line.size());
}

void ServiceWatch::wait(const std::string& status, Duration at_most) noexcept {
  const auto most_us = std::chrono::duration_cast<std::chrono::microseconds>(at_most).count();
  (void)send("EXTEND_TIMEOUT_USEC=" + std::to_string(most_us) + "\nSTATUS=" + status);
}

void ServiceWatch::tell(Time now, std::uint64_t steps, const std::string& status) {
  if (!socket_ || stopping_ || steps == steps_fed_) return;
  if (!ready_) ready_ = send("READY=1");
  if (status != status_ && send("STATUS=" + status)) status_ = status;
  if (feed_every_ == Duration{} || (fed_at_ != kNever && now - fed_at_ < feed_every_)) return;
  if (!send("WATCHDOG=1")) return;
  fed_at_ = now;
  steps_fed_ = steps;
}

bool wait_until_there(const Waiting& waiting) {
  for (Duration waited{};; waited += Waiting::kLookAgain) {
    const std::string why = waiting.why_not_yet();
    if (why.empty()) return true;
    if (!waiting.keep_on()) return false;
    if (waited % Waiting::kSayAgain == Duration::zero()) waiting.say(why, waited == Duration::zero());
    waiting.sleep(Waiting::kLookAgain);
  }
}

std::unique_ptr<SocketCanBus> open_when_up(const std::string& interface, std::span<const CanFilter> hear,
                                           const std::function<void(const std::string&)>& note,
                                           const std::function<bool()>& keep_on) {
  ServiceWatch service;
  bool waited = false;
  const Waiting waiting{[&interface] { return why_not_yet(interface); },
                        [&](const std::string& why, bool first) {
                          waited = true;
                          const std::string line =
                              (first ? "waiting for CAN interface " : "still waiting for CAN interface ") + interface +
                              ": " + why;
                          note(line);
                          service.wait(line, 3 * Waiting::kSayAgain);
                        },
                        keep_on, [](Duration time) { std::this_thread::sleep_for(time); }};
  while (wait_until_there(waiting)) {
    try {
      auto bus = std::make_unique<SocketCanBus>(interface, hear);
      if (waited) note("CAN interface " + interface + " is up");
      return bus;
    } catch (const InputError&) {
      if (why_not_yet(interface).empty()) throw;  // it is up, and cannot be used all the same
    }
  }
  return nullptr;
}

}  // namespace knuckle::programs
