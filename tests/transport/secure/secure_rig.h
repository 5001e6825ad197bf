// Ends of secure links over real sockets, each with a loop that says something and hears what there is.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <functional>
#include <memory>
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

struct SecureLinkThreads : ::testing::Test {
  End machine{SecureLink::listen("127.0.0.1:0", machine_identity(), desks())};
  [[nodiscard]] std::string address() const { return "127.0.0.1:" + std::to_string(machine.link->port()); }
  End desk(const Identity& identity = desk_identity(), const SecureLinkTiming& timing = {},
           SecureLinkAccess access = {}) const {
    return {SecureLink::connect(address(), identity, {peer(machine_identity())}, timing, std::move(access))};
  }
  bool talk(End& end, std::uint8_t value = 7) {
    machine.heard = end.heard = 0;
    return until([&] {
      end.step(value);
      machine.step(static_cast<std::uint8_t>(value + 1));
      return machine.heard == value && end.heard == value + 1;
    });
  }
};

}  // namespace knuckle::secure
