// Addresses of a server that is given by name, looked up beside everything else in the thread of a GLib loop. libnice
// 0.1.21 looks names up as well, but then sends to port 0 of a TURN server.
#pragma once

#include <chrono>
#include <memory>
#include <vector>

#include "transport/socket_address.h"

namespace knuckle::ice {

class ServerName {
 public:
  using Clock = std::chrono::steady_clock;

  explicit ServerName(HostAndPort server);
  ~ServerName();
  ServerName(const ServerName&) = delete;
  ServerName& operator=(const ServerName&) = delete;

  /// Often: looks it up where that has not succeeded yet. The thread's own context has to be the loop's.
  void tend(Clock::time_point now);
  /// The network may have changed: looks it up again. What is known stays until there is an answer.
  void doubt() noexcept { known_ = false; }
  /// Has been looked up once, whatever came of it.
  [[nodiscard]] bool tried() const noexcept { return tried_; }
  /// As known last, best first.
  [[nodiscard]] const std::vector<SocketAddress>& addresses() const noexcept { return addresses_; }
  [[nodiscard]] const HostAndPort& server() const noexcept { return server_; }

 private:
  struct LookUp;
  const HostAndPort server_;
  std::vector<SocketAddress> addresses_;
  std::shared_ptr<LookUp> under_way_;
  Clock::time_point again_at_{};
  bool known_ = false, tried_ = false;
};

}  // namespace knuckle::ice
