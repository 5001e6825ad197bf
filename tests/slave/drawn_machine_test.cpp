// The loop on simulated machines drawn as the design says (oil, friction, dead bands, pins, transmitters), in the air
// and against a wall: no rule may take a sound machine for a broken one, and frozen sensors are found.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "machine/load.h"
#include "sim/machine_on_bus.h"
#include "slave/slave_loop.h"
#include "tests/slave/bench_machine.h"
#include "tests/support/places.h"

namespace knuckle::slave {
namespace {

struct Drawn {
  explicit Drawn(unsigned seed, const sim::WorldDescription& world = {})
      : description(load_machine(test::source_dir() + "/config/machines/solar015.toml")),
        kinematics(description),
        bus(2, description.bus.bit_rate),
        machine(sim::sample_truth(description, seed), world, kStart, bus.port(1), seed),
        loop(description, bus.port(0), link, kStarted) {
    hand.device_ok = hand.presence = true;
    hand.position_rad = kStart;
  }
  void tick() {
    now += 1ms;
    bus.advance(now);
    machine.step(now);
    if (++ticks % 5 != 0) return;
    hand.stamp = {5, kStarted.session, hand.stamp.sequence + 1, now, now - 20ms + kStarted.origin};
    link.deliver(encode(hand));
    loop.step(now);
  }
  bool engage() {
    for (int i = 0; i < 4000 && loop.mode() != Mode::kEngaged; ++i) {
      hand.enable = loop.mode() != Mode::kSelfTest && i > 1500;
      if (loop.state()) hand.position_rad = loop.state()->angle_rad;
      tick();
    }
    return loop.mode() == Mode::kEngaged;
  }
  /// Hand on its way for a time; stops early at a fault.
  template <typename Path>
  void follow(Path path, Duration time) {
    const JointVector start = hand.position_rad;
    const Time begin = now;
    while (now - begin < time && loop.mode() == Mode::kEngaged) {
      const double t = to_seconds(now - begin);
      hand.position_rad = start + path(t);
      hand.velocity_radps = (path(t + 1e-3) - path(t)) / 1e-3;
      tick();
    }
  }

  static inline const JointVector kStart{0.3, -1.5, -0.9};
  static constexpr LinkStart kStarted{11, 1h};
  MachineDescription description;
  Kinematics kinematics;
  VirtualCanBus bus;
  sim::SimulatedMachine machine;
  test::ScriptedLink link;
  SlaveLoop loop;
  MasterMessage hand;
  Time now{1s};
  long ticks = 0;
};

// No faster than a sound spool keeps within 10 % of its demand: the enable node drops the pilot otherwise.
JointVector wave(double t, unsigned seed) {
  const double fade = std::min(1.0, t / 3);
  const double w = 0.4 + 0.04 * seed;
  return fade * JointVector(0.30 * std::sin(w * t), 0.40 * std::sin(1.3 * w * t), 0.5 * std::sin(1.7 * w * t));
}

TEST(DrawnMachine, NothingIsTakenForBrokenInFreeMotion) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    Drawn m(seed);
    ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
    m.follow([seed](double t) { return wave(t, seed); }, 12s);
    EXPECT_EQ(m.loop.mode(), Mode::kEngaged)
        << "seed " << seed << " at " << to_seconds(m.now) << " s: " << text(m.loop.fault());
  }
}

TEST(DrawnMachine, NothingIsTakenForBrokenAgainstAWall) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    sim::WorldDescription world;
    sim::WallDescription floor;
    const MachineDescription d = load_machine(test::source_dir() + "/config/machines/solar015.toml");
    floor.point_m = Kinematics(d).tip(Drawn::kStart) - PlanarVector(0, 0.15);
    floor.normal = PlanarVector(0, 1);
    floor.stiffness_N_per_m = seed % 2 ? 1e6 : 2e7;
    world.walls.push_back(floor);
    Drawn m(seed, world);
    ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
    m.follow([](double t) { return JointVector(-0.20 * (1 - std::cos(0.8 * t)), 0, 0.05 * std::sin(t)); }, 16s);
    EXPECT_EQ(m.loop.mode(), Mode::kEngaged)
        << "seed " << seed << " at " << to_seconds(m.now) << " s: " << text(m.loop.fault());
  }
}

TEST(DrawnMachine, FrozenSensorsAreFoundInMotion) {
  for (const int id : {0x30, 0x31, 0x32, 0x20, 0x23}) {
    Drawn m(3);
    ASSERT_TRUE(m.engage());
    m.follow([](double t) { return wave(t, 3); }, 6s);  // now all three move
    ASSERT_TRUE(m.machine.inject(static_cast<std::uint8_t>(id), sim::NodeFault::kFrozen));
    const Time at = m.now;
    m.follow([](double t) -> JointVector { return wave(t + 6, 3) - wave(6, 3); }, 3s);
    EXPECT_EQ(m.loop.mode(), Mode::kFault) << id;
    // By plausibility, or by the enable node where the blind control loop has opened the valve faster than it can
    // follow.
    EXPECT_TRUE(m.loop.fault().subject == id || m.loop.fault().subject == 0x40) << text(m.loop.fault());
    EXPECT_LE(m.now - at, 500ms) << id;  // slow motion hides longer: it is the way that is bounded, not the time
  }
}

}  // namespace
}  // namespace knuckle::slave
