// Passes lines between the members of a room, by the rules of transport/ice/rendezvous_line.h. One thread, nothing on
// disk, every number bounded: whoever floods, stalls or talks nonsense loses their own connection and nobody else's.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "app/cli/command.h"
#include "core/descriptor.h"
#include "transport/ice/rendezvous_line.h"
#include "transport/socket_address.h"

namespace knuckle::rendezvous {

struct Bounds {
  std::size_t clients = 900;            ///< Or fewer, where the limit of open files is lower.
  std::size_t clients_of_network = 64;  ///< See network_of().
  std::size_t rooms_of_client = ice::kMostRooms;
  std::size_t members = 8;                 ///< Of a room: one more takes the place of whoever has been silent longest.
  double lines_per_s = 20;                 ///< Of a client, on average; ...
  double burst = 60;                       ///< ... this many at once.
  std::size_t unread_bytes = 1 << 16;      ///< What a client may leave unread.
  std::chrono::milliseconds idle{30'000};  ///< Without a line, a client is gone; ...
  std::chrono::milliseconds first{5'000};  ///< ... before its first room after so long.
};

struct Counters {
  std::uint64_t accepted = 0, turned_away = 0;                               ///< Connections; those beyond the bounds.
  std::uint64_t passed = 0;                                                  ///< Messages, a copy each.
  std::uint64_t junk = 0, floods = 0, stalled = 0, idle = 0, displaced = 0;  ///< Connections that were ended for it.
};

/// Who counts as one: an IPv4 address, also one that came as IPv6; of IPv6 the /64, all of which one computer may have.
[[nodiscard]] std::string network_of(const SocketAddress& address);

class RendezvousServer {
 public:
  using Clock = std::chrono::steady_clock;

  /// @param address "ADDR:PORT" in numbers. @throws InputError where it is malformed or cannot be bound.
  explicit RendezvousServer(const std::string& address, const Bounds& bounds = {});
  RendezvousServer(const RendezvousServer&) = delete;
  RendezvousServer& operator=(const RendezvousServer&) = delete;

  /// Waits for something to do, at most so long, and does it. @param now before it waits.
  void step(std::chrono::milliseconds longest, Clock::time_point now = Clock::now());
  [[nodiscard]] SocketAddress address() const noexcept { return local_address(listening_.get()); }
  [[nodiscard]] std::size_t clients() const noexcept { return clients_.size(); }
  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }

 private:
  struct Client {
    Descriptor socket;
    std::string network;
    ice::LineBuffer in;
    std::string out;
    std::vector<std::string> rooms;
    double lines = 0;  ///< That it may still send now.
    Clock::time_point heard_at, refilled_at;
    bool ending = false;
  };
  void accept_all(Clock::time_point now);
  void read(Client& client, Clock::time_point now);
  [[nodiscard]] bool may_talk(Client& client, Clock::time_point now) const;
  void obey(Client& client, std::string_view line);
  void join(Client& client, const std::string& room);
  void say(Client& client, std::string_view line);
  void write(Client& client);
  void refuse(Client& client, std::uint64_t& counter, std::string_view why);
  void watch(const Client& client, int operation) const;
  void end_idle(Clock::time_point now);
  void bury();

  Bounds bounds_;
  Descriptor listening_, events_;
  std::map<int, std::unique_ptr<Client>> clients_;     // by socket
  std::map<std::string, std::vector<Client*>> rooms_;  // their members
  Clock::time_point looked_at_{};
  Counters counters_;
};

[[nodiscard]] cli::Command rendezvous_entry();

}  // namespace knuckle::rendezvous
