// Commissioning of a machine whose pilot valves and sensors hang on a CiA 401 module: what its guard is worth.
#include <gtest/gtest.h>

#include <algorithm>

#include "app/bringup/commission_guards.h"
#include "app/bringup/commission_result.h"
#include "machine/reason_text.h"
#include "machine/room.h"
#include "tests/bringup/machine_kinds.h"
#include "tests/support/says.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using test::commission;
using test::machine_of;
using test::Outcome;
using test::voltages_text;
using test::with;

const ResultOrigin kOrigin{"can0", "2026-03-01", "x"};

const NodeDescription& module_in(const MachineDescription& machine) {
  return *machine.bus.find("module");
}

/// To its end, but no further than a guard's trial goes.
Outcome commissioned(const std::string& text, const std::function<void(sim::MachineOnBus&)>& meddle = {}) {
  constexpr test::Words kGuards{.zero = "correct", .angles = true, .guards_first = false, .far = false};
  return commission(machine_of(text), machine_of(text), test::answers(kGuards), meddle);
}
/// Takes its guard, which does nothing.
void kill_guard(sim::MachineOnBus& b) {
  b.machine().inject(0x41, sim::NodeFault::kDeadGuard);
}

/// Or a wire would be called broken that is not.
TEST(CommissionModule, AMovedZeroMovesTheSensorsRangeWithIt) {
  PerJoint<AxisResult> axes;
  axes[kArm].zero_shift = 0.5;
  const MachineDescription moved = with_zeros(machine_of(voltages_text()), axes);
  const BroadcastField& arm = *moved.bus.broadcast(NodeRole::kEncoder, kArm).field;
  EXPECT_NEAR(arm.analog->low, 20 * kDegree + 0.5, 1e-9);
  EXPECT_NEAR(arm.analog->high, -200 * kDegree + 0.5, 1e-9);
  EXPECT_NEAR(value_of(arm.bits, 3276), arm.analog->low, 1e-9);
}

TEST(CommissionModule, AGuardThatIsTakenAndDoesNothingEndsIt) {
  const Outcome outcome = commissioned(voltages_text(), kill_guard);
  EXPECT_EQ(outcome.ended.rfind("module, boom: guard not proved: without set-points it told nothing, and its cylinder "
                                "goes on moving",
                                0),
            0U)
      << outcome.ended << outcome.told;
  EXPECT_TRUE(outcome.left_neutral);
}

/// Where the file says what else stops it, it is written down as not proved.
TEST(CommissionModule, AGuardThatDoesNothingIsNotRecordedAsProved) {
  const std::string text = with(voltages_text(), "error_value_shift", "unguarded = \"a relay\"\nerror_value_shift");
  const Outcome outcome = commissioned(text, kill_guard);
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  const MachineDescription back = machine_of(commissioned_text(text, machine_of(text), outcome.result, kOrigin));
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

TEST(CommissionModule, WhatMovesNothingIsNeitherTriedNorCalledProved) {
  std::string own_controller = voltages_text();
  own_controller.insert(own_controller.find("\n[limits]"), knuckle::test::kConstants);
  EXPECT_FALSE(says(motions(own_controller), "own controller"));
  const std::string second_module = with(voltages_text(), "[[bus.node]]\nname = \"module\"",
                                         std::string(knuckle::test::kSpareModule) + "[[bus.node]]\nname = \"module\"");
  for (const std::string& text : {own_controller, second_module}) {
    const Outcome outcome = commissioned(text);
    ASSERT_EQ(outcome.ended, "") << outcome.told;
    for (const GuardResult& guard : outcome.result.guards) EXPECT_NE(guard.seen, "") << guard.node << " was not tried";
    const MachineDescription back = machine_of(commissioned_text(text, machine_of(text), outcome.result, kOrigin));
    EXPECT_EQ(back.bus.commands_guard, GuardProof());
    const NodeDescription* const spare = back.bus.find("spare");
    EXPECT_TRUE(spare == nullptr || spare->guard == GuardProof());
    EXPECT_TRUE(module_in(back).guard.proved);
    for (const std::string& note : machine_notes(back)) EXPECT_FALSE(says(note, "is not proved"));
  }
}

TEST(CommissionModule, WhatIsTriedInMotionIsSaidOfWhatMovesAJoint) {
  const std::string own = motions(test::speeds_text());
  EXPECT_TRUE(says(motions(voltages_text()),
                   "; then its module hears nothing more of what it waits for, and must stop it. An error"));
  EXPECT_TRUE(own.ends_with("; then no more commands are sent, and the machine's own controller must stop it.")) << own;
  const std::string arm = "2 = { joint = \"arm\", unit = \"V\", scale = 0.001, neutral = 6, extend = 9, retract = 3 }";
  std::string both = with(voltages_text(), arm, "2 = { scale = 0.001, neutral = 6 }");
  both.insert(both.find("\n[limits]"),
              "\n[[bus.command]]\nname = \"arm\"\nid = 0x18FF0105\nbytes = 2\nperiod_ms = 10\nsend = \"always\"\n"
              "[bus.command.fields]\narm = { start = 0, bits = 16, scale = 0.001, unit = \"V\", joint = \"arm\", "
              "neutral = 6, extend = 9, retract = 3 }\n");
  EXPECT_TRUE(says(motions(both),
                   "own controller must stop it. Then a module hears nothing more of what it waits for: it must stop "
                   "its cylinder. An error"));
}

TEST(CommissionModule, WithoutRpdoTimersItsHeartbeatIsWithheldAndTheEnableNodeWaits) {
  const Outcome outcome = commissioned(voltages_text(), [](sim::MachineOnBus& b) {
    for (std::uint16_t pdo = 0x1401; pdo <= 0x1403; ++pdo) b.machine().nodes().node(0x41)->remove({pdo, 5});
  });
  ASSERT_TRUE(well(outcome));
  EXPECT_TRUE(says(outcome.told, "module, boom: guard proved: without a heartbeat it told error 0x8130"));
}

TEST(CommissionModule, AProofHoldsOfTheseOutputsAndTimesAlone) {
  const std::string text = voltages_text();
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

}  // namespace
}  // namespace knuckle::bringup
