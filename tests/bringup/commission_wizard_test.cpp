// The commissioning of the simulated machine by a script, and by people who do something else than they were asked.
#include "app/bringup/commission_wizard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <numbers>
#include <sstream>

#include "app/cli/interrupt.h"
#include "machine/load.h"
#include "tests/bringup/commission_script.h"
#include "tests/bringup/hardware_bench.h"
#include "tests/support/bus_nodes.h"
#include "tests/support/rotary_machine.h"
#include "tests/support/two_cylinders.h"

namespace knuckle::bringup {
namespace {

using test::all;
using test::kSigned;
using test::kStroked;
using test::Script;
using test::simulated_bus;
using test::solar;
using test::start;

/// What came of it, and where the machine stood then.
struct WizardRun {
  std::string ended;  ///< Empty where it came to its end.
  WizardResult result;
  std::string told;
  bool pilot = false;
  JointVector demand = JointVector::Zero();
};

WizardRun commission(const std::shared_ptr<sim::MachineOnBus>& bus, Script script,
                     const MachineDescription& file = solar(), const std::function<void(BusAccess&)>& change = {},
                     const Resume& resume = {}) {
  BusAccess access = sim::access_to(bus);
  if (change) change(access);
  const auto next = test::lines_of(script);
  std::ostringstream told;
  WizardRun outcome;
  const auto record = [](const MachineDescription&, const std::function<bool()>&) {
    return std::vector<std::string>();
  };
  try {
    outcome.result = run_wizard(
        file, access, terminal(told, next, false), record, [] {}, resume);
  } catch (const CommissionEnded& ended) {
    outcome.ended = ended.what();
  }
  outcome.told = told.str();
  const sim::NodeOutputs outputs = bus->machine().nodes().outputs();
  outcome.pilot = outputs.pilot;
  outcome.demand = outputs.spool_demand;
  return outcome;
}

/// From now on, whether the machine is ever powered, and how far a cylinder moves.
struct MotionWatch {
  explicit MotionWatch(sim::MachineOnBus& bus) {
    bus.each_tick = [this, before = JointVector(bus.plant().cylinder_m)](sim::MachineOnBus& b) {
      powered = powered || b.machine().nodes().outputs().pilot;
      moved_m = std::max(moved_m, (b.plant().cylinder_m - before).cwiseAbs().maxCoeff());
    };
  }
  MotionWatch(const MotionWatch&) = delete;
  MotionWatch& operator=(const MotionWatch&) = delete;

  bool powered = false;
  double moved_m = 0;
};

TEST(CommissionWizard, FindsZeroAndDeadBandsOfADrawnMachineAndPresetsItsEncoders) {
  const auto bus = simulated_bus(solar(), 7);
  const sim::MachineTruth& truth = bus->machine().plant().truth();
  const WizardRun outcome = commission(bus, all());
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_TRUE(healthy(outcome.result.findings));
  EXPECT_FALSE(outcome.pilot);
  EXPECT_EQ(outcome.demand, JointVector::Zero());
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
  const WizardRun outcome = commission(bus, all(), machine);
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_TRUE(healthy(outcome.result.findings));
  EXPECT_NE(outcome.told.find("pressures not measured, spool"), std::string::npos) << outcome.told;
  EXPECT_NE(outcome.told.find("sides not checked: nobody measures its pressures"), std::string::npos);
  const ValveDescription& valve = bus->machine().plant().truth().machine.cylinders[kBoom].valve;
  EXPECT_NEAR(outcome.result.axes[kBoom].dead_band_extend.value(), valve.dead_band_extend, 0.015);
}

TEST(CommissionWizard, ATapeThatPutsAStopBeyondTheCylinderIsRefused) {
  Script script = all();
  *std::find(script.begin(), script.end(), "tape") = "1000";  // within the cylinder's range, but not where it stands
  const WizardRun outcome = commission(simulated_bus(), script);
  EXPECT_NE(outcome.ended.find("1000"), std::string::npos) << outcome.ended;
  EXPECT_FALSE(outcome.result.axes[kBoom].preset);
}

// Rotary encoders, whose angles say no length before they are preset.

MachineDescription rotary() {
  return parse_machine(knuckle::test::rotary_text(), "rotary.toml");
}
Script all_of_rotary() {
  Script script = start();
  const Script zeros{"tape", "preset", "tape", "preset", "tape", "preset"};
  script.insert(script.begin() + 5, zeros.begin(), zeros.end());
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "longer", "go", "shorter"});
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "go", "go"});
  script.insert(script.end(), {"go", "go", "go", "finish"});
  return script;
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
  const WizardRun outcome = commission(bus, all_of_rotary(), machine);
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_TRUE(healthy(outcome.result.findings));
  EXPECT_NE(outcome.told.find("no length"), std::string::npos) << outcome.told;
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

TEST(CommissionWizard, FindsARotaryEncoderThatCountsTheOtherWay) {
  MachineDescription file = rotary();
  const auto bus = as_mounted(file);
  RotaryDescription& arm = knuckle::test::node_in(file.bus, NodeRole::kEncoder, kArm).rotary;
  arm.sign = -arm.sign;
  const WizardRun outcome = commission(bus, all_of_rotary(), file);
  EXPECT_NE(outcome.ended.find("arm: its encoder counts in the wrong direction"), std::string::npos) << outcome.ended;
  EXPECT_FALSE(outcome.pilot);
}

TEST(CommissionWizard, MovesNothingByAnAngleThatIsNoneOfTheJoints) {
  const auto bus = as_mounted(rotary());
  const MotionWatch watch(*bus);
  Script script = start();
  script.resize(5);
  for (const char* word : {"tape", "keep", "tape", "keep", "tape", "keep"}) script.emplace_back(word);
  const WizardRun outcome = commission(bus, script, rotary());
  EXPECT_NE(outcome.ended.find("it must be preset"), std::string::npos) << outcome.ended;
  EXPECT_FALSE(watch.powered);
}

TEST(CommissionWizard, LeavesABusWithWhichADoctorFindsNothingWrong) {
  const auto bus = simulated_bus();
  const WizardRun outcome = commission(bus, {"ready", "configure", "pressed", "released", "0", "no"});
  EXPECT_NE(outcome.told.find("Out of service: valves disabled, pilot pressure off."), std::string::npos);
  BusAccess access = sim::access_to(bus);
  const BusSurvey survey = survey_bus(access, solar().bus.bit_rate, doctor_objects(solar()), {}, [] {});
  for (const Finding& one : diagnose(survey, &solar()).findings)
    EXPECT_EQ(one.level, Finding::Level::kOk) << one.about << ": " << one.text;
}

TEST(CommissionWizard, NothingMovesAndNothingIsPoweredBeforeItsWord) {
  const auto bus = simulated_bus();
  const MotionWatch watch(*bus);
  Script script = start();
  script.erase(script.begin() + 5, script.end());  // all but the two words that enable motion
  EXPECT_EQ(commission(bus, script).ended, "the input has ended");
  EXPECT_FALSE(watch.powered);
  EXPECT_LT(watch.moved_m, 1e-3);
}

TEST(CommissionWizard, AnyOtherAnswerEndsItNeutralAndOnlyThatFar) {
  const Script words = start();
  for (std::size_t wrong = 0; wrong < words.size(); ++wrong) {
    for (const char* typed : {"", "yes", "READY", "move "}) {
      Script script(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(wrong));
      script.push_back(typed);
      const WizardRun outcome = commission(simulated_bus(), script);
      EXPECT_NE(outcome.ended.find("'" + std::string(typed) + "' is no"), std::string::npos) << outcome.ended;
      EXPECT_FALSE(outcome.pilot);
      EXPECT_EQ(outcome.demand, JointVector::Zero());
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
  const MotionWatch watch(*bus);
  const WizardRun outcome = commission(bus, up_to_guards());
  EXPECT_LT(watch.moved_m, 1e-3) << "an opening inside the dead band";
  for (const char* node : {"boom_valve", "arm_valve", "bucket_valve", "enable"}) {
    EXPECT_NE(outcome.told.find(std::string(node) + ": guard proved: without "), std::string::npos) << outcome.told;
  }
  EXPECT_NE(outcome.told.find("told error 0x8250 after "), std::string::npos) << outcome.told;
  EXPECT_NE(outcome.told.find("that it also stops without a heartbeat was not tried"), std::string::npos);
  EXPECT_FALSE(outcome.pilot);
}

TEST(CommissionGuards, OneThatIsAcceptedAndDeadEndsItWithWhatWasSeen) {
  for (const char* node : {"arm_valve", "enable"}) {
    const auto bus = simulated_bus();
    const MotionWatch watch(*bus);
    ASSERT_TRUE(bus->machine().inject(solar().bus.find(std::string(node))->id, sim::NodeFault::kDeadGuard));
    const WizardRun outcome = commission(bus, all());
    EXPECT_EQ(outcome.ended.find(std::string(node) + ": guard not proved: "), 0u) << outcome.ended;
    EXPECT_LT(watch.moved_m, 1e-3);
    EXPECT_FALSE(outcome.pilot);
    EXPECT_EQ(outcome.demand, JointVector::Zero());
  }
}

TEST(CommissionGuards, OfAValveThatWaitsForTheHeartbeatAloneIsTriedByWithholdingThat) {
  for (const bool dead : {false, true}) {
    const auto bus = simulated_bus();
    const MotionWatch watch(*bus);
    const std::uint8_t arm = solar().bus.valve(kArm).id;
    bus->machine().nodes().node(arm)->remove(canopen::kRpdo1Timer);
    ASSERT_TRUE(!dead || bus->machine().inject(arm, sim::NodeFault::kDeadGuard));
    const WizardRun outcome = commission(bus, dead ? all() : up_to_guards());
    const std::string proved = "arm_valve: guard proved: without a heartbeat it told error 0x8130 after ";
    EXPECT_EQ(outcome.told.find(proved) == std::string::npos, dead) << outcome.told;
    const std::string open = "arm_valve: guard not proved: without a heartbeat it told error 0x8130";
    EXPECT_EQ(outcome.ended.find(open) == std::string::npos, !dead) << outcome.ended;
    EXPECT_EQ(outcome.told.find("enable: guard proved") == std::string::npos, dead) << outcome.told;
    EXPECT_LT(watch.moved_m, 1e-3);
    EXPECT_FALSE(outcome.pilot);
    EXPECT_EQ(outcome.demand, JointVector::Zero());
  }
}

TEST(CommissionGuards, OfNodesThatGoPreOperationalOnACommunicationErrorAreProved) {
  const auto bus = simulated_bus();
  for (const NodeDescription& node : solar().bus.nodes)
    if (node.is_told()) bus->machine().nodes().node(node.id)->add(canopen::kErrorBehaviour, 1, sim::Access::kReadWrite);
  const WizardRun outcome = commission(bus, up_to_guards());
  for (const char* node : {"boom_valve", "arm_valve", "bucket_valve", "enable"})
    EXPECT_NE(outcome.told.find(std::string(node) + ": guard proved: "), std::string::npos) << outcome.told;
  EXPECT_NE(outcome.told.find("(asked by SDO"), std::string::npos) << outcome.told;
}

TEST(CommissionGuards, OneThatTheFileDoesWithoutIsANote) {
  MachineDescription file = solar();
  for (NodeDescription& node : file.bus.nodes)
    if (node.name == "arm_valve") node.unguarded = "a relay takes its power away";
  const auto bus = simulated_bus();
  ASSERT_TRUE(bus->machine().inject(solar().bus.valve(kArm).id, sim::NodeFault::kDeadGuard));
  const WizardRun outcome = commission(bus, up_to_guards(), file);
  EXPECT_NE(outcome.told.find("note  arm_valve: guard not proved: without set-points it told nothing, and its spool "
                              "stayed open"),
            std::string::npos)
      << outcome.told;
  EXPECT_NE(outcome.told.find("bucket_valve: guard proved"), std::string::npos) << outcome.told;
}

TEST(CommissionWizard, BusThatIsNotAsTheFileSaysIsLeftAlone) {
  const auto bus = simulated_bus();
  bus->machine().nodes().set_product(0x31, 0x999);
  const WizardRun outcome = commission(bus, all());
  EXPECT_NE(outcome.ended.find("nothing was configured or moved"), std::string::npos) << outcome.ended;
  EXPECT_EQ(bus->machine().nodes().node(0x10)->value(canopen::kProducerHeartbeat), 0U);
}

TEST(CommissionWizard, AMachineThatAnotherControllerLeadsIsLeftAlone) {
  const auto bus = simulated_bus();
  bus->each_tick = [](sim::MachineOnBus& b) {
    if (b.now().time_since_epoch() % 50ms == 0ms) b.nodes_end().shout(canopen::sync_frame());
  };
  const WizardRun outcome = commission(bus, all());
  EXPECT_EQ(outcome.ended, "another controller is on the bus: heard SYNC 0x080; nothing was configured or moved");
  EXPECT_EQ(bus->machine().nodes().node(0x10)->value(canopen::kProducerHeartbeat), 0U);
}

TEST(CommissionWizard, EStopThatIsNotWiredIsFoundBeforeAnythingMoves) {
  const WizardRun outcome =
      commission(simulated_bus(), all(), solar(), [](BusAccess& access) { access.press_e_stop = [](bool) {}; });
  EXPECT_EQ(outcome.ended, "the E-stop was pressed, but the enable node reports its chain closed: check the input");
}

TEST(CommissionWizard, EStopDuringAMotionEndsIt) {
  const auto bus = simulated_bus();
  Script script = start();
  script.push_back("go");
  bool once = false;
  bus->each_tick = [&once](sim::MachineOnBus& b) {
    if (!once && std::abs(b.plant().cylinder_mps[kBoom]) > 0.002 && b.machine().nodes().outputs().pilot) {
      b.machine().set_estop(true);
      once = true;
    }
  };
  const WizardRun outcome = commission(bus, script);
  EXPECT_TRUE(once);
  EXPECT_EQ(outcome.ended, "the E-stop chain is open: release the E-stop on the machine");
  EXPECT_FALSE(outcome.pilot);
  EXPECT_EQ(outcome.demand, JointVector::Zero());
}

/// By Ctrl+C, which is seen while something moves as at any other time.
TEST(CommissionWizard, InterruptedInAMotionItLeavesTheMachineNeutral) {
  const auto bus = simulated_bus();
  Script script = start();
  script.push_back("go");
  const auto next = [&script]() -> std::optional<std::string> {
    if (script.empty()) return std::nullopt;
    std::string line = script.front();
    script.pop_front();
    return line;
  };
  bool moved = false;
  const auto interrupt = [&] {
    moved = std::abs(bus->plant().cylinder_mps[kBoom]) > 0.002 && bus->machine().nodes().outputs().pilot;
    if (moved) throw cli::Interrupted();
  };
  std::ostringstream told;
  BusAccess access = sim::access_to(bus);
  EXPECT_THROW((void)run_wizard(
                   solar(), access, terminal(told, next, false),
                   [](const MachineDescription&, const std::function<bool()>&) { return std::vector<std::string>(); },
                   interrupt),
               cli::Interrupted);
  EXPECT_TRUE(moved);
  EXPECT_FALSE(bus->machine().nodes().outputs().pilot);
  EXPECT_EQ(bus->machine().nodes().outputs().spool_demand, JointVector::Zero());
}

TEST(CommissionWizard, ExchangedEncodersAreFoundByTheFirstMotion) {
  MachineDescription file = solar();
  std::swap(knuckle::test::node_in(file.bus, NodeRole::kEncoder, kBoom).id,
            knuckle::test::node_in(file.bus, NodeRole::kEncoder, kArm).id);
  Script script = start();
  script.insert(script.end(), {"go", "longer"});
  const WizardRun outcome = commission(simulated_bus(), script, file);
  EXPECT_NE(outcome.ended.find("the arm cylinder moved by "), std::string::npos) << outcome.ended;
}

TEST(CommissionWizard, ExchangedPressureSidesAreFoundAtTheStop) {
  MachineDescription file = solar();
  std::swap(knuckle::test::node_in(file.bus, NodeRole::kPressure, 2 * kBoom).id,
            knuckle::test::node_in(file.bus, NodeRole::kPressure, 2 * kBoom + 1).id);
  const WizardRun outcome = commission(simulated_bus(), all(), file);
  EXPECT_NE(outcome.ended.find("at the stop the pressure of boom rod rises by"), std::string::npos) << outcome.ended;
  EXPECT_FALSE(outcome.pilot);
}

/// A run that ends where the next word of the script is missing, and how far it came.
WizardProgress ended_after(const std::shared_ptr<sim::MachineOnBus>& bus, std::size_t words) {
  Script script = all();
  script.resize(words);
  WizardProgress kept;
  const WizardRun ended =
      commission(bus, script, solar(), {}, {{}, [&kept](const WizardProgress& progress) { kept = progress; }});
  EXPECT_EQ(ended.ended, "the input has ended");
  return kept;
}

/// Up to the end of step 4.
Script signed_anew() {
  Script script = all();
  script.resize(kSigned);
  return script;
}

TEST(CommissionResume, GoesOnAfterTheLastCompletedStepAndComesToTheSameResult) {
  const auto bus = simulated_bus(solar(), 7);
  const WizardProgress kept = ended_after(bus, kStroked + 1);  // in the first ramp
  ASSERT_EQ(kept.completed, kStrokes);
  Script rest = signed_anew();
  rest.insert(rest.end(), {"go", "go", "go", "finish"});
  const WizardRun outcome = commission(bus, rest, solar(), {}, {kept, {}});
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_EQ(outcome.told.find("4. done before"), std::string::npos);
  EXPECT_NE(outcome.told.find("5. done before: skipped"), std::string::npos);
  const WizardRun whole = commission(simulated_bus(solar(), 7), all());
  for (std::size_t j = 0; j < kJoints; ++j) {
    EXPECT_TRUE(outcome.result.axes[j].preset);
    EXPECT_EQ(outcome.result.axes[j].stroke_m, whole.result.axes[j].stroke_m) << j;
    EXPECT_EQ(outcome.result.axes[j].offset_m, whole.result.axes[j].offset_m) << j;
    EXPECT_NEAR(*outcome.result.axes[j].dead_band_extend, *whole.result.axes[j].dead_band_extend, 0.01) << j;
  }
  const auto found = [](const Findings& all_of, const std::string& text) {
    return std::count_if(all_of.begin(), all_of.end(),
                         [&](const Finding& one) { return one.text.find(text) != std::string::npos; });
  };
  EXPECT_EQ(found(outcome.result.findings, "encoder preset"), 3) << "of the run before";
  EXPECT_EQ(found(outcome.result.findings, "pressed and released"), 1) << "of this run alone";
}

TEST(CommissionResume, MovesNothingBeforeThisRunsOwnWords) {
  const auto bus = simulated_bus();
  const WizardProgress kept = ended_after(bus, kStroked);
  ASSERT_EQ(kept.completed, kStrokes);
  const MotionWatch watch(*bus);
  Script script = start();
  script.resize(5);  // E-stop and slope, but no word that enables motion
  EXPECT_EQ(commission(bus, script, solar(), {}, {kept, {}}).ended, "the input has ended");
  EXPECT_FALSE(watch.powered);
  script = start();
  EXPECT_EQ(commission(bus, script, solar(), {}, {kept, {}}).ended, "the input has ended");
  EXPECT_LT(watch.moved_m, 1e-3) << "the first small motion needs its own word";
}

TEST(CommissionResume, ProvesTheSignsAgainBecauseTheRepairMayHaveExchangedThem) {
  const WizardProgress kept = ended_after(simulated_bus(), kStroked);
  ASSERT_EQ(kept.completed, kStrokes);
  MachineDescription repaired = solar();
  std::swap(knuckle::test::node_in(repaired.bus, NodeRole::kEncoder, kBoom).id,
            knuckle::test::node_in(repaired.bus, NodeRole::kEncoder, kArm).id);
  Resume resume{kept, {}};
  for (AxisResult& axis : resume.from.axes) axis.preset = false;  // their readings would tell by themselves
  Script script = signed_anew();
  script.insert(script.end(), {"go", "go", "go", "finish"});
  const WizardRun outcome = commission(simulated_bus(), script, repaired, {}, resume);
  EXPECT_NE(outcome.ended, "");
  EXPECT_EQ(outcome.told.find("6. Dead bands"), std::string::npos) << outcome.told;
  EXPECT_FALSE(outcome.pilot);
}

TEST(CommissionResume, EndsBeforeAnythingIsConfiguredWhereANodeIsAnotherDevice) {
  WizardProgress kept;
  kept.completed = kStrokes;
  kept.serials[solar().bus.encoder(kArm).id] = 4711;  // the simulated ones have no serial number
  const WizardRun outcome = commission(simulated_bus(), start(), solar(), {}, {kept, {}});
  EXPECT_NE(outcome.ended.find("serial number none, in the run before 4711: another device"), std::string::npos)
      << outcome.ended;
  EXPECT_EQ(outcome.told.find("2. Nodes"), std::string::npos);
}

TEST(CommissionResume, StopsWhereAPresetOfTheRunBeforeIsLost) {
  const auto bus = simulated_bus();
  WizardProgress kept;
  kept.completed = kStrokes;
  for (AxisResult& axis : kept.axes) axis.preset = true;
  // An encoder that shows another length than any that its cylinder has.
  const auto lost = [](BusAccess& access) { access.tape_m = [](int) { return std::optional(5.0); }; };
  const WizardRun outcome = commission(bus, start(), solar(), lost, {kept, {}});
  EXPECT_NE(outcome.ended.find("the preset is lost; begin anew"), std::string::npos) << outcome.ended;
  EXPECT_FALSE(outcome.pilot);
}

}  // namespace
}  // namespace knuckle::bringup
