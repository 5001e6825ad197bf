#include "transport/bus_access.h"

#include "core/realtime_thread.h"
#include "transport/socket_can.h"

namespace knuckle {

BusAccess real_access(const std::string& interface) {
  const RealtimeClock clock;
  return {interface, std::make_shared<SocketCanBus>(interface), [clock](Time due) {
            clock.sleep_until(due);
            return clock.now();
          }};
}

}  // namespace knuckle
