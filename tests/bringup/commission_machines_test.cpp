// Commissioning from its beginning to its end of machines with two buses, with frames from a J1939 address and groups
// that they are led by, and with pilot valves and sensors on a CiA 401 module.
#include <gtest/gtest.h>

#include <algorithm>

#include "app/bringup/commission_guards.h"
#include "app/bringup/recover.h"
#include "core/error.h"
#include "machine/reason_text.h"
#include "machine/room.h"
#include "slave/j1939_bus.h"
#include "slave/node_setup.h"
#include "tests/bringup/commissioned.h"
#include "tests/support/command_machine.h"
#include "tests/support/j1939_machine.h"
#include "tests/support/module_machine.h"
#include "tests/support/refusal.h"
#include "tests/support/two_buses.h"
#include "transport/j1939.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::command_text;
using knuckle::test::kBroadcasts;
using knuckle::test::kRateCommands;
using knuckle::test::kStateBroadcast;
using test::commission;
using test::machine_of;
using test::Outcome;
using test::Script;
using test::with;

constexpr double kZeroError_rad = 0.03;  // a tape is read to a millimetre, and pins are some beside the drawing
const ResultOrigin kOrigin{"can0", "2026-03-01", "x"};

struct Words {
  const char* first = "configure";
  const char* zero = "correct";
  bool valve_nodes = false, dead_bands = true;
};

/// What a person answers with whom all is well.
Script answers(const Words& words) {
  Script script{"ready", words.first, "pressed", "released", "0"};
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"tape", words.zero});
  script.emplace_back("pilot");
  if (words.valve_nodes) script.emplace_back("guards");
  script.emplace_back("move");
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "longer", "go", "shorter"});
  if (!words.valve_nodes) script.emplace_back("guards");
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "go", "go"});
  if (words.dead_bands) script.insert(script.end(), {"go", "go", "go"});
  script.emplace_back("finish");
  return script;
}

double zero_of(const MachineDescription& machine, int joint) {
  return machine.bus.broadcast(NodeRole::kEncoder, joint).field->bits.offset;
}

/// To its end, and the zero of the boom found; the file that it writes is read and says what ends motion.
MachineDescription expect_found(const std::string& truth, const std::string& file, const Words& words) {
  const MachineDescription read = machine_of(file);
  check_layout(file, read);
  const Outcome outcome = commission(machine_of(truth), read, answers(words));
  EXPECT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_TRUE(outcome.left_neutral);
  EXPECT_TRUE(healthy(outcome.result.findings)) << outcome.told;
  if (!outcome.ended.empty()) return read;
  const std::string found = commissioned_text(file, read, outcome.result, kOrigin);
  MachineDescription back = machine_of(found);
  for (int j = 0; j < kJoints; ++j)
    EXPECT_NEAR(zero_of(back, j), zero_of(machine_of(truth), j), kZeroError_rad) << j << '\n' << outcome.told;
  for (const std::string& note : machine_notes(back)) EXPECT_EQ(note.find("is not proved"), std::string::npos) << note;
  EXPECT_TRUE(slave::guard_lines(back.bus, [](std::uint8_t) { return true; }).empty());
  return back;
}

/// Found by the first small motion, and nothing goes further. @param text of the line that ends it
void expect_wrong_sign(const std::string& truth, const std::string& file, const Words& words, const std::string& text) {
  const Outcome outcome = commission(machine_of(truth), machine_of(file), answers(words));
  EXPECT_EQ(outcome.ended.rfind("boom: its encoder counts in the wrong direction: ", 0), 0U)
      << outcome.ended << outcome.told;
  EXPECT_NE(outcome.ended.find(text), std::string::npos) << outcome.ended;
  EXPECT_LT(outcome.moved_m, 0.03);
  EXPECT_TRUE(outcome.left_neutral);
}

std::string enable_node() {
  return "[[bus.node]]\nname = \"enable\"\nprofile = \"cia401\"\nid = 0x40\ndevice_type = 0x0191\nvendor = 0x4B4E\n"
         "product = 0x0401\nchannels = { 1 = \"machine_enable\" }\n";
}

// ---- Two buses

/// Valves and enable node on the first bus, all that the machine sends on the second; or the other way round with its
/// commands: an enable node on the first, all else on the second.
std::string commands_on_second() {
  std::string text = command_text("", "");
  text.insert(text.find("[[bus.broadcast]]"), enable_node());
  text = knuckle::test::on_two_buses(text);
  text.insert(text.find("\n[limits]"), "\n" + std::string(kRateCommands));
  return text;
}

TEST(CommissionTwoBuses, ValvesOnOneAndAnglesOnTheOther) {
  const std::string truth = knuckle::test::two_buses_text();
  expect_found(truth, with(truth, "zero_rad = 0.12", "zero_rad = 0.42"), {.valve_nodes = true});
  expect_wrong_sign(truth, with(truth, "unit = \"rad\", sign = -1", "unit = \"rad\""), {.valve_nodes = true},
                    "change 'sign' of boom_angle");
}

TEST(CommissionTwoBuses, TheCommandsBusFallsSilentAlone) {
  const std::string text = commands_on_second();
  const MachineDescription back = expect_found(text, text, {.dead_bands = false});
  EXPECT_EQ(back.bus.commands_guard, (GuardProof{true, 0, "2026-03-01"}));
  MachineDescription deaf = machine_of(text);
  deaf.bus.valve_watchdog_s = 0.5;
  const Outcome outcome = commission(deaf, machine_of(text), answers({.dead_bands = false}));
  EXPECT_NE(outcome.ended.find("boom, when command frames end: its cylinder stands after"), std::string::npos)
      << outcome.ended;
}

TEST(CommissionTwoBuses, OneThatIsCutEndsItNeutralAndIsNamed) {
  const MachineDescription machine = machine_of(knuckle::test::two_buses_text());
  bool moved = false;
  const Outcome outcome = commission(machine, machine, answers({.valve_nodes = true}), [&](sim::MachineOnBus& b) {
    moved = moved || std::abs(b.machine().nodes().outputs().spool_demand[kBoom]) > 0.2;
    if (moved) b.bus(1).disconnect(sim::MachineOnBus::kControllerPort, true);
  });
  EXPECT_TRUE(moved);
  EXPECT_EQ(outcome.ended.rfind("bus machine: ", 0), 0U) << outcome.ended;
  EXPECT_TRUE(outcome.left_neutral);
}

// ---- J1939

/// Command frames from an address, angles and the machine's state in groups.
std::string j1939_text() {
  std::string text = command_text(kRateCommands, std::string(kStateBroadcast) + knuckle::test::kGroups);
  text = with(with(text, "id = 0x18FF1021", "pgn = 0xFF10\nsource = 0x21"), "id = 0x18FF4021", "pgn = 0xFF40");
  return knuckle::test::with_address(text, "0x05");
}
constexpr Words kSent{.first = "send", .dead_bands = false};

TEST(CommissionJ1939, AMachineLedFromAnAddressAndByGroups) {
  const std::string truth = j1939_text();
  const MachineDescription back = expect_found(truth, with(truth, "zero_rad = 0.12", "zero_rad = 0.42"), kSent);
  EXPECT_EQ(back.bus.commands_guard, (GuardProof{true, 0, "2026-03-01"}));
  expect_wrong_sign(truth, with(truth, "unit = \"rad\", sign = -1", "unit = \"rad\""), kSent,
                    "change 'sign' of boom_angle");
}

TEST(CommissionJ1939, CommandsWaitUntilTheAddressIsHeld) {
  const MachineDescription machine = machine_of(j1939_text());
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
  const std::string text = with(j1939_text(), "\nsource = 0x21", "");
  const MachineDescription machine = machine_of(text);
  for (const bool address : {true, false}) {
    bool moved = false;
    const Outcome outcome = commission(machine, machine, answers(kSent), [&](sim::MachineOnBus& b) {
      const bool moves = b.machine().nodes().outputs().spool_demand != JointVector::Zero();
      if (!moves || std::exchange(moved, true)) return;
      CanFrame other{.id = 0x18FF1077U | kExtendedId, .size = 8, .data = {0xB4, 0x5F, 0x02, 0x53, 0xEE, 0x18}};
      b.nodes_end().shout(address ? j1939::claim_frame(1, 0x05) : other);
    });
    EXPECT_TRUE(moved) << outcome.told;
    EXPECT_NE(outcome.ended.find(address ? "J1939 address" : "two devices send"), std::string::npos) << outcome.ended;
    EXPECT_TRUE(outcome.left_neutral);
  }
}

// ---- A module

/// The shipped inputs over a whole turn: the stops lie beyond the working range.
std::string module_text(const char* outputs = knuckle::test::kVoltageOutputs) {
  std::string text = knuckle::test::module_text(outputs);
  text = with(text, "low = -0.6, high = 1.2,", "low = -1.6, high = 2.4,");
  text = with(text, "low = -20, high = -160,", "low = 20, high = -200,");
  return with(text, "low = -2.7, high = 0.9,", "low = -3.1, high = 1.9,");
}
const NodeDescription& module_in(const MachineDescription& machine) {
  return *machine.bus.find("module");
}

TEST(CommissionModule, ZerosDeadBandsAndWhatItsOutputsDoWhenItIsLeftAlone) {
  for (const char* outputs : {knuckle::test::kVoltageOutputs, knuckle::test::kCurrentOutputs}) {
    const std::string truth = module_text(outputs);
    std::string file = with(truth, "low = -1.6, high = 2.4,", "low = -1.3, high = 2.7,");
    file = with(file, "low = 20, high = -200,", "low = 30, high = -190,");
    const MachineDescription back = expect_found(truth, file, {});
    EXPECT_TRUE(module_in(back).guard.proved);
    EXPECT_EQ(module_in(back).guard.changed, GuardProof::Changed::kNothing);
    const AnalogSensor& arm = *back.bus.broadcast(NodeRole::kEncoder, kArm).field->analog;
    EXPECT_NEAR(arm.low, 20 * kDegree, kZeroError_rad);
    EXPECT_NEAR(arm.high, -200 * kDegree, kZeroError_rad);
  }
}

/// Or a wire would be called broken that is not.
TEST(CommissionModule, AMovedZeroMovesTheSensorsRangeWithIt) {
  PerJoint<AxisResult> axes;
  axes[kArm].zero_shift = 0.5;
  const MachineDescription moved = with_zeros(machine_of(module_text()), axes);
  const BroadcastField& arm = *moved.bus.broadcast(NodeRole::kEncoder, kArm).field;
  EXPECT_NEAR(arm.analog->low, 20 * kDegree + 0.5, 1e-9);
  EXPECT_NEAR(arm.analog->high, -200 * kDegree + 0.5, 1e-9);
  EXPECT_NEAR(value_of(arm.bits, 3276), arm.analog->low, 1e-9);
}

TEST(CommissionModule, AnAngleThatCountsTheOtherWayIsFoundAndSaidWhatToExchange) {
  const std::string truth = module_text();
  expect_wrong_sign(truth, with(truth, "low = -1.6, high = 2.4,", "low = 2.4, high = -1.6,"), {},
                    "exchange 'low' and 'high' of boom_angle");
}

TEST(CommissionModule, AGuardThatIsTakenAndDoesNothingEndsIt) {
  const MachineDescription machine = machine_of(module_text());
  const Outcome outcome = commission(machine, machine, answers({}), [&](sim::MachineOnBus& b) {
    b.machine().inject(module_in(machine).id, sim::NodeFault::kDeadGuard);
  });
  EXPECT_EQ(outcome.ended.rfind("module, boom: guard not proved: without set-points it told nothing, and its cylinder "
                                "goes on moving",
                                0),
            0U)
      << outcome.ended << outcome.told;
  EXPECT_TRUE(outcome.left_neutral);
}

/// Where the file says what else stops it, it is written down as not proved.
TEST(CommissionModule, AGuardThatDoesNothingIsNotRecordedAsProved) {
  const std::string text = with(module_text(), "error_value_shift", "unguarded = \"a relay\"\nerror_value_shift");
  const MachineDescription machine = machine_of(text);
  const Outcome outcome = commission(machine, machine, answers({}), [&](sim::MachineOnBus& b) {
    b.machine().inject(module_in(machine).id, sim::NodeFault::kDeadGuard);
  });
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  const MachineDescription back = machine_of(commissioned_text(text, machine, outcome.result, kOrigin));
  EXPECT_FALSE(module_in(back).guard.proved);
  EXPECT_EQ(module_in(back).guard.date, "2026-03-01");
  const auto notes = machine_notes(back);
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
    return note.find("the outputs of module take their error values") != std::string::npos;
  }));
}

/// What is said before the trials in motion.
std::string motions(const std::string& text) {
  return GuardTrials::motions_text(machine_of(text).bus);
}
std::string with_constants(std::string text) {
  return text.insert(text.find("\n[limits]"), knuckle::test::kConstants);
}
bool tells_of_own_controller(const std::string& said) {
  return said.find("own controller") != std::string::npos;
}

TEST(CommissionModule, AnOwnControllerThatMovesNothingIsNeitherTriedNorCalledProved) {
  const std::string text = with_constants(module_text());
  EXPECT_FALSE(tells_of_own_controller(motions(text))) << motions(text);
  const MachineDescription machine = machine_of(text);
  const Outcome outcome = commission(machine, machine, answers({}));
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  for (const GuardResult& guard : outcome.result.guards) EXPECT_NE(guard.seen, "") << guard.node << " was not tried";
  const MachineDescription back = machine_of(commissioned_text(text, machine, outcome.result, kOrigin));
  EXPECT_EQ(back.bus.commands_guard, GuardProof());
  EXPECT_TRUE(module_in(back).guard.proved);
  for (const std::string& note : machine_notes(back)) EXPECT_EQ(note.find("is not proved"), std::string::npos) << note;
}

TEST(CommissionModule, ASecondOneThatMovesNothingIsNeitherTriedNorCalledProved) {
  const std::string text = with(module_text(), "[[bus.node]]\nname = \"module\"",
                                std::string(knuckle::test::kSpareModule) + "[[bus.node]]\nname = \"module\"");
  const MachineDescription machine = machine_of(text);
  const Outcome outcome = commission(machine, machine, answers({}));
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  for (const GuardResult& guard : outcome.result.guards) EXPECT_NE(guard.seen, "") << guard.node << " was not tried";
  const MachineDescription back = machine_of(commissioned_text(text, machine, outcome.result, kOrigin));
  EXPECT_EQ(back.bus.find("spare")->guard, GuardProof());
  EXPECT_TRUE(module_in(back).guard.proved);
  for (const std::string& note : machine_notes(back)) EXPECT_EQ(note.find("is not proved"), std::string::npos) << note;
}

TEST(CommissionModule, WhatIsTriedInMotionIsSaidOfWhatMovesAJoint) {
  const std::string modules = motions(module_text()), own = motions(command_text());
  EXPECT_NE(modules.find("; then its module hears nothing more of what it waits for, and must stop it. An error"),
            std::string::npos)
      << modules;
  EXPECT_TRUE(own.ends_with("; then no more commands are sent, and the machine's own controller must stop it.")) << own;
  const std::string arm = "2 = { joint = \"arm\", unit = \"V\", scale = 0.001, neutral = 6, extend = 9, retract = 3 }";
  std::string both = with(module_text(), arm, "2 = { scale = 0.001, neutral = 6 }");
  both.insert(both.find("\n[limits]"),
              "\n[[bus.command]]\nname = \"arm\"\nid = 0x18FF0105\nbytes = 2\nperiod_ms = 10\nsend = \"always\"\n"
              "[bus.command.fields]\narm = { start = 0, bits = 16, scale = 0.001, unit = \"V\", joint = \"arm\", "
              "neutral = 6, extend = 9, retract = 3 }\n");
  EXPECT_NE(motions(both).find("own controller must stop it. Then a module hears nothing more of what it waits for: it "
                               "must stop its cylinder. An error"),
            std::string::npos)
      << motions(both);
}

TEST(CommissionModule, WithoutRpdoTimersItsHeartbeatIsWithheldAndTheEnableNodeWaits) {
  const MachineDescription machine = machine_of(module_text());
  const Outcome outcome = commission(machine, machine, answers({}), [&](sim::MachineOnBus& b) {
    for (std::uint16_t pdo = 0x1401; pdo <= 0x1403; ++pdo)
      b.machine().nodes().node(module_in(machine).id)->remove({pdo, 5});
  });
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_NE(outcome.told.find("module, boom: guard proved: without a heartbeat it told error 0x8130"),
            std::string::npos)
      << outcome.told;
  EXPECT_TRUE(healthy(outcome.result.findings)) << outcome.told;
}

TEST(CommissionModule, AProofHoldsOfTheseOutputsAndTimesAlone) {
  const std::string text = module_text();
  const MachineDescription machine = machine_of(text);
  WizardResult result;
  result.guards.push_back(
      {"module", 0x4B4E, 0x0411, 7, true, "seen", told_channels_text(module_in(machine), machine.bus)});
  const std::string found = commissioned_text(text, machine, result, kOrigin);
  const auto changed = [&](const std::string& from, const std::string& to) {
    return module_in(machine_of(with(found, from, to))).guard.changed;
  };
  EXPECT_EQ(changed("", ""), GuardProof::Changed::kNothing);
  EXPECT_EQ(changed("neutral = 6, extend = 9", "neutral = 6, extend = 8"), GuardProof::Changed::kChannels);
  EXPECT_EQ(changed("error_value_shift = 16", "error_value_shift = 0"), GuardProof::Changed::kChannels);
  EXPECT_EQ(changed("valve_watchdog_ms = 50 ", "valve_watchdog_ms = 60 "), GuardProof::Changed::kTimes);
  EXPECT_EQ(changed("product = 0x0411", "product = 0x0412"), GuardProof::Changed::kDevice);
}

TEST(CommissionModule, AnInputThatIsNotOnOneLineIsRefusedBeforeAnythingMoves) {
  const std::string text =
      with(module_text(),
           "8 = { signal = \"boom_angle\", range = \"0.5-4.5V\", counts_low = 3276, counts_high = 29490, low = -1.6, "
           "high = 2.4, unit = \"rad\" }",
           "8.signal = \"boom_angle\"\n8.range = \"0.5-4.5V\"\n8.counts_low = 3276\n8.counts_high = 29490\n8.low = "
           "-1.6\n8.high = 2.4\n8.unit = \"rad\"");
  const MachineDescription machine = machine_of(text);
  const std::string line = knuckle::test::refusal([&] { check_layout(text, machine); });
  EXPECT_NE(line.find("[bus.node.inputs] boom_angle: commissioning needs it on one line"), std::string::npos) << line;
}

// ---- A joint beyond its range

struct Recovered {
  std::string told, ended;
  double angle_rad = 0;
};
/// As if the machine stood 0.12 rad beyond the upper end of its boom's range.
Recovered recovered(const std::string& text, double& most_rad) {
  const MachineDescription truth = machine_of(text);
  MachineDescription file = truth;
  const double angle_rad = middle_of_range(truth)[kBoom];
  most_rad = file.links[kBoom].max_rad = angle_rad - 0.12;
  const auto bus = std::make_shared<sim::MachineOnBus>(sim::nominal_truth(truth), sim::WorldDescription{},
                                                       middle_of_range(truth), 1);
  BusAccess access = sim::access_to(bus);
  Script script{"ready", "go", "go", "go", "go", "go"};
  std::ostringstream out;
  const auto next = test::lines_of(script);
  Recovered made;
  try {
    recover(file, kBoom, access, terminal(out, next, false), [] {});
  } catch (const CommissionEnded& end) {
    made.ended = end.what();
  }
  made.told = out.str();
  made.angle_rad = bus->plant().joint_rad[kBoom];
  return made;
}

TEST(RecoverMachines, BringsAJointInWhateverItsBusIs) {
  for (const std::string& text : {knuckle::test::two_buses_text(), commands_on_second(), j1939_text(), module_text()}) {
    double most_rad = 0;
    const Recovered made = recovered(text, most_rad);
    EXPECT_EQ(made.ended, "") << made.told;
    EXPECT_LT(made.angle_rad, most_rad) << made.told;
    EXPECT_GT(made.angle_rad, most_rad - 0.3);
    EXPECT_NE(made.told.find("Out of service: "), std::string::npos);
    EXPECT_EQ(made.told.find("not confirmed"), std::string::npos) << made.told;
  }
}

}  // namespace
}  // namespace knuckle::bringup
