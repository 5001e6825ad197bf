// Home on two: a cylinder's transmitters fail, the operator acknowledges it and chooses to go on without them. Nothing
// of it happens by itself.
#include "slave/home_on_two.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "machine/reason_text.h"
#include "tests/slave/gate_bench.h"
#include "tests/slave/leading.h"

namespace knuckle::slave {
namespace {

using test::BenchMachine;
using test::kFast;

constexpr double kOpen = 0.11;  // of spool stroke: below it no oil flows

std::uint8_t node_of_pressure(const BenchMachine& m, int chamber) {
  return m.description.bus.node_of(NodeRole::kPressure, chamber).id;
}

/// A node that fails as well: another pressure transmitter, or the arm's encoder.
std::uint8_t another_node(const BenchMachine& m, NodeRole role, int chamber) {
  if (role == NodeRole::kPressure) return node_of_pressure(m, chamber);
  return m.description.bus.node_of(NodeRole::kEncoder, kArm).id;
}

/// Led where it stands, until one of the boom's transmitters fails; then enable is let go of.
void fail_boom(BenchMachine& m, sim::NodeFault how, int chamber = 0) {
  ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
  m.run(500ms);
  ASSERT_TRUE(m.nodes.inject(node_of_pressure(m, chamber), how));
  m.run(300ms);
  ASSERT_EQ(m.loop.mode(), Mode::kFault) << text(m.loop.blocking());
  m.hand.enable = false;
  m.align();
  m.run(500ms);
}

/// Until the failed node is shown: nodes are started anew again and again meanwhile.
void acknowledge(BenchMachine& m) {
  for (int i = 0; i < 4000 && !HomeOnTwo(m.description).cylinder_of(m.loop.blocking()); ++i) m.tick();
  test::press_and_release(m);
  m.run(1500ms);
}

/// Of the boom, whose transmitter sends invalid values.
struct OfferedHome : BenchMachine {
  OfferedHome() {
    fail_boom(*this, sim::NodeFault::kInvalid);
    acknowledge(*this);
    EXPECT_TRUE(loop.home().offered()) << text(loop.blocking());
  }
};

void choose(BenchMachine& m) {
  m.home = HomeMessage{{}, 1};
  m.run(1200ms);
  m.home.reset();
}

double opened(const BenchMachine& m) {
  double most = 0;
  for (const auto& w : m.wire)
    for (int i = 0; i < kJoints; ++i) {
      if (w.frame.id != canopen::rpdo1_id(m.description.bus.valve(i).id)) continue;
      most = std::max(most, std::abs(canopen::parse_valve_command(w.frame)->set_point));
    }
  return most;
}

TEST(HomeOnTwo, IsOfferedAfterTheFaultWasAcknowledgedAndTakenOnlyByItsOwnMessage) {
  for (const sim::NodeFault how : {sim::NodeFault::kInvalid, sim::NodeFault::kSilent}) {
    SCOPED_TRACE(static_cast<int>(how));
    BenchMachine m;
    fail_boom(m, how);
    m.wire.clear();
    choose(m);  // nobody has acknowledged anything
    EXPECT_FALSE(m.loop.home().offered());
    acknowledge(m);
    ASSERT_TRUE(m.loop.home().offered()) << text(m.loop.blocking());
    EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kHomeOffered, kBoom));
    EXPECT_TRUE(m.link.last()->home_offered);
    EXPECT_EQ(m.link.last()->unknown_torques, 1);
    m.run(5s);
    EXPECT_FALSE(m.loop.home().chosen()) << "never by itself";
    choose(m);
    EXPECT_TRUE(m.loop.home().chosen()) << text(m.loop.blocking());
    EXPECT_TRUE(m.link.last()->home_on_two);
    m.run(2s);
    EXPECT_EQ(m.loop.mode(), Mode::kFault) << "nothing goes on by itself";
    EXPECT_EQ(opened(m), 0);
    EXPECT_TRUE(test::engages_anew(m));
  }
}

TEST(HomeOnTwo, MovesSlowlyUntilTheProgramStartsAnewWhateverFailsBetween) {
  OfferedHome m;
  choose(m);
  EXPECT_TRUE(test::engages_anew(m));
  m.wire.clear();
  m.move(kFast, 2s);
  EXPECT_EQ(m.loop.mode(), Mode::kEngaged) << text(m.loop.blocking());
  EXPECT_GT(opened(m), kOpen);
  EXPECT_LE(opened(m), 0.3 + 1e-3);

  m.nodes.inject(node_of_pressure(m, 0), sim::NodeFault::kNone);  // sound again: too late
  m.nodes.set_estop(true);
  m.run(200ms);
  ASSERT_EQ(m.loop.mode(), Mode::kEStop);
  m.nodes.set_estop(false);
  m.hand.enable = false;
  m.run(2s);
  EXPECT_TRUE(test::engages_anew(m));
  EXPECT_TRUE(m.link.last()->home_on_two);
  EXPECT_EQ(m.link.last()->unknown_torques, 1);
}

TEST(HomeOnTwo, IsNotTakenWhileEnableIsHeldNorForAnotherCylinderNorTooLate) {
  OfferedHome m;
  m.hand.enable = true;
  m.run(20ms);
  m.home = HomeMessage{{}, 1};
  m.run(1500ms);
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kEnableHeld));
  m.home.reset();
  m.hand.enable = false;
  m.run(3s);

  const auto refused = [&](const char* why) {
    m.home = HomeMessage{{}, 1};
    m.run(1500ms);
    m.home.reset();
    EXPECT_TRUE(m.loop.home().offered()) << why << ": " << text(m.loop.blocking());
  };
  m.home = HomeMessage{{}, 2};
  m.run(1500ms);
  EXPECT_TRUE(m.loop.home().offered()) << "another cylinder";
  m.home_held_up = 250ms;
  refused("asked for long ago");
  m.home_held_up = {};
  m.round_trip = 600ms;
  m.run(1s);
  refused("over a round trip that is too long");
  m.round_trip = 20ms;
  m.run(1s);
  m.hand.stop = true;
  refused("while Stop is pressed");
  m.hand.stop = false;
  m.nodes.set_estop(true);
  refused("while the E-stop is open");
  m.nodes.set_estop(false);
  m.link_up = false;
  refused("over a dead link");
  m.link_up = true;
  m.run(1s);
  choose(m);
  EXPECT_TRUE(m.loop.home().chosen()) << text(m.loop.blocking());
}

TEST(HomeOnTwo, IsNotTakenWhileSomethingIsPressedAsFarAsTwoTorquesTellOrSixPressuresDid) {
  BenchMachine m;
  ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
  m.signals.pressure_Pa[2 * kArm] += 40e5;  // something pushes at the arm
  m.run(500ms);
  ASSERT_TRUE(m.loop.force().contact);
  m.nodes.inject(node_of_pressure(m, 0), sim::NodeFault::kInvalid);
  m.run(300ms);
  ASSERT_EQ(m.loop.mode(), Mode::kFault);
  m.hand.enable = false;
  m.run(100ms);
  acknowledge(m);
  choose(m);
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kHomePressed));
  EXPECT_TRUE(m.loop.home().offered());
  m.signals.pressure_Pa[2 * kArm] -= 40e5;  // the two other cylinders tell nothing of it any more
  m.run(5s);
  choose(m);
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kHomePressed));
}

TEST(HomeOnTwo, PressingAndReleasingEnableOnceMoreTriesTheTransmittersAgain) {
  for (const bool sound : {false, true}) {
    BenchMachine m;
    fail_boom(m, sim::NodeFault::kSilent);
    acknowledge(m);
    ASSERT_TRUE(m.loop.home().offered());
    if (sound) m.nodes.inject(node_of_pressure(m, 0), sim::NodeFault::kNone);
    test::press_and_release(m);
    EXPECT_FALSE(m.loop.home().offered());
    m.run(5s);
    if (!sound) {
      EXPECT_EQ(m.loop.mode(), Mode::kFault);
      continue;
    }
    EXPECT_EQ(m.link.last()->unknown_torques, 0);
    EXPECT_TRUE(test::engages_anew(m));
  }
}

TEST(HomeOnTwo, IsOfferedForPressuresOfOneCylinderAlone) {
  const BenchMachine m;
  const BusDescription& bus = m.description.bus;
  const auto cylinder = [&](const MachineDescription& machine, ReasonCode code, std::uint8_t subject) {
    return HomeOnTwo(machine).cylinder_of({code, subject, 0, 0});
  };
  for (int chamber = 0; chamber < 6; ++chamber) {
    const std::uint8_t id = node_of_pressure(m, chamber);
    for (const ReasonCode code : {ReasonCode::kNodeSilent, ReasonCode::kSensorStale, ReasonCode::kSensorImplausible})
      EXPECT_EQ(cylinder(m.description, code, id), chamber / 2) << chamber;
    EXPECT_FALSE(cylinder(m.description, ReasonCode::kNodeIdentity, id)) << "another device is no failed one";
    EXPECT_FALSE(cylinder(m.description, ReasonCode::kNodeIdTwice, id));
  }
  for (const std::uint8_t other : {bus.node_of(NodeRole::kEncoder, kBoom).id, bus.valve(kBoom).id, bus.enable().id})
    EXPECT_FALSE(cylinder(m.description, ReasonCode::kNodeSilent, other));

  MachineDescription low = m.description;  // only the boom's own pressures can keep that limit
  low.limits.chamber_pressure_Pa = low.hydraulics.main_relief_Pa - 1;
  EXPECT_FALSE(cylinder(low, ReasonCode::kNodeSilent, node_of_pressure(m, 0)));
  MachineDescription two = m.description;
  two.sensors.without_pressures = kBoom;
  EXPECT_FALSE(cylinder(two, ReasonCode::kNodeSilent, node_of_pressure(m, 2))) << "one torque tells no force";
}

TEST(HomeOnTwo, WhatNobodyHasSeenWithAllPressuresMayBePressed) {
  BenchMachine m;
  m.nodes.inject(node_of_pressure(m, 0), sim::NodeFault::kInvalid);
  m.hand.presence = true;
  m.run(2s);
  acknowledge(m);
  ASSERT_TRUE(m.loop.home().offered()) << text(m.loop.blocking());
  choose(m);
  EXPECT_TRUE(test::is(m.loop.blocking(), ReasonCode::kHomePressed));
  EXPECT_FALSE(m.loop.home().chosen());
}

TEST(HomeOnTwo, WhatATransmitterTellsThatLiesIsNoPress) {
  const BenchMachine m;
  const Reason stuck{ReasonCode::kSensorImplausible, node_of_pressure(m, 0), 20, 20};
  const Reason encoder{ReasonCode::kSensorImplausible, m.description.bus.node_of(NodeRole::kEncoder, kBoom).id, 1, 1};
  for (const bool pressed_before : {false, true}) {
    HomeOnTwo home(m.description);
    Time now = m.now;
    for (int i = 0; i < 2000; ++i) home.note_pressed(pressed_before, now += 5ms);
    for (int i = 0; i < 200; ++i) home.note_pressed(true, now += 5ms);  // it has begun to lie
    home.note_contradiction(encoder, now);                              // says nothing of pressures
    home.note_contradiction(stuck, now);
    for (int i = 0; i < 200; ++i) home.note_pressed(true, now += 5ms);
    home.offer(kBoom);
    for (int i = 0; i < 300; ++i) {
      home.look({true, false, JointVector::Zero(), false}, now += 5ms);
      home.choose(1, now);
    }
    EXPECT_EQ(home.chosen(), !pressed_before);
  }
}

TEST(HomeOnTwo, IsTakenOnlyAfterASecondInWhichItStoodAndTouchedNothing) {
  const BenchMachine m;
  HomeOnTwo home(m.description);
  Time now = m.now;
  for (int i = 0; i < 2000; ++i) home.note_pressed(false, now += 5ms);
  home.offer(kBoom);
  const auto moving = [](double rate_radps) {
    return HomeOnTwo::Machine{true, false, JointVector(0, rate_radps, 0), false};
  };
  const HomeOnTwo::Machine calm = moving(0), unknown{}, pressed{true, false, JointVector::Zero(), true};
  const auto look = [&](const HomeOnTwo::Machine& machine, int steps) {
    for (int i = 0; i < steps; ++i) {
      home.look(machine, now += 5ms);
      home.choose(1, now);
    }
  };
  for (const HomeOnTwo::Machine& not_calm : {unknown, moving(0.051), moving(-0.051), moving(std::nan("")), pressed}) {
    look(calm, 180);
    look(not_calm, 1);
  }
  look(calm, 180);
  EXPECT_FALSE(home.chosen());
  look(calm, 22);
  EXPECT_TRUE(home.chosen());
}

TEST(HomeOnTwo, IsNotOfferedWhileAnotherNodeHasFailedToo) {
  for (const NodeRole role : {NodeRole::kPressure, NodeRole::kEncoder}) {
    BenchMachine m;
    const std::uint8_t other = another_node(m, role, 3);
    ASSERT_TRUE(m.engage()) << text(m.loop.blocking());
    m.run(500ms);
    m.nodes.inject(node_of_pressure(m, 0), sim::NodeFault::kSilent);
    m.nodes.inject(other, sim::NodeFault::kSilent);
    m.run(300ms);
    m.hand.enable = false;
    m.run(500ms);
    acknowledge(m);
    for (int i = 0; i < 10000; ++i) {
      m.tick();
      ASSERT_FALSE(m.link.last()->home_offered) << text(m.loop.blocking());
    }
  }
}

/// Whether the boom's pressures count as measured, and can be given up.
bool boom_counts(const BenchMachine& m) {
  return m.loop.home().cylinder_of({ReasonCode::kNodeSilent, node_of_pressure(m, 0), 0, 0}) == kBoom;
}

/// Until a failure of this node is shown: nodes are started anew again and again meanwhile.
void press_and_release_at_failure_of(BenchMachine& m, std::uint8_t node) {
  const auto shown = [&] {
    const Reason& reason = m.loop.blocking();
    const NodeDescription* const about = node_of(reason, m.description.bus);
    return about != nullptr && about->id == node && reason.code != ReasonCode::kStartingUp;
  };
  for (int i = 0; i < 6000 && !shown(); ++i) m.tick();
  ASSERT_TRUE(shown()) << text(m.loop.blocking());
  test::press_and_release(m);
  m.run(1500ms);
}

TEST(HomeOnTwo, IsOfferedForTheSecondOfTwoCylindersOnceTheFirstIsSoundAndTriedAgain) {
  for (const sim::NodeFault how : {sim::NodeFault::kInvalid, sim::NodeFault::kSilent}) {
    SCOPED_TRACE(static_cast<int>(how));
    OfferedHome m;
    m.nodes.inject(node_of_pressure(m, 0), sim::NodeFault::kNone);
    m.nodes.inject(node_of_pressure(m, 2), how);
    m.run(1500ms);
    EXPECT_FALSE(m.link.last()->home_offered);
    EXPECT_FALSE(boom_counts(m)) << "nothing is taken back by itself";
    press_and_release_at_failure_of(m, node_of_pressure(m, 2));
    EXPECT_TRUE(boom_counts(m));
    acknowledge(m);
    EXPECT_TRUE(m.link.last()->home_offered) << text(m.loop.blocking());
    EXPECT_EQ(m.loop.blocking().subject, kArm);
    EXPECT_EQ(m.link.last()->unknown_torques, 2);
  }
}

class HomeGate : public GateBench {
 protected:
  /// Of the nominal flow.
  double opening_of(int joint, double command) const {
    const ValveDescription& valve = limits.valve[static_cast<std::size_t>(joint)];
    return valve.flow_share(valve.opening(command), command > 0);
  }
};

TEST_F(HomeGate, OpensAndMovesAtMostThirtyPercentWhereAMeasuredCylindersPressuresAreMissing) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<> any(-1, 1), pressure(0, 200e5);
  const MachineDescription machine = test::test_machine();
  int slowed = 0;
  for (int i = 0; i < 20000; ++i) {
    place(JointVector(0.3 + 0.6 * any(rng), -1.5 + 0.9 * any(rng), -0.8 + 1.2 * any(rng)));
    for (double& p : state.pressure_Pa) p = pressure(rng);
    state.pressures_known = {true, true, true};
    state.pressures_known[static_cast<std::size_t>(i % kJoints)] = false;
    const JointVector wanted(any(rng), any(rng), any(rng));
    const GateResult result = gate(wanted);
    ASSERT_FALSE(result.fault) << text(result.fault);
    slowed += (result.limits & kLimitHome) != 0;
    for (int j = 0; j < kJoints; ++j) {
      const double sent = result.commands[j];
      ASSERT_LE(std::abs(sent), 0.3 + 1e-12);
      // Either edge may let the most oil through: fed by the pump, whatever its flow, or let out under a load.
      const std::size_t in = static_cast<std::size_t>(2 * j + (sent > 0 ? 0 : 1)), out = in ^ 1U;
      const bool known = state.pressures_known[static_cast<std::size_t>(j)];
      double loads = 0, all = 0;
      for (int k = 0; k < kJoints; ++k) {
        if (opening_of(k, wanted[k]) == 0) continue;
        const double driven = state.pressure_Pa[static_cast<std::size_t>(2 * k + (wanted[k] > 0 ? 0 : 1))];
        const bool measured = state.pressures_known[static_cast<std::size_t>(k)];
        all = std::max(
            all, measured ? driven : machine.hydraulics.main_relief_Pa - machine.hydraulics.load_sensing_margin_Pa);
        if (measured) loads = std::max(loads, driven);
      }
      const double margin = machine.hydraulics.load_sensing_margin_Pa;
      const double drop = std::max(margin, known ? all + margin - state.pressure_Pa[in] : loads + margin);
      const double back = known ? state.pressure_Pa[out] : machine.hydraulics.main_relief_Pa;
      const double head = limits.head_area_m2[j], rod = limits.rod_side_area_m2[j];
      const double per_root = opening_of(j, sent) *
                              machine.cylinders[static_cast<std::size_t>(j)].valve.nominal_flow_m3ps /
                              std::sqrt(machine.cylinders[static_cast<std::size_t>(j)].valve.nominal_drop_Pa);
      const double rod_mps =
          per_root * std::max(std::sqrt(drop) / (sent > 0 ? head : rod), std::sqrt(back) / (sent > 0 ? rod : head));
      ASSERT_LE(rod_mps / std::abs(state.lever_m[j]), 0.3 * limits.max_rate_radps[j] * 1.001);
    }
  }
  EXPECT_GT(slowed, 1000);
}

TEST_F(HomeGate, LimitsNothingWhereTheFileSaysThatNobodyMeasuresThem) {
  MachineDescription machine = test::test_machine();
  machine.sensors.without_pressures = kBoom;
  remake(machine);
  state.pressures_known = {false, true, true};
  EXPECT_EQ(gate(JointVector(0.35, 0, 0)).limits & kLimitHome, 0);
  state.pressures_known = {false, false, true};
  EXPECT_NE(gate(JointVector(0.35, 0, 0)).limits & kLimitHome, 0);
}

}  // namespace
}  // namespace knuckle::slave
