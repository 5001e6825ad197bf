// Cost of hearing the machine's bus, over socket pairs that carry struct can_frame: one step of the 200 Hz loop with so
// many frames waiting. Times are the thread's own on a processor, the kernel's part of its calls included, so a busy
// computer changes little; core_share is what of one core that is. Beside it a loop that reads frame by frame.
#include <benchmark/benchmark.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <vector>

#include "machine/load.h"
#include "slave/bus_map.h"
#include "slave/canopen_client.h"
#include "slave/sensors.h"
#include "transport/can_buses.h"
#include "transport/socket_can.h"
#include "transport/virtual_can.h"

namespace knuckle {
namespace {

/// The kernel's ends of a bus' sockets.
class Feeder {
 public:
  Feeder() {
    for (auto& pair : pairs_) socketpair(AF_UNIX, SOCK_DGRAM, 0, pair.data());
  }
  Feeder(const Feeder&) = delete;
  Feeder& operator=(const Feeder&) = delete;
  ~Feeder() {
    for (const auto& pair : pairs_) close(pair[1]);
  }
  [[nodiscard]] SocketCanBus::Sockets sockets() const { return {pairs_[0][0], pairs_[1][0], pairs_[2][0]}; }
  void feed(const can_frame& frame) { refused_ += send(pairs_[0][1], &frame, sizeof frame, MSG_DONTWAIT) < 0; }
  [[nodiscard]] int refused() const { return refused_; }

 private:
  std::array<std::array<int, 2>, 3> pairs_{};
  int refused_ = 0;
};

/// What the nodes of the machine file send, in the mix of their rates.
std::vector<can_frame> traffic(const BusDescription& bus, std::size_t count) {
  std::vector<can_frame> frames;
  const auto map = slave::bus_map(bus);
  const std::vector<std::uint32_t> controllers = slave::controllers_own(bus);
  std::vector<CanFilter> own = slave::set_point_filters(bus);
  own.insert(own.end(), controllers.begin(), controllers.end());
  double rest = 0;
  for (std::size_t i = 0; frames.size() < count; ++i) {
    const PeriodicFrame& p = map[i % map.size()];
    if (slave::hears(own, p.id)) continue;
    rest += p.rate_Hz / bus.sync_Hz;
    if (rest < 1) continue;
    rest -= 1;
    can_frame f{};
    f.can_id = p.id;
    f.len = p.size;
    frames.push_back(f);
  }
  return frames;
}

double thread_time_s() noexcept {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

template <typename Step>
void time_steps(benchmark::State& bench, const Step& step) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const auto frames = traffic(machine.bus, static_cast<std::size_t>(bench.range(0)));
  Feeder feeder;
  SocketCanBus bus("bench", feeder.sockets());
  double timed_s = 0;
  std::int64_t steps = 0;
  for (auto _ : bench) {
    for (const can_frame& f : frames) feeder.feed(f);
    const double start = thread_time_s();
    step(machine, bus, feeder);
    const double s = thread_time_s() - start;
    bench.SetIterationTime(s);
    timed_s += s;
    ++steps;
  }
  if (feeder.refused() > 0) bench.SkipWithError("the socket pair's queue is too short");
  bench.counters["frames_per_s"] = static_cast<double>(bench.range(0)) * machine.bus.sync_Hz;
  bench.counters["core_share"] = timed_s / static_cast<double>(steps) * machine.bus.sync_Hz;
  bench.SetItemsProcessed(steps * bench.range(0));
}

/// Until there is nothing more, as the loop does.
void BM_SocketCanReceive(benchmark::State& bench) {
  time_steps(bench, [](const MachineDescription&, SocketCanBus& bus, Feeder&) {
    CanFrame frame;
    while (bus.receive(frame)) benchmark::DoNotOptimize(frame);
  });
}
BENCHMARK(BM_SocketCanReceive)->Arg(13)->Arg(50)->Arg(100)->UseManualTime();

/// With what the slave does to each frame.
void BM_SocketCanReceiveAndDecode(benchmark::State& bench) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  VirtualCanBus elsewhere(1, machine.bus.bit_rate);
  slave::CanopenClient client(machine, elsewhere.port(0));
  slave::SensorSet sensors(machine);
  Time now{1s};
  time_steps(bench, [&](const MachineDescription&, SocketCanBus& bus, Feeder&) {
    now += 5ms;
    CanFrame frame;
    while (bus.receive(frame)) {
      if (!client.receive(frame, now)) sensors.receive(frame, now);
    }
  });
}
BENCHMARK(BM_SocketCanReceiveAndDecode)->Arg(13)->Arg(50)->Arg(100)->UseManualTime();

/// Two buses with so many frames each; to_one_bus is the time for both against that for one in the same run.
void BM_TwoBusesReceive(benchmark::State& bench) {
  const MachineDescription machine = load_machine(find_config("machine", "solar015"));
  const auto frames = traffic(machine.bus, static_cast<std::size_t>(bench.range(0)));
  Feeder first, second, alone;
  SocketCanBus first_bus("first", first.sockets()), second_bus("second", second.sockets()),
      one("alone", alone.sockets());
  CanBuses both(first_bus, &second_bus);
  double both_s = 0, one_s = 0;
  const auto timed_s = [](CanBus& bus) {
    const double start = thread_time_s();
    for (CanFrame frame; bus.receive(frame);) benchmark::DoNotOptimize(frame);
    return thread_time_s() - start;
  };
  for (auto _ : bench) {
    for (const can_frame& f : frames)
      for (Feeder* const feeder : {&first, &second, &alone}) feeder->feed(f);
    one_s += timed_s(one);
    const double s = timed_s(both);
    bench.SetIterationTime(s);
    both_s += s;
  }
  if (first.refused() + second.refused() + alone.refused() > 0)
    bench.SkipWithError("the socket pair's queue is too short");
  bench.counters["frames_per_s"] = 2.0 * static_cast<double>(bench.range(0)) * machine.bus.sync_Hz;
  bench.counters["core_share"] = both_s / static_cast<double>(bench.iterations()) * machine.bus.sync_Hz;
  bench.counters["to_one_bus"] = both_s / one_s;
}
BENCHMARK(BM_TwoBusesReceive)->Arg(50)->UseManualTime();  // 10 000 frames/s on each

/// The peer: one system call a frame, on one socket, and nothing else.
void BM_PlainReceive(benchmark::State& bench) {
  time_steps(bench, [](const MachineDescription&, SocketCanBus&, Feeder& feeder) {
    can_frame frame{};
    while (recv(feeder.sockets().process, &frame, sizeof frame, MSG_DONTWAIT) > 0) benchmark::DoNotOptimize(frame);
  });
}
BENCHMARK(BM_PlainReceive)->Arg(13)->Arg(50)->Arg(100)->UseManualTime();

}  // namespace
}  // namespace knuckle
