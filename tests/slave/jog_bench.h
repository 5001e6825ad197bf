// The bench without its loop: a jog has the bus.
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "slave/jog.h"
#include "tests/slave/bench_machine.h"

namespace knuckle::slave {

class JogBench {
 public:
  explicit JogBench(const MachineDescription& machine = test::test_machine()) : JogBench(machine, machine) {}
  /// @param believed the machine as the jog has it
  JogBench(const MachineDescription& machine, const MachineDescription& believed)
      : bench(machine), jog(calibrated(believed), bench.can) {
    bench.hung = true;
    samples.reserve(20000);
  }
  /// One SYNC period.
  void step() {
    bench.run(5ms);
    jog.step(bench.now);
    if (jog.sample()) samples.push_back(*jog.sample());
  }
  void run(Duration time) {
    for (const Time end = bench.now + time; bench.now < end;) step();
  }
  /// Asks the nodes to start, whatever comes of it.
  void begin() {
    jog.start();
    run(3s);
  }
  void start() {
    begin();
    ASSERT_TRUE(jog.client().operational()) << text(jog.client().fault());
    bench.wire.clear();
  }
  void until(Jog::Phase phase) {
    for (int i = 0; i < 20000 && jog.phase() != phase; ++i) step();
    ASSERT_EQ(jog.phase(), phase);
  }
  /// Until the task is over.
  void finish() { until(Jog::Phase::kRest); }

  test::BenchMachine bench;
  Jog jog;
  std::vector<JogSample> samples;
};

}  // namespace knuckle::slave
