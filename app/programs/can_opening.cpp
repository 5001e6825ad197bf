#include "app/programs/can_opening.h"

#include <thread>

#include "app/programs/service_watch.h"
#include "core/error.h"

namespace knuckle::programs {

bool wait_until_there(const Waiting& waiting) {
  for (Duration waited{};; waited += Waiting::kLookAgain) {
    const std::string why = waiting.why_not_yet();
    if (why.empty()) return true;
    if (!waiting.keep_on()) return false;
    if (waited % Waiting::kSayAgain == Duration::zero()) waiting.say(why, waited == Duration::zero());
    waiting.sleep(Waiting::kLookAgain);
  }
}

std::unique_ptr<SocketCanBus> open_when_up(const std::string& interface, std::span<const std::uint32_t> hear,
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
