// Both ends of a path in one process: an echo at the machine's end, and the desk that asks for it.
#pragma once

#include <poll.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "transport/ice/dialler.h"
#include "transport/udp_socket.h"

namespace knuckle::test {

/// At a port of this computer that was free.
inline UdpSocket bound_socket() {
  return UdpSocket(open_udp_socket("test", parse_address("127.0.0.1:0"), ::bind, "listen on"));
}

class TwoEnds {
 public:
  static constexpr int kTries = 600;  // of 100 ms: reached only where nothing comes at all

  void begin_machine(const std::string& rendezvous, const ice::Servers& servers = {}) {
    machine.reset();
    machine.emplace(ice::DialSetup{rendezvous, servers, secure::Role::kMachine}, machine_identity,
                    secure::Peers{{desk_identity.fingerprint(), "desk", false}});
    machine->start(local_address(machine_link_.descriptor()));
  }
  void begin_desk(const std::string& rendezvous, const ice::Servers& servers = {}) {
    desk.reset();
    desk.emplace(ice::DialSetup{rendezvous, servers, secure::Role::kOperator}, desk_identity,
                 secure::Peers{{machine_identity.fingerprint(), "machine", false}});
    desk_link_ = UdpSocket(open_udp_socket("test", parse_address(desk->address()), ::connect, "reach"));
    desk->start(local_address(desk_link_.descriptor()));
  }
  void begin(const std::string& rendezvous, const ice::Servers& servers = {}) {
    begin_machine(rendezvous, servers);
    begin_desk(rendezvous, servers);
  }
  /// From desk to machine and back, tried again and again.
  [[nodiscard]] bool carries(int tries = kTries) {
    for (int i = 0; i < tries; ++i) {
      const std::uint8_t mark = ++mark_;
      const std::array<std::uint8_t, 3> sent{0xFF, mark, 7};
      (void)desk_link_.send(sent, {});
      for (int turn = 0; turn < 10; ++turn) {
        echo();
        pollfd waiting{desk_link_.descriptor(), POLLIN, 0};
        (void)::poll(&waiting, 1, 10);
        std::array<std::uint8_t, 64> bytes{};
        SocketAddress from;
        const auto arrival = desk_link_.receive(bytes, from);
        if (arrival && arrival->size == sent.size() && std::equal(sent.begin(), sent.end(), bytes.begin())) return true;
      }
    }
    return false;
  }

  const secure::Identity desk_identity = secure::make_identity("desk"),
                         machine_identity = secure::make_identity("machine");
  std::optional<ice::Dialler> machine, desk;

 private:
  void echo() {
    std::array<std::uint8_t, 64> bytes{};
    SocketAddress from;
    while (const auto arrival = machine_link_.receive(bytes, from))
      (void)machine_link_.send(std::span(bytes).first(arrival->size), from);
  }
  UdpSocket machine_link_ = bound_socket(), desk_link_;
  std::uint8_t mark_ = 0;
};

}  // namespace knuckle::test
