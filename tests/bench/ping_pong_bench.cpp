// What the loopback interface itself takes: a datagram of the operator's size there, one of the machine's size back,
// between two threads that wait for them as fast as they can. What the loops add is their steps: BM_SlaveStep and
// master_step here, execution_us of `knuckle simulate --realtime` with their sockets.
#include <benchmark/benchmark.h>

#include <atomic>
#include <string>
#include <thread>

#include "transport/link_messages.h"
#include "transport/udp_link.h"

namespace knuckle {
namespace {

void BM_PingPongOfLinkMessages(benchmark::State& state) {
  UdpLink machine = UdpLink::listen("127.0.0.1:0");
  UdpLink console = UdpLink::connect("127.0.0.1:" + std::to_string(machine.port()));
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
  for (auto _ : state) {
    console.send(there.view());
    while (!console.receive(answer)) {
    }
  }
  done = true;
  echo.join();
}
BENCHMARK(BM_PingPongOfLinkMessages)->UseRealTime();

}  // namespace
}  // namespace knuckle
