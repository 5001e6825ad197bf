// One attempt of ICE by libnice: gathers candidates, checks pairs with the far end's, carries datagrams over the best.
// Lives in the thread of a GLib loop; never blocks.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "transport/ice/glib_source.h"
#include "transport/ice/signal.h"
#include "transport/socket_address.h"

using NiceAgent = struct _NiceAgent;

namespace knuckle::ice {

/// Servers that help; none has to be there.
struct Servers {
  std::optional<HostAndPort> stun;  ///< Tells which address a NAT gives.
  std::optional<HostAndPort> turn;  ///< Relays what finds no other way.
  std::string turn_user, turn_password;
};

/// Of the pair of addresses in use.
enum class PathKind : std::uint8_t {
  kHost,       ///< Both ends by addresses of their own.
  kReflexive,  ///< Through a NAT at one end or both.
  kRelayed,    ///< Through a TURN server.
};
[[nodiscard]] const char* name(PathKind kind) noexcept;  ///< "host", "srflx", "relay"

struct PathPair {
  PathKind kind = PathKind::kHost;
  SocketAddress local, remote;
  friend bool operator==(const PathPair&, const PathPair&) noexcept = default;
};

struct AgentSetup {
  bool controlling = false;
  std::optional<SocketAddress> stun;  ///< See Servers.
  std::vector<SocketAddress> turn;    ///< Of one server.
  std::string turn_user, turn_password;
  bool loopback = false;  ///< Of this computer's addresses only its loopback ones; otherwise all but these.
};

class Agent {
 public:
  /// @param changed something of what follows is other than before. @param received a datagram has come through.
  /// Neither may end this object.
  Agent(GMainContext* context, const AgentSetup& setup, std::function<void()> changed,
        std::function<void(std::span<const std::uint8_t>)> received);
  /// Closes: what a TURN server has allocated is released while the loop goes on.
  ~Agent();
  Agent(const Agent&) = delete;
  Agent& operator=(const Agent&) = delete;

  [[nodiscard]] const std::string& user() const noexcept { return user_; }
  [[nodiscard]] const std::string& password() const noexcept { return password_; }
  /// Found so far.
  [[nodiscard]] std::vector<Candidate> candidates() const;
  [[nodiscard]] bool gathered() const noexcept { return gathered_; }
  /// Of the far end; again where more have become known.
  void set_far_end(const Signal& signal);
  [[nodiscard]] bool failed() const noexcept { return failed_; }
  /// In use; nullopt before there is one.
  [[nodiscard]] std::optional<PathPair> pair() const;
  bool send(std::span<const std::uint8_t> datagram);

 private:
  struct Signals;
  NiceAgent* agent_;
  GMainContext* context_;
  unsigned stream_ = 0;
  std::function<void()> changed_;
  std::function<void(std::span<const std::uint8_t>)> received_;
  std::string user_, password_;
  std::vector<Candidate> far_;
  bool gathered_ = false, failed_ = false;
};

/// Agents that are closing still have something to say to a TURN server.
[[nodiscard]] int closing_agents() noexcept;

}  // namespace knuckle::ice
