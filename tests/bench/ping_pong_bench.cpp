// What the loopback interface itself takes: a datagram of the operator's size there, one of the machine's size back,
// between two threads that wait for them as fast as they can; bare, and sealed and opened by the secure link. What the
// loops add is their steps: BM_SlaveStep and master_step here, execution_us of `knuckle simulate --realtime` with their
// sockets.
#include <benchmark/benchmark.h>

#include <atomic>
#include <string>
#include <thread>

#include "transport/link_messages.h"
#include "transport/secure/secure_link.h"
#include "transport/udp_link.h"

namespace knuckle {
namespace {

void ping_pong(benchmark::State& state, Link& machine, Link& console) {
  const auto there = encode(MasterMessage{});
  const auto back = encode(SlaveMessage{});
  std::atomic<bool> done{false};
  std::thread echo([&] {
    Datagram heard;
    while (!done.load(std::memory_order_relaxed)) {
      if (machine.receive(heard)) machine.send(back.view());
    }
  });
  Datagram answer;
  while (!console.receive(answer)) console.send(there.view());  // until a secure one is there
  for (auto _ : state) {
    console.send(there.view());
    while (!console.receive(answer)) {
    }
  }
  done = true;
  echo.join();
}

void BM_PingPongOfLinkMessages(benchmark::State& state) {
  UdpLink machine = UdpLink::listen("127.0.0.1:0");
  UdpLink console = UdpLink::connect("127.0.0.1:" + std::to_string(machine.port()));
  ping_pong(state, machine, console);
}
BENCHMARK(BM_PingPongOfLinkMessages)->UseRealTime();

secure::Peers only(const secure::Identity& identity) {
  secure::Peer peer;
  peer.fingerprint = identity.fingerprint();
  peer.name = identity.name;
  return {peer};
}

void BM_PingPongOverTheSecureLink(benchmark::State& state) {
  const secure::Identity arm = secure::make_identity("arm"), desk = secure::make_identity("desk");
  const auto machine = secure::SecureLink::listen("127.0.0.1:0", arm, only(desk));
  const auto console = secure::SecureLink::connect("127.0.0.1:" + std::to_string(machine->port()), desk, only(arm));
  ping_pong(state, *machine, *console);
}
BENCHMARK(BM_PingPongOverTheSecureLink)->UseRealTime();

}  // namespace
}  // namespace knuckle
