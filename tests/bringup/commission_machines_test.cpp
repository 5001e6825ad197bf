// Commissioning of machines of every kind, from its beginning to its end, and what ends it.
#include <gtest/gtest.h>

#include <utility>

#include "app/bringup/commission_result.h"
#include "machine/room.h"
#include "slave/j1939_bus.h"
#include "slave/node_setup.h"
#include "tests/bringup/machine_kinds.h"
#include "tests/support/says.h"
#include "transport/j1939.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::command_text;
using knuckle::test::kRateCommands;
using knuckle::test::says;
using test::answers;
using test::commission;
using test::kAngles;
using test::kSpeeds;
using test::machine_of;
using test::MachineKind;
using test::Outcome;
using test::Script;
using test::with;
using test::Words;

constexpr double kZeroError_rad = 0.03;  // a tape is read to a millimetre, and pins are some beside the drawing

const BroadcastField& angle_in(const MachineDescription& machine, int joint) {
  return *machine.bus.broadcast(NodeRole::kEncoder, joint).field;
}

/// The text with zeros that are not the machine's own: of its boom, and of a module's arm.
std::string with_other_zeros(const std::string& text) {
  const std::string other = with(text, "zero_rad = 0.12", "zero_rad = 0.42");
  if (!other.empty()) return other;
  return with(with(text, "low = -1.6, high = 2.4,", "low = -1.3, high = 2.7,"), "low = 20, high = -200,",
              "low = 30, high = -190,");
}

class CommissionMachines : public testing::TestWithParam<MachineKind> {};

TEST_P(CommissionMachines, ComesToItsEndFindsTheZerosAndProvesWhatEndsMotion) {
  const MachineKind& kind = GetParam();
  const std::string file = with_other_zeros(kind.text());
  const MachineDescription truth = machine_of(kind.text()), read = machine_of(file);
  check_layout(file, read);
  const Outcome outcome = commission(truth, read, answers(kind.words));
  ASSERT_TRUE(well(outcome));
  EXPECT_TRUE(outcome.left_neutral);
  EXPECT_EQ(outcome.told.find("dead bands: not measured") == std::string::npos, kind.words.dead_bands);
  for (const AxisResult& axis : outcome.result.axes) {
    EXPECT_TRUE(axis.preset);
    EXPECT_EQ(axis.dead_band_extend && axis.dead_band_retract, kind.words.dead_bands);
    EXPECT_NEAR(axis.dead_band_extend.value_or(0.11), 0.11, 0.04);
  }
  const MachineDescription back =
      machine_of(commissioned_text(file, read, outcome.result, {"can0", "2026-03-01", "x"}));
  for (int j = 0; j < kJoints; ++j) {
    const BroadcastField &found = angle_in(back, j), &true_one = angle_in(truth, j);
    EXPECT_NEAR(found.bits.offset, true_one.bits.offset, kZeroError_rad) << j << '\n' << outcome.told;
    if (!found.analog) continue;
    EXPECT_NEAR(found.analog->low, true_one.analog->low, kZeroError_rad) << j;
    EXPECT_NEAR(found.analog->high, true_one.analog->high, kZeroError_rad) << j;
  }
  // Every guard is in the file as proved: of nodes, and of the machine's own controller.
  const bool by_own_controller = moves_joints(back.bus, kOwnController);
  EXPECT_EQ(back.bus.commands_guard.proved, by_own_controller);
  for (const std::string& note : machine_notes(back)) EXPECT_FALSE(says(note, "is not proved"));
  EXPECT_TRUE(slave::guard_lines(back.bus, [](std::uint8_t) { return true; }).empty());
}
INSTANTIATE_TEST_SUITE_P(, CommissionMachines, testing::ValuesIn(test::kMachineKinds),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST(CommissionFrames, AnAngleThatCountsTheOtherWayIsFoundByTheFirstSmallMotionAndSaidWhatToChange) {
  const std::pair<const char*, const char*> sign{"unit = \"rad\", sign = -1", "unit = \"rad\""},
      ends{"low = -1.6, high = 2.4,", "low = 2.4, high = -1.6,"};
  struct Case {
    std::string truth;
    std::pair<const char*, const char*> change;
    const char* text;
    Words words;
  };
  for (const auto& [truth, change, text, words] :
       {Case{test::speeds_text(), sign, "change 'sign' of boom_angle in the machine file", kSpeeds},
        Case{test::two_buses_text(), sign, "change 'sign' of boom_angle", kAngles},
        Case{test::j1939_text(), sign, "change 'sign' of boom_angle", kSpeeds},
        Case{test::voltages_text(), ends, "exchange 'low' and 'high' of boom_angle", test::kModule}}) {
    const std::string file = with(truth, change.first, change.second);
    const Outcome outcome = commission(machine_of(truth), machine_of(file), answers(words));
    EXPECT_EQ(outcome.ended.rfind("boom: its encoder counts in the wrong direction: ", 0), 0U) << outcome.told;
    EXPECT_TRUE(says(outcome.ended, text));
    EXPECT_LT(outcome.moved_m, 0.03);
    EXPECT_TRUE(outcome.left_neutral);
  }
}

TEST(CommissionFrames, AMachineThatGoesOnWithoutCommandsIsNotTaken) {
  const std::pair<std::string, const char*> kinds[] = {{test::speeds_text(), "send"},
                                                       {test::commands_on_second(), "configure"}};
  for (const auto& [text, first] : kinds) {
    Words words = kSpeeds;
    words.first = first;
    MachineDescription deaf = machine_of(text);
    deaf.bus.valve_watchdog_s = 0.5;
    const Outcome outcome = commission(deaf, machine_of(text), answers(words));
    EXPECT_TRUE(says(outcome.ended, "boom, when command frames end: its cylinder stands after"));
    EXPECT_TRUE(says(outcome.ended, "which is late: valve_watchdog_ms = 50"));
  }
}

TEST(CommissionFrames, AMachineThatNeverStopsIsFoundAndLedNoFurtherThanALittle) {
  const MachineDescription machine = machine_of(command_text());
  MachineDescription deaf = machine;
  deaf.bus.valve_watchdog_s = 10;
  const auto bus = test::simulated_bus(deaf, 7);
  const double before_m = bus->plant().cylinder_m[kBoom];
  BusAccess access = sim::access_to(bus);
  JogBench bench(machine, access, [] { return false; });
  bench.start();
  const JogRun run = bench.run({.joint = kBoom,
                                .peak = slave::kJogTable.command,
                                .rise_1ps = 0.5,
                                .travel_m = 5e-3,
                                .longest_s = 10,
                                .then_silence = true});
  EXPECT_EQ(judge_silence(run, machine.bus).finding.level, Finding::Level::kFault);
  EXPECT_LT(bus->plant().cylinder_m[kBoom] - before_m, 0.025) << "four times 5 mm, and what it takes to stop";
}

TEST(CommissionFrames, AProofHoldsOfTheseCommandsAndTimesAlone) {
  const std::string text = command_text();
  WizardResult result;
  result.guards.emplace_back().proved = true;
  const std::string found = commissioned_text(text, machine_of(text), result, {"can0", "2026-03-01", "x"});
  const auto changed = [&](const std::string& from, const std::string& to) {
    return machine_of(with(found, from, to)).bus.commands_guard.changed;
  };
  EXPECT_EQ(changed("", ""), GuardProof::Changed::kNothing);
  EXPECT_EQ(changed("valve_watchdog_ms = 50 ", "valve_watchdog_ms = 60 "), GuardProof::Changed::kTimes);
  EXPECT_EQ(changed("id = 0x18FF0105", "id = 0x18FF0205"), GuardProof::Changed::kChannels);
}

TEST(CommissionFrames, WhatNoFrameTellsIsSaidAndTheRestIsDone) {
  const std::string text = command_text(kRateCommands, "");
  Script script = answers(kSpeeds);
  script.erase(script.begin() + 2, script.begin() + 4);  // nobody asks for the E-stop
  const Outcome outcome = commission(machine_of(text), machine_of(text), script);
  ASSERT_TRUE(well(outcome));
  EXPECT_TRUE(says(outcome.told, "E-stop: no frame tells of it"));
}

TEST(CommissionFrames, NothingMovesByAnAngleThatIsNoneOfTheJoints) {
  const std::string text = command_text();
  Words words = kSpeeds;
  words.zero = "keep";
  const std::string wrong = with(text, "zero_rad = 0.12", "zero_rad = 2.5");
  const Outcome outcome = commission(machine_of(text), machine_of(wrong), answers(words));
  EXPECT_TRUE(says(outcome.ended, "its zero must be corrected"));
  EXPECT_LT(outcome.moved_m, 1e-3);
}

TEST(CommissionTwoBuses, OneThatIsCutEndsItNeutralAndIsNamed) {
  const MachineDescription machine = machine_of(test::two_buses_text());
  bool moved = false;
  const Outcome outcome = commission(machine, machine, answers(kAngles), [&](sim::MachineOnBus& b) {
    moved = moved || std::abs(b.machine().nodes().outputs().spool_demand[kBoom]) > 0.2;
    if (moved) b.bus(1).disconnect(sim::MachineOnBus::kControllerPort, true);
  });
  EXPECT_TRUE(moved);
  EXPECT_EQ(outcome.ended.rfind("bus machine: ", 0), 0U) << outcome.ended;
  EXPECT_TRUE(outcome.left_neutral);
}

TEST(CommissionJ1939, CommandsWaitUntilTheAddressIsHeld) {
  const MachineDescription machine = machine_of(test::j1939_text());
  struct Heard {
    Time claimed = kNever, told = kNever;
  } heard;
  (void)commission(machine, machine, {"ready", "send", "pressed", "released", "0"}, [&heard](sim::MachineOnBus& b) {
    if (b.now() != kNever && b.now() > Time{60ms}) return;
    b.set_tap({[](void* context, Time at, const CanFrame& frame) {
                 auto& h = *static_cast<Heard*>(context);
                 if (h.claimed == kNever && j1939::claimed_name(frame) == slave::J1939Bus::kName) h.claimed = at;
                 if (h.told == kNever && frame.id == (0x18FF0105U | kExtendedId)) h.told = at;
               },
               &heard});
  });
  ASSERT_NE(heard.claimed, kNever);
  ASSERT_NE(heard.told, kNever);
  EXPECT_GE(heard.told - heard.claimed, slave::J1939Bus::kClaimWaits - 1ms);
}

TEST(CommissionJ1939, AnAddressThatIsLostOrAGroupThatComesTwiceEndsItNeutral) {
  const MachineDescription machine = machine_of(with(test::j1939_text(), "\nsource = 0x21", ""));
  for (const bool address : {true, false}) {
    bool moved = false;
    const Outcome outcome = commission(machine, machine, answers(kSpeeds), [&](sim::MachineOnBus& b) {
      const bool moves = b.machine().nodes().outputs().spool_demand != JointVector::Zero();
      if (!moves || std::exchange(moved, true)) return;
      CanFrame other{.id = 0x18FF1077U | kExtendedId, .size = 8, .data = {0xB4, 0x5F, 0x02, 0x53, 0xEE, 0x18}};
      b.nodes_end().shout(address ? j1939::claim_frame(1, 0x05) : other);
    });
    EXPECT_TRUE(moved) << outcome.told;
    EXPECT_TRUE(says(outcome.ended, address ? "J1939 address" : "two devices send"));
    EXPECT_TRUE(outcome.left_neutral);
  }
}

}  // namespace
}  // namespace knuckle::bringup
