// Whatever the machine file says and whatever happens: every field of every frame that tells a node to move something
// is at neutral unless a gate let more pass. Read here from the bytes, by what the machine file says.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "machine/bus_frames.h"
#include "slave/jog.h"
#include "tests/slave/bench_machine.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;
using Random = std::mt19937;

int drawn(Random& rng, int least, int most) {
  return std::uniform_int_distribution<>(least, most)(rng);
}

/// Other ids, identifiers, profiles, strokes and rates; pressures on one node, valves on another, angles instead of
/// lengths.
MachineDescription drawn_machine(Random& rng) {
  MachineDescription machine = test::test_machine();
  BusDescription& bus = machine.bus;
  if (drawn(rng, 0, 1) == 1) {
    std::vector<NodeChannel> channels;
    for (std::uint8_t i = 0; i < 6; ++i)
      channels.push_back({static_cast<std::uint8_t>(i + 1), bus.nodes[3U + i].channels[0].signal});
    bus.nodes[3].channels = channels;
    bus.nodes.erase(bus.nodes.begin() + 4, bus.nodes.begin() + 9);
    bus.wire.pressure = WireDescription::Pressure::kInteger16;
    bus.wire.pressure_digits = 1;
  }
  if (drawn(rng, 0, 2) == 0) {
    PerJoint<std::uint8_t> axes{1, 2, 4};
    std::shuffle(axes.begin(), axes.end(), rng);
    for (std::size_t j = 1; j < kJoints; ++j) bus.nodes[0].channels.push_back(bus.nodes[j].channels[0]);
    for (std::size_t j = 0; j < kJoints; ++j) bus.nodes[0].channels[j].number = axes[j];
    std::sort(bus.nodes[0].channels.begin(), bus.nodes[0].channels.end(),
              [](const NodeChannel& a, const NodeChannel& b) { return a.number < b.number; });
    bus.nodes.erase(bus.nodes.begin() + 1, bus.nodes.begin() + kJoints);
  }
  std::vector<std::uint8_t> ids(100);
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::uint8_t>(i + 2);
  std::shuffle(ids.begin(), ids.end(), rng);
  constexpr std::array kStrokes{16384.0, 1000.0, 32766.0};
  bus.wire.valve_full_stroke = kStrokes[static_cast<std::size_t>(drawn(rng, 0, 2))];
  bus.set_point_every_nth_sync = drawn(rng, 1, 2);
  bus.valve_status_every_nth_sync = drawn(rng, 1, 4);
  for (std::size_t i = 0; i < bus.nodes.size(); ++i) {
    NodeDescription& node = bus.nodes[i];
    node.id = ids[i];
    for (const std::uint8_t pdo : receive_pdos(node))
      if (drawn(rng, 0, 1) == 1) node.rpdos[pdo] = static_cast<std::uint16_t>(0x501 + 4 * i + pdo);
    if (node.role == NodeRole::kValve && node.channels.size() == 1 && drawn(rng, 0, 2) == 0)
      node.profile = ValveProfile::kPved;
    if (node.role == NodeRole::kEncoder && drawn(rng, 0, 2) == 0) {
      ++node.channels[0].signal;
      node.rotary = {.steps_per_turn = 16384, .sign = drawn(rng, 0, 1) == 0 ? 1 : -1, .zero_rad = 0.4};
    }
  }
  return machine;
}

/// Little-endian.
int raw_set_point(const CanFrame& frame) {
  const int raw = frame.data[2] | frame.data[3] << 8;
  return raw < 0x8000 ? raw : raw - 0x10000;
}

/// What was let pass in a step.
struct Passed {
  bool may_open = false, may_enable = false;
  JointVector least = JointVector::Zero(), most = JointVector::Zero();  ///< Of stroke.
};

/// The newest steps: frames of a low priority wait on the bus.
using Lately = std::array<Passed, 4>;
void put(Lately& lately, const Passed& now) {
  std::rotate(lately.begin(), lately.end() - 1, lately.end());
  lately.front() = now;
}

/// @returns how many set-points were not neutral.
int judge(BenchMachine& m, const Lately& lately, const std::string& what) {
  const BusDescription& bus = m.description.bus;
  int open = 0;
  for (const auto& [at, frame] : m.wire) {
    for (int j = 0; j < kJoints; ++j) {
      if (frame.id != bus.set_point_id(j)) continue;
      EXPECT_EQ(frame.size, 4) << what;
      const int raw = raw_set_point(frame);
      if (raw == 0) continue;
      ++open;
      const auto let = [&](const Passed& one) {
        const double stroke = bus.wire.valve_full_stroke;
        return one.may_open && raw >= one.least[j] * stroke - 1 && raw <= one.most[j] * stroke + 1;
      };
      EXPECT_TRUE(std::any_of(lately.begin(), lately.end(), let))
          << what << ": " << kJointNames[static_cast<std::size_t>(j)] << ' ' << raw;
    }
    if (frame.id != bus.enable().rpdo_id()) continue;
    EXPECT_EQ(frame.size, 1) << what;
    const bool may = std::any_of(lately.begin(), lately.end(), [](const Passed& one) { return one.may_enable; });
    EXPECT_TRUE(frame.data[0] == 0 || (frame.data[0] == 1 && may)) << what;
  }
  m.wire.clear();
  return open;
}

struct Event {
  const char* name;
  std::function<void(BenchMachine&, Random&)> happens;
};

std::uint8_t any_node(const BenchMachine& m, Random& rng) {
  const auto& nodes = m.description.bus.nodes;
  return nodes[static_cast<std::size_t>(drawn(rng, 0, static_cast<int>(nodes.size()) - 1))].id;
}

const std::vector<Event>& events() {
  static const std::vector<Event> all{
      {"nothing", [](BenchMachine&, Random&) {}},
      {"E-stop", [](BenchMachine& m, Random&) { m.nodes.set_estop(true); }},
      {"link cut", [](BenchMachine& m, Random&) { m.link_up = false; }},
      {"stop", [](BenchMachine& m, Random&) { m.hand.stop = true; }},
      {"no hand", [](BenchMachine& m, Random&) { m.hand.presence = false; }},
      {"enable released", [](BenchMachine& m, Random&) { m.hand.enable = false; }},
      {"impossible set-point", [](BenchMachine& m, Random&) { m.hand.position_rad[kArm] = std::nan(""); }},
      {"jump", [](BenchMachine& m, Random&) { m.hand.position_rad[kBoom] += 1; }},
      {"silent node", [](BenchMachine& m, Random& rng) { m.nodes.inject(any_node(m, rng), sim::NodeFault::kSilent); }},
      {"invalid value",
       [](BenchMachine& m, Random& rng) { m.nodes.inject(any_node(m, rng), sim::NodeFault::kInvalid); }},
      {"node started anew by another",
       [](BenchMachine& m, Random& rng) {
         m.bus.port(2).send(canopen::nmt_frame(canopen::NmtCommand::kResetNode, any_node(m, rng)));
       }},
      {"late loop", [](BenchMachine& m, Random& rng) {
         m.hung = true;
         m.run(5ms * drawn(rng, 2, 40));
         m.wire.clear();
         m.hung = false;
       }}};
  return all;
}

void mend(BenchMachine& m) {
  m.nodes.set_estop(false);
  for (const NodeDescription& node : m.description.bus.nodes) m.nodes.inject(node.id, sim::NodeFault::kNone);
  m.link_up = m.hand.presence = true;
  m.hand.stop = false;
  m.align();
}

TEST(Neutral, IsWhatIsToldUnlessTheSafetyGateLetsMorePass) {
  Random rng(41);
  int engaged = 0, open = 0;
  for (int run = 0; run < 24; ++run) {
    BenchMachine m(drawn_machine(rng));
    Lately lately{};
    for (int turn = 0; turn < 3; ++turn) {
      const Event& event = events()[static_cast<std::size_t>(3 * run + turn) % events().size()];
      const std::string what = std::string(event.name) + ", run " + std::to_string(run);
      const auto run_for = [&](Duration time) {
        for (const Time end = m.now + time; m.now < end;) {
          const Time stepped_at = m.now;
          m.move(m.hand.velocity_radps, 5ms);
          EXPECT_EQ(m.now - stepped_at, 5ms);
          const Mode mode = m.loop.mode();
          put(lately, {mode == Mode::kEngaged, led(mode), m.loop.commands(), m.loop.commands()});
          open += judge(m, lately, what);
        }
      };
      mend(m);
      m.hand.enable = true;  // and released: a fault is acknowledged
      run_for(100ms);
      m.hand.enable = false;
      run_for(2500ms);
      m.align();
      m.hand.enable = true;
      run_for(300ms);
      for (int j = 0; j < kJoints; ++j) m.hand.velocity_radps[j] = 0.01 * drawn(rng, -30, 30);
      run_for(300ms);
      engaged += m.loop.mode() == Mode::kEngaged ? 1 : 0;
      event.happens(m, rng);
      run_for(400ms);
      m.hand.velocity_radps.setZero();
    }
  }
  EXPECT_GE(engaged, 24) << "else nothing was tried";
  EXPECT_GE(open, 5000);
}

TEST(Neutral, IsWhatIsToldUnlessTheJogGateLetsMorePass) {
  using Phase = Jog::Phase;
  constexpr double kMostJog = 0.35;  // of stroke
  Random rng(43);
  int open = 0;
  for (int run = 0; run < 16; ++run) {
    BenchMachine m(drawn_machine(rng));
    m.hung = true;
    Jog jog(m.description, m.bus.port(0));
    const std::string what = "run " + std::to_string(run);
    const int joint = drawn(rng, 0, 2);
    Lately lately{};
    const auto run_for = [&](Duration time) {
      for (const Time end = m.now + time; m.now < end;) {
        m.run(5ms);
        jog.step(m.now);
        const Phase phase = jog.phase();
        const bool may_open = phase == Phase::kMoving || phase == Phase::kOpening || phase == Phase::kWithheld;
        const JointVector most = JointVector::Unit(joint) * kMostJog;
        put(lately, {may_open, phase != Phase::kRest && phase != Phase::kPilotDown, -most, most});
        open += judge(m, lately, what);
      }
    };
    jog.start();
    run_for(4s);
    ASSERT_TRUE(jog.client().operational()) << text(jog.client().setup_failure(), jog.client().bus());
    if (run % 2 == 0) {
      jog.try_guard(m.description.bus.valve(joint), joint);
    } else {
      jog.move({.joint = joint, .peak = 0.01 * drawn(rng, -35, 35), .travel_m = 0.01});
    }
    run_for(std::chrono::milliseconds(drawn(rng, 100, 1500)));
    events()[static_cast<std::size_t>(run) % events().size()].happens(m, rng);
    run_for(2s);
  }
  EXPECT_GE(open, 500);
}

}  // namespace
}  // namespace knuckle::slave
