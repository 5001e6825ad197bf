// The commissioning of the simulated machine by a script, and by people who do something else than they were asked.
#include "app/bringup/commission_wizard.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <deque>
#include <fstream>
#include <iterator>
#include <sstream>

#include "app/bringup/commission_result.h"
#include "core/error.h"
#include "machine/load.h"
#include "machine/toml_reader.h"
#include "tests/bringup/hardware_bench.h"

namespace knuckle::bringup {
namespace {

using test::simulated_bus;
using test::solar;
using Script = std::deque<std::string>;

/// Up to the first motion.
Script start() {
  return {"ready", "configure", "pressed", "released", "0", "pilot", "move"};
}
Script all() {
  Script script = start();
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "longer", "go", "shorter"});
  for (int j = 0; j < kJoints; ++j) script.insert(script.end(), {"go", "go", "go", "tape", "preset"});
  script.insert(script.end(), {"go", "go", "go", "finish"});
  return script;
}

/// What came of it, and where the machine stood then.
struct Outcome {
  std::string ended;  ///< Empty where it came to its end.
  WizardResult result;
  std::string told;
  bool pilot = false;
  JointVector demand = JointVector::Zero();
};

Outcome commission(const std::shared_ptr<sim::MachineOnBus>& bus, Script script,
                   const MachineDescription& file = solar(), const std::function<void(BusAccess&)>& change = {},
                   const Resume& resume = {}) {
  BusAccess access = sim::access_to(bus);
  if (change) change(access);
  const auto next = [&script]() -> std::optional<std::string> {
    if (script.empty()) throw CommissionEnded("the input has ended");
    std::string line = script.front();
    script.pop_front();
    return line;
  };
  std::ostringstream told;
  Outcome outcome;
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

TEST(CommissionWizard, FindsZeroAndDeadBandsOfADrawnMachineAndPresetsItsEncoders) {
  const auto bus = simulated_bus(solar(), 7);
  const sim::MachineTruth& truth = bus->machine().plant().truth();
  const Outcome outcome = commission(bus, all());
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
        bus->machine().nodes().node(solar().bus.encoders[j].id)->value(canopen::kEncoderPosition));
    const double shown_m = steps * solar().sensors.encoder_step_m;
    EXPECT_NEAR(shown_m, bus->plant().cylinder_m[static_cast<int>(j)], 3e-3) << kJointNames[j];
  }
}

TEST(CommissionWizard, LeavesABusWithWhichADoctorFindsNothingWrong) {
  const auto bus = simulated_bus();
  const Outcome outcome = commission(bus, {"ready", "configure", "pressed", "released", "0", "no"});
  EXPECT_NE(outcome.told.find("Out of service: valves disabled, pilot pressure off."), std::string::npos);
  BusAccess access = sim::access_to(bus);
  const BusSurvey survey = survey_bus(access, solar().bus.bit_rate, doctor_objects(solar()), {}, [] {});
  for (const Finding& one : diagnose(survey, &solar()).findings)
    EXPECT_EQ(one.level, Finding::Level::kOk) << one.about << ": " << one.text;
}

TEST(CommissionWizard, NothingMovesAndNothingIsPoweredBeforeItsWord) {
  const auto bus = simulated_bus();
  bool powered = false;
  double moved_m = 0;
  const JointVector before = bus->plant().cylinder_m;
  bus->each_tick = [&](sim::MachineOnBus& b) {
    powered = powered || b.machine().nodes().outputs().pilot;
    moved_m = std::max(moved_m, (b.plant().cylinder_m - before).cwiseAbs().maxCoeff());
  };
  Script script = start();
  script.erase(script.begin() + 5, script.end());  // all but the two words that enable motion
  EXPECT_EQ(commission(bus, script).ended, "the input has ended");
  EXPECT_FALSE(powered);
  EXPECT_LT(moved_m, 1e-3);
}

TEST(CommissionWizard, AnyOtherAnswerEndsItNeutralAndOnlyThatFar) {
  const Script words = start();
  for (std::size_t wrong = 0; wrong < words.size(); ++wrong) {
    for (const char* typed : {"", "yes", "READY", "move "}) {
      Script script(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(wrong));
      script.push_back(typed);
      const Outcome outcome = commission(simulated_bus(), script);
      EXPECT_NE(outcome.ended.find("'" + std::string(typed) + "' is no"), std::string::npos) << outcome.ended;
      EXPECT_FALSE(outcome.pilot);
      EXPECT_EQ(outcome.demand, JointVector::Zero());
      if (wrong > 1) break;  // the later ones take longer
    }
  }
}

TEST(CommissionWizard, BusThatIsNotAsTheFileSaysIsLeftAlone) {
  const auto bus = simulated_bus();
  bus->machine().nodes().set_product(0x31, 0x999);
  const Outcome outcome = commission(bus, all());
  EXPECT_NE(outcome.ended.find("nothing was configured or moved"), std::string::npos) << outcome.ended;
  EXPECT_EQ(bus->machine().nodes().node(0x10)->value(canopen::kProducerHeartbeat), 0U);
}

TEST(CommissionWizard, EStopThatIsNotWiredIsFoundBeforeAnythingMoves) {
  const Outcome outcome =
      commission(simulated_bus(), all(), solar(), [](BusAccess& access) { access.press_e_stop = [](bool) {}; });
  EXPECT_EQ(outcome.ended,
            "the E-stop was pressed, but the enable node reports its chain closed: check the node's input");
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
  const Outcome outcome = commission(bus, script);
  EXPECT_TRUE(once);
  EXPECT_EQ(outcome.ended, "the E-stop chain is open: release the E-stop on the machine");
  EXPECT_FALSE(outcome.pilot);
  EXPECT_EQ(outcome.demand, JointVector::Zero());
}

TEST(CommissionWizard, ExchangedEncodersAreFoundByTheFirstMotion) {
  MachineDescription file = solar();
  std::swap(file.bus.encoders[kBoom].id, file.bus.encoders[kArm].id);
  Script script = start();
  script.insert(script.end(), {"go", "longer"});
  const Outcome outcome = commission(simulated_bus(), script, file);
  EXPECT_NE(outcome.ended.find("the arm cylinder moved by "), std::string::npos) << outcome.ended;
}

TEST(CommissionWizard, ExchangedPressureSidesAreFoundAtTheStop) {
  MachineDescription file = solar();
  std::swap(file.bus.pressures[2 * kBoom].id, file.bus.pressures[2 * kBoom + 1].id);
  const Outcome outcome = commission(simulated_bus(), all(), file);
  EXPECT_NE(outcome.ended.find("at the stop the pressure of boom rod rises by"), std::string::npos) << outcome.ended;
  EXPECT_FALSE(outcome.pilot);
}

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A run that ends where the next word of the script is missing, and how far it came.
WizardProgress ended_after(const std::shared_ptr<sim::MachineOnBus>& bus, std::size_t words) {
  Script script = all();
  script.resize(words);
  WizardProgress kept;
  const Outcome ended =
      commission(bus, script, solar(), {}, {{}, [&kept](const WizardProgress& progress) { kept = progress; }});
  EXPECT_EQ(ended.ended, "the input has ended");
  return kept;
}
constexpr std::size_t kSigned = 7 + 12, kStroked = kSigned + 15;  // words up to the ends of these steps

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
  const Outcome outcome = commission(bus, rest, solar(), {}, {kept, {}});
  ASSERT_EQ(outcome.ended, "") << outcome.told;
  EXPECT_EQ(outcome.told.find("4. done before"), std::string::npos);
  EXPECT_NE(outcome.told.find("5. done before: skipped"), std::string::npos);
  const Outcome whole = commission(simulated_bus(solar(), 7), all());
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
  bool powered = false;
  double moved_m = 0;
  const JointVector before = bus->plant().cylinder_m;
  bus->each_tick = [&](sim::MachineOnBus& b) {
    powered = powered || b.machine().nodes().outputs().pilot;
    moved_m = std::max(moved_m, (b.plant().cylinder_m - before).cwiseAbs().maxCoeff());
  };
  Script script = start();
  script.resize(5);  // E-stop and slope, but no word that enables motion
  EXPECT_EQ(commission(bus, script, solar(), {}, {kept, {}}).ended, "the input has ended");
  EXPECT_FALSE(powered);
  script = start();
  EXPECT_EQ(commission(bus, script, solar(), {}, {kept, {}}).ended, "the input has ended");
  EXPECT_LT(moved_m, 1e-3) << "the first small motion needs its own word";
}

TEST(CommissionResume, ProvesTheSignsAgainBecauseTheRepairMayHaveExchangedThem) {
  const WizardProgress kept = ended_after(simulated_bus(), kStroked);
  ASSERT_EQ(kept.completed, kStrokes);
  MachineDescription repaired = solar();
  std::swap(repaired.bus.encoders[kBoom].id, repaired.bus.encoders[kArm].id);
  Resume resume{kept, {}};
  for (AxisResult& axis : resume.from.axes) axis.preset = false;  // their readings would tell by themselves
  Script script = signed_anew();
  script.insert(script.end(), {"go", "go", "go", "finish"});
  const Outcome outcome = commission(simulated_bus(), script, repaired, {}, resume);
  EXPECT_NE(outcome.ended, "");
  EXPECT_EQ(outcome.told.find("6. Dead bands"), std::string::npos) << outcome.told;
  EXPECT_FALSE(outcome.pilot);
}

TEST(CommissionResume, EndsBeforeAnythingIsConfiguredWhereANodeIsAnotherDevice) {
  WizardProgress kept;
  kept.completed = kStrokes;
  kept.serials[solar().bus.encoders[kArm].id] = 4711;  // the simulated ones have no serial number
  const Outcome outcome = commission(simulated_bus(), start(), solar(), {}, {kept, {}});
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
  const Outcome outcome = commission(bus, start(), solar(), lost, {kept, {}});
  EXPECT_NE(outcome.ended.find("the preset is lost; begin anew"), std::string::npos) << outcome.ended;
  EXPECT_FALSE(outcome.pilot);
}

TEST(CommissionResult, IsTheMachineFileWithADeadBandThatDiffersAndTheRecordBehindIt) {
  const std::string drawing = text_of(solar().source);
  WizardResult result;
  result.axes[kArm] = {0.45, 0.0123, true, 0.15503, 0.125};
  result.tilt_error_rad = 0.01;
  result.nodes.push_back({});
  result.findings.push_back({Finding::Level::kNote, "arm", "a \"quoted\" line"});
  result.recordings = {"slow.csv", "fast.csv"};
  const ResultOrigin origin{"can0", "2026-01-02T03:04:05Z", "abc"};
  const std::string text = commissioned_text(drawing, solar(), result, origin);

  const MachineDescription back = parse_machine(text, "found.toml");
  EXPECT_EQ(back.cylinders[kArm].valve.dead_band_extend, 0.155);
  EXPECT_EQ(back.cylinders[kArm].valve.dead_band_retract, 0.11);  // no further off than a ramp may be
  EXPECT_EQ(back.cylinders[kBoom].valve.dead_band_extend, 0.11);
  std::string changed = drawing;
  const std::size_t arm = changed.find("[cylinders.arm.valve]");
  changed.replace(changed.find("dead_band_extend = 0.11", arm), 23, "dead_band_extend = 0.155");
  EXPECT_EQ(text.compare(0, changed.size(), changed), 0);

  TomlTable record = TomlTable::parse(text, "found.toml").table("commissioning");
  EXPECT_EQ(record.text("bus"), "can0");
  TomlTable axis = record.table("axes").table("arm");
  EXPECT_NEAR(axis.number("encoder_offset_mm", -100, 100), 12.3, 1e-9);
  EXPECT_TRUE(axis.boolean("encoder_preset"));
  EXPECT_NEAR(axis.number("dead_band_retract", 0, 1), 0.125, 1e-9);
  EXPECT_FALSE(record.table("axes").table("boom").has("dead_band_extend"));
  EXPECT_EQ(record.tables("nodes").size(), 1U);
  EXPECT_EQ(record.tables("findings")[0].text("text"), "a \"quoted\" line");

  // Commissioned once more, only what was found then counts.
  EXPECT_EQ(commissioned_text(text, back, result, origin), text);
}

TEST(CommissionResult, ReplacesTheDeadBandsOfAnEarlierIdentification) {
  const std::string file =
      text_of(solar().source) + "\n[calibration]\nmethod = \"m\"\ndate = \"d\"\ndata_source = \"s\"\ndata_sha256 = \"" +
      std::string(64, '0') +
      "\"\nprogram = \"p\"\n"
      "[calibration.valves.boom]\ndead_band_extend = 0.1\ndead_band_retract = 0.1\ndelay_ms = 15\n"
      "nominal_flow_Lpm = 30\ncurve_exponent = 1\nretract_share = 1\n[calibration.valves.arm]\ndead_band_extend = "
      "0.1\ndead_band_retract = 0.1\n"
      "delay_ms = 15\nnominal_flow_Lpm = 25\ncurve_exponent = 1\nretract_share = "
      "1\n[calibration.valves.bucket]\ndead_band_extend = 0.1  # was 0.11\n"
      "dead_band_retract = 0.1\ndelay_ms = 15\nnominal_flow_Lpm = 20\ncurve_exponent = 1\nretract_share = 1\n";
  const MachineDescription machine = calibrated(parse_machine(file, "calibrated.toml"));
  WizardResult result;
  result.axes[kBucket].dead_band_extend = 0.2;
  const std::string text = commissioned_text(file, machine, result, {});
  EXPECT_EQ(calibrated(parse_machine(text, "found.toml")).cylinders[kBucket].valve.dead_band_extend, 0.2);
  EXPECT_NE(text.find("# was 0.11"), std::string::npos);
}

TEST(CommissionResult, FileThatItCouldNotBePutIntoIsRefusedAtTheBeginning) {
  EXPECT_NO_THROW(check_layout(text_of(solar().source), solar()));
  std::string text = text_of(solar().source);
  const std::string table = "[cylinders.arm.valve]";
  text.replace(text.find(table), table.size(), "[ cylinders.arm.valve ]");
  const MachineDescription machine = parse_machine(text, "odd.toml");
  try {
    check_layout(text, machine);
    FAIL() << "was accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "odd.toml: [cylinders.arm.valve]: commissioning needs dead_band_extend and dead_band_retract on one "
              "line each");
  }
}

TEST(CommissionDialogue, LinesComeWholeFromAPipeAndItsEndIsTold) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  LineInput input(ends[0]);
  EXPECT_EQ(input.poll(), std::nullopt);
  ASSERT_EQ(write(ends[1], "rea", 3), 3);
  EXPECT_EQ(input.poll(), std::nullopt);
  ASSERT_EQ(write(ends[1], "dy\r\ngo\n", 7), 7);
  EXPECT_EQ(input.poll(), "ready");
  EXPECT_EQ(input.poll(), "go");
  EXPECT_EQ(input.poll(), std::nullopt);
  ASSERT_EQ(write(ends[1], "go", 2), 2);
  close(ends[1]);
  EXPECT_THROW((void)input.poll(), CommissionEnded) << "perhaps half an answer";
  close(ends[0]);
}

TEST(CommissionDialogue, TheLastLineOfAFileMayLackItsEnd) {
  std::FILE* const file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  std::fputs("ready\nfinish", file);
  std::rewind(file);
  LineInput input(fileno(file));
  EXPECT_EQ(input.poll(), "ready");
  EXPECT_EQ(input.poll(), "finish");
  EXPECT_THROW((void)input.poll(), CommissionEnded);
  std::fclose(file);
}

TEST(CommissionDialogue, PersonsTypeAheadIsNoAnswerAndMeansStopWhileSomethingMoves) {
  std::deque<std::optional<std::string>> typed;
  std::ostringstream out;
  const auto next = [&typed]() -> std::optional<std::string> {
    if (typed.empty()) return std::nullopt;
    auto line = typed.front();
    typed.pop_front();
    return line;
  };
  Dialogue dialogue(terminal(out, next, true), [&typed] { typed.emplace_back("go"); });
  typed.emplace_back("pilot");  // before the question
  EXPECT_EQ(dialogue.ask("?", {"pilot", "go"}), 1);
  EXPECT_FALSE(dialogue.interrupted());
  typed.emplace_back("");
  EXPECT_TRUE(dialogue.interrupted());
}

TEST(CommissionDialogue, APersonWhoMistypesIsAskedAgainAndAScriptIsNot) {
  std::ostringstream out;
  std::vector<std::string> typed;
  const auto next = [&typed]() -> std::optional<std::string> {
    if (typed.empty()) return std::nullopt;
    std::string line = typed.front();
    typed.erase(typed.begin());
    return line;
  };
  std::vector<std::string> person{"yes", "go", "45", "1,5", "30"};
  const auto types = [&] {
    if (!person.empty()) typed.push_back(person.front()), person.erase(person.begin());
  };
  Dialogue live(terminal(out, next, true), types);
  EXPECT_EQ(live.ask("ready?", {"no", "go"}), 1);
  EXPECT_EQ(live.ask_number("tilt?", -30, 30, "degrees"), 30);
  EXPECT_TRUE(person.empty());
  EXPECT_NE(out.str().find("the answer 'yes' is not one of no | go: nothing moves; once more"), std::string::npos);
  EXPECT_NE(out.str().find("the answer '45' is not a number from -30 to 30"), std::string::npos);
  typed = {"yes", "go"};
  Dialogue script(terminal(out, next, false), [] {});
  EXPECT_THROW((void)script.ask("ready?", {"no", "go"}), CommissionEnded);
}

TEST(CommissionDialogue, NumbersAreTakenWithinTheirBoundsOnly) {
  const auto answer = [](const std::string& line) {
    std::ostringstream out;
    Dialogue dialogue(terminal(
                          out, [&line] { return std::optional(line); }, false),
                      [] {});
    return dialogue.ask_number("?", -30, 30, "degrees");
  };
  EXPECT_EQ(answer("-30"), -30);
  EXPECT_EQ(answer("1.5"), 1.5);
  for (const char* bad : {"", "30.1", "nan", "1,5", "1 deg", "inf"})
    EXPECT_THROW((void)answer(bad), CommissionEnded) << bad;
}

}  // namespace
}  // namespace knuckle::bringup
