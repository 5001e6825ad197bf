// Ends of secure links over real sockets, each with a loop that says something and hears what there is.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "transport/secure/secure_link.h"

namespace knuckle::secure {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

inline const Identity& machine_identity() {
  static const Identity identity = make_identity("site arm");
  return identity;
}
inline const Identity& desk_identity() {
  static const Identity identity = make_identity("desk 1");
  return identity;
}
inline const Identity& other_identity() {
  static const Identity identity = make_identity("desk 2");
  return identity;
}
inline Peer peer(const Identity& identity, bool revoked = false) {
  return {identity.fingerprint(), identity.name, revoked, false, ""};
}
inline Peers desks() {
  return {peer(desk_identity()), peer(other_identity())};
}

/// A minute at least, where it does not come; each end's loop runs meanwhile.
inline bool until(const std::function<bool()>& done) {
  for (int i = 0; i < 12'000; ++i) {
    if (done()) return true;
    ::poll(nullptr, 0, 5);
  }
  return false;
}

/// The datagrams of a handshake.
struct Outbox final : DtlsSession::Out {
  std::vector<Bytes> datagrams;
  void put(std::span<const std::uint8_t> bytes) override { datagrams.emplace_back(bytes.begin(), bytes.end()); }
};

struct End {
  std::unique_ptr<SecureLink> link{};
  std::vector<LinkEvent> events{};
  Datagram datagram{};
  std::uint8_t heard = 0;  // the newest message's first byte
  int messages = 0;

  /// As a loop would: says `value`, hears what there is.
  void step(std::uint8_t value) {
    const Bytes bytes{value, 1, 2, 3};
    (void)link->send(bytes);
    while (link->receive(datagram)) {
      heard = datagram.bytes[0];
      ++messages;
    }
    LinkEvent event;
    while (link->next(event)) events.push_back(event);
  }
  [[nodiscard]] int count(LinkEvent::Kind kind) const {
    return static_cast<int>(
        std::count_if(events.begin(), events.end(), [kind](const LinkEvent& event) { return event.kind == kind; }));
  }
};

/// A machine whose owner may change its mind about peers.
struct SecureLinkThreads : ::testing::Test {
  static UdpSocket bound_socket() {
    return UdpSocket(open_udp_socket("", parse_address("127.0.0.1:0"), ::bind, "listen on"));
  }
  std::mutex mutex;
  std::optional<Peers> newer;
  End machine{listening()};

  [[nodiscard]] std::unique_ptr<SecureLink> listening(SecureLinkAccess access = {}) {
    access.newer_peers = [this] {
      const std::lock_guard lock(mutex);
      return std::exchange(newer, std::nullopt);
    };
    return SecureLink::listen("127.0.0.1:0", machine_identity(), desks(), {}, std::move(access));
  }
  void change_peers(Peers peers) {
    const std::lock_guard lock(mutex);
    newer = std::move(peers);
  }
  /// Until the link knows of it.
  void change_peers_now(Peers peers) {
    change_peers(std::move(peers));
    EXPECT_TRUE(until([this] {
      machine.step(9);
      const std::lock_guard lock(mutex);
      return !newer.has_value();
    }));
  }
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(machine.link->port()); }
  End desk(const Identity& identity = desk_identity(), const SecureLinkTiming& timing = {},
           SecureLinkAccess access = {}) const {
    return {SecureLink::connect(address(), identity, {peer(machine_identity())}, timing, std::move(access))};
  }
  /// One that only looks on.
  End screen(const Identity& identity, const SecureLinkTiming& timing = {}) const {
    return desk(identity, timing, {.purpose = Purpose::kObserve});
  }
  /// Both loops run until it is so; the machine's says 9.
  bool talk_until(End& end, std::uint8_t value, const std::function<bool()>& so) {
    return until([&] {
      end.step(value);
      machine.step(9);
      return so();
    });
  }
  bool talk(End& end, std::uint8_t value = 7) {
    machine.heard = end.heard = 0;
    return talk_until(end, value, [&] { return machine.heard == value && end.heard == 9; });
  }
  /// For so many steps of 5 ms.
  void run(int steps, const std::function<void()>& each) {
    for (int i = 0; i < steps; ++i) {
      each();
      machine.step(9);
      ::poll(nullptr, 0, 5);
    }
  }
};

}  // namespace knuckle::secure
