// The commissioning of the simulated machine by a script, and by people who do something else than they were asked.
#include "app/bringup/commission_wizard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "tests/bringup/commissioned.h"
#include "tests/bringup/surveyed.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/rotary_machine.h"
#include "tests/support/says.h"
#include "tests/support/two_cylinders.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
using test::all;
using test::answers;
using test::commission;
using test::first_words;
using test::kSigned;
using test::kStroked;
using test::Outcome;
using test::Script;
using test::simulated_bus;
using test::solar;
using test::start;

TEST(CommissionWizard, FindsZeroAndDeadBandsOfADrawnMachineAndPresetsItsEncoders) {
  const auto bus = simulated_bus(solar(), 7);
  const sim::MachineTruth& truth = bus->machine().plant().truth();
  const Outcome outcome = commission(bus, all());
  ASSERT_TRUE(well(outcome));
  EXPECT_FALSE(says(outcome.told, "emergency"));
  EXPECT_TRUE(outcome.left_neutral);
  bus->advance(bus->now() + 50ms);
  for (std::size_t j = 0; j < kJoints; ++j) {
    const AxisResult& axis = outcome.result.axes[j];
    ASSERT_TRUE(axis.offset_m && axis.dead_band_extend && axis.dead_band_retract) << j;
    EXPECT_TRUE(axis.preset);
    const ValveDescription& valve = truth.machine.cylinders[j].valve;
    EXPECT_NEAR(*axis.dead_band_extend, valve.dead_band_extend, 0.015) << kJointNames[j];
    EXPECT_NEAR(*axis.dead_band_retract, valve.dead_band_retract, 0.015) << kJointNames[j];
    const auto steps = static_cast<std::int32_t>(
        bus->machine().nodes().node(solar().bus.encoder(j).id)->value(canopen::kEncoderPosition));
    const double shown_m = steps * solar().sensors.encoder_step_m;
    EXPECT_NEAR(shown_m, bus->plant().cylinder_m[static_cast<int>(j)], 3e-3) << kJointNames[j];
  }
}

TEST(CommissionWizard, OfAMachineWithoutOneCylindersTransmittersComesToItsEndAndTellsWhatItCouldNotCheck) {
  const MachineDescription machine = parse_machine(knuckle::test::without_transmitters("boom"), "m.toml");
  const auto bus = simulated_bus(machine, 7);
  const Outcome outcome = commission(bus, all(), machine);
  ASSERT_TRUE(well(outcome));
  EXPECT_TRUE(says(outcome.told, "pressures not measured, spool"));
  EXPECT_TRUE(says(outcome.told, "sides not checked: nobody measures its pressures"));
  const ValveDescription& valve = bus->machine().plant().truth().machine.cylinders[kBoom].valve;
  EXPECT_NEAR(outcome.result.axes[kBoom].dead_band_extend.value(), valve.dead_band_extend, 0.015);
}

TEST(CommissionWizard, ATapeThatPutsAStopBeyondTheCylinderIsRefused) {
  Script script = all();
  *std::find(script.begin(), script.end(), "tape") = "1000";  // within the cylinder's range, but not where it stands
  const Outcome outcome = commission(simulated_bus(), script);
  EXPECT_TRUE(says(outcome.ended, "1000"));
  EXPECT_FALSE(outcome.result.axes[kBoom].preset);
}

// Rotary encoders, whose angles say no length before they are preset.

constexpr test::Words kRotary{.angles = true};

MachineDescription rotary() {
  return parse_machine(knuckle::test::rotary_text(), "rotary.toml");
}
std::shared_ptr<sim::MachineOnBus> as_mounted(const MachineDescription& machine) {
  auto bus = simulated_bus(machine, 7);
  for (const std::uint8_t id : {std::uint8_t{0x30}, std::uint8_t{0x31}, std::uint8_t{0x32}})
    bus->machine().nodes().node(id)->replace({0x6509, 0}, 8000);  // as they came from the box
  return bus;
}

TEST(CommissionWizard, PresetsRotaryEncodersBeforeAnythingMovesAndComesToItsEnd) {
  const MachineDescription machine = rotary();
  const auto bus = as_mounted(machine);
  const Outcome outcome = commission(bus, answers(kRotary), machine);
  ASSERT_TRUE(well(outcome));
  EXPECT_TRUE(says(outcome.told, "no length"));
  bus->advance(bus->now() + 50ms);
  for (std::size_t j = 0; j < kJoints; ++j) {
    EXPECT_TRUE(outcome.result.axes[j].preset);
    EXPECT_TRUE(outcome.result.axes[j].stroke_m && outcome.result.axes[j].dead_band_extend) << j;
    const NodeDescription& node = machine.bus.encoder(j);
    const std::uint32_t steps = bus->machine().nodes().node(node.id)->value(canopen::kEncoderPosition);
    const double angle = node.rotary.zero_rad + node.rotary.sign * node.rotary.step_rad() * steps;
    const double error = std::remainder(angle - bus->plant().joint_rad[static_cast<int>(j)], 2 * std::numbers::pi);
    EXPECT_NEAR(error, 0, 0.03) << kJointNames[j];
  }
}

TEST(CommissionWizard, MovesNothingByAnAngleThatIsNoneOfTheJoints) {
  const auto bus = as_mounted(rotary());
  const Outcome outcome = commission(bus, answers({.zero = "keep", .angles = true}), rotary());
  EXPECT_TRUE(says(outcome.ended, "it must be preset"));
  EXPECT_FALSE(outcome.powered);
}

TEST(CommissionWizard, LeavesABusWithWhichADoctorFindsNothingWrong) {
  const auto bus = simulated_bus();
  const Outcome outcome = commission(bus, {"ready", "configure", "pressed", "released", "0", "no"});
  EXPECT_TRUE(says(outcome.told, "Out of service: valves disabled, pilot pressure off."));
  for (const Finding& one : test::look(bus).findings)
    EXPECT_EQ(one.level, Finding::Level::kOk) << one.about << ": " << one.text;
}

TEST(CommissionWizard, NothingMovesAndNothingIsPoweredBeforeItsWord) {
  const auto bus = simulated_bus();
  const Outcome outcome = commission(bus, first_words(5));  // all but those that enable motion
  EXPECT_EQ(outcome.ended, "the input has ended");
  EXPECT_FALSE(outcome.powered);
  EXPECT_LT(outcome.moved_m, 1e-3);
}

TEST(CommissionWizard, AnyOtherAnswerEndsItNeutralAndOnlyThatFar) {
  for (std::size_t wrong = 0; wrong < test::kStarted; ++wrong) {
    for (const char* typed : {"", "yes", "READY", "move "}) {
      Script script = first_words(wrong);
      script.push_back(typed);
      const Outcome outcome = commission(simulated_bus(), script);
      EXPECT_TRUE(says(outcome.ended, "'" + std::string(typed) + "' is no"));
      EXPECT_TRUE(outcome.left_neutral);
      if (wrong > 1) break;  // the later ones take longer
    }
  }
}

/// Up to the proof of the guards; then an answer that ends it.
Script up_to_guards() {
  Script script = start();
  script.back() = "no";
  return script;
}

TEST(CommissionGuards, AreProvedByWithholdingWhatTheyWaitFor) {
  const auto bus = simulated_bus();
  const Outcome outcome = commission(bus, up_to_guards());
  EXPECT_LT(outcome.moved_m, 1e-3) << "an opening inside the dead band";
  for (const char* node : {"boom_valve", "arm_valve", "bucket_valve", "enable"}) {
    EXPECT_TRUE(says(outcome.told, std::string(node) + ": guard proved: without "));
  }
  EXPECT_TRUE(says(outcome.told, "told error 0x8250 after "));
  EXPECT_TRUE(says(outcome.told, "that it also stops without a heartbeat was not tried"));
  EXPECT_TRUE(outcome.left_neutral);
}

TEST(CommissionGuards, OneThatIsAcceptedAndDeadEndsItWithWhatWasSeen) {
  for (const char* node : {"arm_valve", "enable"}) {
    const auto bus = simulated_bus();
    ASSERT_TRUE(bus->machine().inject(solar().bus.find(std::string(node))->id, sim::NodeFault::kDeadGuard));
    const Outcome outcome = commission(bus, all());
    EXPECT_EQ(outcome.ended.find(std::string(node) + ": guard not proved: "), 0u) << outcome.ended;
    EXPECT_LT(outcome.moved_m, 1e-3);
    EXPECT_TRUE(outcome.left_neutral);
  }
}

TEST(CommissionGuards, OfAValveThatWaitsForTheHeartbeatAloneIsTriedByWithholdingThat) {
  for (const bool dead : {false, true}) {
    const auto bus = simulated_bus();
    const std::uint8_t arm = solar().bus.valve(kArm).id;
    bus->machine().nodes().node(arm)->remove(canopen::kRpdo1Timer);
    ASSERT_TRUE(!dead || bus->machine().inject(arm, sim::NodeFault::kDeadGuard));
    const Outcome outcome = commission(bus, dead ? all() : up_to_guards());
    const std::string proved = "arm_valve: guard proved: without a heartbeat it told error 0x8130 after ";
    EXPECT_EQ(outcome.told.find(proved) == std::string::npos, dead) << outcome.told;
    const std::string open = "arm_valve: guard not proved: without a heartbeat it told error 0x8130";
    EXPECT_EQ(outcome.ended.find(open) == std::string::npos, !dead) << outcome.ended;
    EXPECT_EQ(outcome.told.find("enable: guard proved") == std::string::npos, dead) << outcome.told;
    EXPECT_LT(outcome.moved_m, 1e-3);
    EXPECT_TRUE(outcome.left_neutral);
  }
}

TEST(CommissionGuards, OfNodesThatGoPreOperationalOnACommunicationErrorAreProved) {
  const auto bus = simulated_bus();
  for (const NodeDescription& node : solar().bus.nodes)
    if (node.is_told()) bus->machine().nodes().node(node.id)->add(canopen::kErrorBehaviour, 1, sim::Access::kReadWrite);
  const Outcome outcome = commission(bus, up_to_guards());
  for (const char* node : {"boom_valve", "arm_valve", "bucket_valve", "enable"})
    EXPECT_TRUE(says(outcome.told, std::string(node) + ": guard proved: "));
  EXPECT_TRUE(says(outcome.told, "(asked by SDO"));
}

TEST(CommissionWizard, BusThatIsNotAsTheFileSaysIsLeftAlone) {
  const auto bus = simulated_bus();
  bus->machine().nodes().set_product(0x31, 0x999);
  const Outcome outcome = commission(bus, all());
  EXPECT_TRUE(says(outcome.ended, "nothing was configured or moved"));
  EXPECT_EQ(bus->machine().nodes().node(0x10)->value(canopen::kProducerHeartbeat), 0U);
}

TEST(CommissionWizard, AMachineThatAnotherControllerLeadsIsLeftAlone) {
  const auto bus = simulated_bus();
  bus->each_tick = [](sim::MachineOnBus& b) {
    if (b.now().time_since_epoch() % 50ms == 0ms) b.nodes_end().shout(canopen::sync_frame());
  };
  const Outcome outcome = commission(bus, all());
  EXPECT_EQ(outcome.ended, "another controller is on the bus: heard SYNC 0x080; nothing was configured or moved");
  EXPECT_EQ(bus->machine().nodes().node(0x10)->value(canopen::kProducerHeartbeat), 0U);
}

TEST(CommissionWizard, EStopThatIsNotWiredIsFoundBeforeAnythingMoves) {
  const Outcome outcome =
      commission(simulated_bus(), all(), solar(), [](BusAccess& access) { access.press_e_stop = [](bool) {}; });
  EXPECT_EQ(outcome.ended, "the E-stop was pressed, but the enable node reports its chain closed: check the input");
}

TEST(CommissionWizard, EStopDuringAMotionEndsIt) {
  const auto bus = simulated_bus();
  bool once = false;
  bus->each_tick = [&once](sim::MachineOnBus& b) {
    if (!once && std::abs(b.plant().cylinder_mps[kBoom]) > 0.002 && b.machine().nodes().outputs().pilot) {
      b.machine().set_estop(true);
      once = true;
    }
  };
  const Outcome outcome = commission(bus, first_words(test::kStarted + 1));
  EXPECT_TRUE(once);
  EXPECT_EQ(outcome.ended, "the E-stop chain is open: release the E-stop on the machine");
  EXPECT_TRUE(outcome.left_neutral);
}

/// By Ctrl+C, which is seen while something moves as at any other time.
TEST(CommissionWizard, InterruptedInAMotionItLeavesTheMachineNeutral) {
  const auto bus = simulated_bus();
  bool moved = false;
  const auto interrupt = [&] {
    moved = std::abs(bus->plant().cylinder_mps[kBoom]) > 0.002 && bus->machine().nodes().outputs().pilot;
    if (moved) throw cli::Interrupted();
  };
  const Outcome outcome = commission(bus, first_words(test::kStarted + 1), solar(), {}, {}, interrupt);
  EXPECT_TRUE(moved);
  EXPECT_TRUE(says(outcome.ended, "interrupted"));
  EXPECT_TRUE(outcome.left_neutral);
}

TEST(CommissionWizard, ExchangedEncodersOrPressureSidesAreFoundByMotion) {
  struct Case {
    NodeRole role;
    int one, other;
    const char* said;
  };
  for (const Case& c : {Case{NodeRole::kEncoder, kBoom, kArm, "the arm cylinder moved by "},
                        Case{NodeRole::kPressure, 2 * kBoom, 2 * kBoom + 1, "at the stop the pressure of boom rod"}}) {
    MachineDescription file = solar();
    std::swap(knuckle::test::node_in(file.bus, c.role, c.one).id, knuckle::test::node_in(file.bus, c.role, c.other).id);
    const Outcome outcome = commission(simulated_bus(), all(), file);
    EXPECT_TRUE(says(outcome.ended, c.said));
    EXPECT_TRUE(outcome.left_neutral);
  }
}

/// As if a run had ended after its strokes. No preset is known of it, or readings would tell by themselves.
WizardProgress up_to_strokes() {
  WizardProgress kept;
  kept.completed = kStrokes;
  return kept;
}

TEST(CommissionResume, GoesOnAfterTheLastCompletedStepAndComesToTheSameResult) {
  const auto bus = simulated_bus(solar(), 7);
  WizardProgress kept;
  const Outcome ended = commission(bus, first_words(kStroked + 1), solar(), {},
                                   {{}, [&kept](const WizardProgress& progress) { kept = progress; }});
  EXPECT_EQ(ended.ended, "the input has ended") << "in the first ramp";
  ASSERT_EQ(kept.completed, kStrokes);
  Script rest = first_words(kSigned);
  rest.insert(rest.end(), {"go", "go", "go", "finish"});
  const Outcome outcome = commission(bus, rest, solar(), {}, {kept, {}});
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_FALSE(says(outcome.told, "4. done before"));
  EXPECT_TRUE(says(outcome.told, "5. done before: skipped"));
  for (std::size_t j = 0; j < kJoints; ++j) {
    const AxisResult &axis = outcome.result.axes[j], &before = kept.axes[j];
    EXPECT_TRUE(axis.preset);
    EXPECT_TRUE(axis.stroke_m && axis.offset_m) << j;
    EXPECT_EQ(axis.stroke_m, before.stroke_m) << j;
    EXPECT_EQ(axis.offset_m, before.offset_m) << j;
    const ValveDescription& valve = bus->machine().plant().truth().machine.cylinders[j].valve;
    EXPECT_NEAR(*axis.dead_band_extend, valve.dead_band_extend, 0.015) << j;
  }
  const auto found = [&](const std::string& text) {
    const Findings& all_of = outcome.result.findings;
    return std::count_if(all_of.begin(), all_of.end(), [&](const Finding& one) { return bool(says(one.text, text)); });
  };
  EXPECT_EQ(found("encoder preset"), 3) << "of the run before";
  EXPECT_EQ(found("pressed and released"), 1) << "of this run alone";
}

TEST(CommissionResume, MovesNothingBeforeThisRunsOwnWords) {
  const Resume resume{up_to_strokes(), {}};
  const Outcome looked = commission(simulated_bus(), first_words(5), solar(), {}, resume);
  EXPECT_EQ(looked.ended, "the input has ended");
  EXPECT_FALSE(looked.powered) << "E-stop and slope, but no word that enables motion";
  const Outcome enabled = commission(simulated_bus(), start(), solar(), {}, resume);
  EXPECT_EQ(enabled.ended, "the input has ended");
  EXPECT_LT(enabled.moved_m, 1e-3) << "the first small motion needs its own word";
}

TEST(CommissionResume, ProvesTheSignsAgainBecauseTheRepairMayHaveExchangedThem) {
  MachineDescription repaired = solar();
  std::swap(knuckle::test::node_in(repaired.bus, NodeRole::kEncoder, kBoom).id,
            knuckle::test::node_in(repaired.bus, NodeRole::kEncoder, kArm).id);
  Script script = first_words(kSigned);
  script.insert(script.end(), {"go", "go", "go", "finish"});
  const Outcome outcome = commission(simulated_bus(), script, repaired, {}, {up_to_strokes(), {}});
  EXPECT_NE(outcome.ended, "");
  EXPECT_FALSE(says(outcome.told, "6. Dead bands"));
  EXPECT_TRUE(outcome.left_neutral);
}

TEST(CommissionResume, EndsBeforeAnythingIsConfiguredWhereANodeIsAnotherDevice) {
  WizardProgress kept = up_to_strokes();
  kept.serials[solar().bus.encoder(kArm).id] = 4711;  // the simulated ones have no serial number
  const Outcome outcome = commission(simulated_bus(), start(), solar(), {}, {kept, {}});
  EXPECT_TRUE(says(outcome.ended, "serial number none, in the run before 4711: another device"));
  EXPECT_FALSE(says(outcome.told, "2. Nodes"));
}

TEST(CommissionResume, StopsWhereAPresetOfTheRunBeforeIsLost) {
  const auto bus = simulated_bus();
  WizardProgress kept = up_to_strokes();
  for (AxisResult& axis : kept.axes) axis.preset = true;
  // An encoder that shows another length than any that its cylinder has.
  const auto lost = [](BusAccess& access) { access.tape_m = [](int) { return std::optional(5.0); }; };
  const Outcome outcome = commission(bus, start(), solar(), lost, {kept, {}});
  EXPECT_TRUE(says(outcome.ended, "the preset is lost; begin anew"));
  EXPECT_TRUE(outcome.left_neutral);
}

}  // namespace
}  // namespace knuckle::bringup
