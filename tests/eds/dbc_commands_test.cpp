// `knuckle bus import`: what the machine's own controller is told, from a DBC and what a person says of it.
#include "app/eds/dbc_commands.h"

#include <gtest/gtest.h>

#include "tests/eds/imports.h"
#include "tests/support/module_machine.h"

namespace knuckle::eds {
namespace {

using test::bus_of;
using test::imported;
using test::replaced;
using test::says;

constexpr const char* kToldDbc = R"(VERSION ""
BU_: Machine Knuckle
BO_ 2566848773 Rates: 8 Knuckle
 SG_ boom : 0|16@1+ (0.0005,-16) [-16|16] "rad/s" Machine
 SG_ arm : 16|16@1+ (0.0005,-16) [-16|16] "rad/s" Machine
 SG_ bucket : 39|16@0- (0.1,0) [-100|100] "deg/s" Machine
 SG_ slew : 48|16@1+ (0.0005,-16) [-16|16] "rad/s" Machine
BO_ 422 Setting: 8 Knuckle
 SG_ mode : 8|4@1+ (1,0) [0|15] "" Machine
 SG_ horn : 16|2@1+ (1,0) [0|3] "" Machine
 SG_ alive : 48|8@1+ (1,0) [0|255] "" Machine
BO_ 424 Own: 8 Machine
 SG_ mode : 8|4@1+ (1,0) [0|15] "" Knuckle
BO_ 423 Rare: 8 Knuckle
 SG_ mode : 8|4@1+ (1,0) [0|15] "" Machine
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 60000;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 2566848773 10;
BA_ "GenMsgCycleTime" BO_ 422 20;
BA_ "GenMsgCycleTime" BO_ 424 20;
)";

std::string slow_solar_text() {
  std::string text = test::shipped_text();
  for (const auto& [key, value] : {std::pair<std::string, std::string>{"sensor_age_limit_ms", "50"},
                                   {"valve_watchdog_ms", "100"},
                                   {"pressure_step_bar", "2"},
                                   {"pressure_range_bar", "350"}}) {
    const std::size_t at = text.find("\n" + key + " = ") + key.size() + 4;
    text.replace(at, text.find_first_of(" \n", at) - at, value);
  }
  return text;
}

const ImportOptions kTold{
    .commands = {"boom=Rates.boom:extend=0.6,retract=-0.6", "arm=Rates.arm:extend=-0.9,retract=0.9",
                 "bucket=Rates.bucket:extend=-70,retract=70"},
    .constants = {"Rates.slew=0", "Setting.mode=0,2", "Setting=3"},
    .counters = {"Setting.alive"}};
/// The same with other constants.
ImportOptions told_with(const std::vector<std::string>& constants) {
  ImportOptions said = kTold;
  said.constants = constants;
  return said;
}
/// @param before has frames already, or nodes
Import told(const ImportOptions& said = kTold, const std::string& before = slow_solar_text()) {
  return imported(said, kToldDbc, before);
}

TEST(DbcCommands, TakeThePlaceOfValvesAndEnable) {
  const Import import = told();
  EXPECT_EQ(import.frames, (std::vector<std::string>{"Rates (0x18FF0105): boom, arm, bucket; constant: slew",
                                                     "Setting (0x1A6): constant: mode, horn; counter alive"}));
  EXPECT_EQ(import.gone_nodes, (std::vector<std::string>{"boom_valve", "arm_valve", "bucket_valve", "enable"}));
  const BusDescription bus = bus_of(import);
  ASSERT_EQ(bus.commands.size(), 2U);
  EXPECT_EQ(bus.command_kind, CommandKind::kJointRate);
  EXPECT_NEAR(bus.full_rate_radps(kArm, true), 0.9, 1e-12);
  EXPECT_EQ(bus.command(kBucket, true)->bits.order, BitField::Order::kBigEndian);
  const std::vector<CommandField>& setting = bus.commands[1].fields;
  EXPECT_EQ(setting[0].name, "horn");
  EXPECT_EQ(setting[0].neutral, 3) << "as all that nothing else is said of";
  EXPECT_EQ(setting[1].led, 2);
  EXPECT_EQ(bus.commands[1].closing.counter->field.start_bit, 48);
  EXPECT_EQ(bus.nodes.size(), 10U) << "sensors are nodes still";
}

TEST(DbcCommands, OneMoreConstantGoesIntoTheFrameThatIsThere) {
  const std::string before =
      replaced(told(told_with({"Rates.slew=0", "Setting=3"})).text, "period_ms = 20\nsend = \"always\"",
               "period_ms = 20\nsend = \"while_led\"   # tried");
  const std::string mode = "mode = { start = 8, bits = 4, scale = 1, neutral = 3 }";
  EXPECT_EQ(told({.constants = {"Setting.mode=0,2"}}, before).text,
            replaced(before, mode, "mode = { start = 8, bits = 4, scale = 1, neutral = 0, led = 2 }"));
  EXPECT_TRUE(says(told({.constants = {"Setting.mode=0,2"}}, replaced(before, mode + "\n", "")).text,
                   "mode = { start = 8, bits = 4, scale = 1, neutral = 0, led = 2 }"));
  const std::string renamed = replaced(before, mode, "front_by_bus = { start = 8, bits = 4, neutral = 3 }   # by hand");
  EXPECT_EQ(told({.constants = {"Setting.mode=1"}}, renamed).text,
            replaced(renamed, "bits = 4, neutral = 3 }", "bits = 4, scale = 1, neutral = 1 }"))
      << "it keeps the name that it was given";
}

TEST(DbcCommands, AnEnableNodeBesideTheFramesStays) {
  const std::string solar = slow_solar_text();
  const auto enable = solar.find("[[bus.node]]\nname = \"enable\"");
  std::string before = told().text;
  before.insert(before.find("[[bus.command]]"), solar.substr(enable, solar.find("[limits]", enable) - enable));
  ASSERT_TRUE(parse_machine(before, "m.toml").bus.has_enable());
  const Import again = told({.constants = {"Setting.mode=1"}}, before);
  EXPECT_TRUE(again.gone_nodes.empty());
  EXPECT_EQ(bus_of(again).nodes, parse_machine(before, "m.toml").bus.nodes);
}

TEST(DbcCommands, AModuleWhoseOutputsMoveTheJointsStays) {
  const std::string before = test::module_text();
  const Import import = told({.constants = {"Setting=0"}}, before);
  EXPECT_TRUE(import.gone_nodes.empty());
  const BusDescription is = bus_of(import), was = parse_machine(before, "m.toml").bus;
  EXPECT_EQ(is.nodes, was.nodes);
  EXPECT_EQ(is.commands.size(), was.commands.size() + 1);
}

TEST(DbcCommands, CounterAndChecksumKeepWhatAPersonSet) {
  ImportOptions said = told_with({"Rates.slew=0", "Setting.mode=0"});
  said.checksums = {"Setting.horn=xor"};
  std::string before = told(said).text;
  before = replaced(before, "counter = { start = 48, bits = 8 }",
                    "counter = { start = 48, bits = 8, modulus = 15 }  # to 14");
  const std::string sum = "checksum = { kind = \"xor\", start = 16, bits = 2";
  before = replaced(before, sum + " }", sum + ", bytes = [0, 1, 3], data_id = [0x2A], data_id_first = true }   # mine");
  said.commands = {};
  said.constants = {"Setting.mode=0"};
  EXPECT_EQ(told(said, before).text, before);
  said.checksums = {"Setting.horn=sum"};
  EXPECT_EQ(told(said, before).text, replaced(before, "kind = \"xor\"", "kind = \"sum\""));
}

TEST(DbcCommands, AJointsValueKeepsTheNeutralThatAPersonFound) {
  std::string dbc = kToldDbc;
  for (const char* const signal : {"boom : 0|16", "arm : 16|16"})
    dbc = replaced(dbc, std::string(signal) + "@1+ (0.0005,-16) [-16|16] \"rad/s\"",
                   std::string(signal) + "@1- (0.001,0) [0|0] \"V\"");
  dbc = replaced(dbc, "(0.1,0) [-100|100] \"deg/s\"", "(0.001,0) [0|0] \"V\"");
  ImportOptions volts = kTold;
  volts.commands = {"boom=Rates.boom:extend=9,retract=-9", "arm=Rates.arm:extend=9,retract=-9",
                    "bucket=Rates.bucket:extend=9,retract=-9"};
  const std::string before =
      test::all_changed(imported(volts, dbc, slow_solar_text()).text, "neutral = 0, extend = 9, retract = -9",
                        "neutral = 6, extend = 9, retract = 3");
  const Import again = imported({.commands = {"boom=Rates.boom:extend=8.5,retract=3"}}, dbc, before);
  EXPECT_EQ(again.text, replaced(before, "neutral = 6, extend = 9", "neutral = 6, extend = 8.5"));
  EXPECT_EQ(again.frames, std::vector<std::string>{"Rates (0x18FF0105): boom, in the table that was there"});
  EXPECT_TRUE(again.to_do.empty());
}

TEST(DbcCommands, ACounterThatWasForgottenIsAdded) {
  ImportOptions first = told_with({"Rates.slew=0", "Setting=0"});
  first.counters = {};
  const std::string before = told(first).text, alive = "alive = { start = 48, bits = 8, scale = 1, neutral = 0 }\n";
  const Import again = told({.counters = {"Setting.alive"}}, before);
  EXPECT_TRUE(says(before, alive));
  EXPECT_FALSE(says(again.text, alive)) << "what was a constant";
  EXPECT_EQ(bus_of(again).commands[1].closing.counter->field.start_bit, 48);
}

TEST(DbcCommands, WhereItWouldBeNoTomlTheLineSaysThatTheFileIsAsItWas) {
  const std::string before =
      replaced(told().text, "counter = { start = 48, bits = 8 }", "counter.start = 48\ncounter.bits = 8");
  const auto again = [&] { return told({.counters = {"Setting.alive"}}, before); };
  test::expect_refused(again, "m.toml: is as it was: with these frames of m.dbc it would be refused: ");
  test::expect_refused(again, "counter");
}

TEST(DbcCommands, WhatTheSenderOfAFrameInTheFileSendsIsRefused) {
  std::string dbc = kToldDbc;
  dbc = replaced(
      dbc, "BO_ 424 Own: 8 Machine\n",
      "BO_ 425 Body: 2 Machine\n SG_ slope : 0|16@1- (0.01,0) [-90|90] \"deg\" Knuckle\nBO_ 424 Own: 8 Machine\n");
  dbc += "BA_ \"GenMsgCycleTime\" BO_ 425 10;\n";
  const ImportOptions own{.constants = {"Own.mode=0"}}, slope{.signals = {"slope=Body.slope"}};
  ImportOptions both = kTold;
  both.signals = slope.signals;
  const std::string before = imported(both, dbc, slow_solar_text()).text;
  EXPECT_EQ(test::refusal([&] { (void)imported(own, dbc, before); }),
            "m.dbc: Own is sent by Machine, who sends Body as well: Knuckle must not send it");
  const std::string wrong = replaced(dbc, "BO_ 425 Body: 2 Machine", "BO_ 425 Body: 2 Knuckle");
  test::expect_refused([&] { return imported(slope, wrong, told().text); },
                       "is sent by Knuckle, who sends Body as well");
  const std::string nobody =
      replaced(replaced(dbc, "Body: 2 Machine", "Body: 2 Vector__XXX"), "Own: 8 Machine", "Own: 8 Vector__XXX");
  EXPECT_NO_THROW((void)imported(own, nobody, before)) << "of a DBC that does not say who sends";
}

TEST(DbcCommands, WhatCannotBeIsRefusedInOneLine) {
  struct Case {
    ImportOptions instead;  ///< Of what else is told.
    const char* said;
  };
  for (const Case& c : {
           Case{{.constants = {"Setting=3"}},
                "m.dbc:7: signal slew of Rates has no value to rest at: give --constant "
                "Rates.slew=VALUE, or Rates=VALUE"},
           {{.commands = {"boom"}}, "--command boom: must be such as boom=MESSAGE.SIGNAL:extend="},
           {{.commands = {"stick=Rates.boom:extend=1"}}, "must begin with one of boom, arm, bucket"},
           {{.commands = {"boom=Rates.boom:extend=1,extend=2"}}, "must be such as"},
           {{.commands = {"boom=Rates.stick:extend=1"}}, "Rates has no signal stick; it has boom, arm, bucket, slew"},
           {{.commands = {"boom=Rates.boom:extend=0.6,retract=-0.6"}, .constants = {"Rates=0", "Setting=0"}},
            "no field extends the arm"},
           {{.constants = {"Rates.slew=0", "Setting=9"}},
            "horn.neutral' = 9: cannot be said by these bits: nearest is 3"},
           {{.constants = {"Rates.slew=0", "Setting=1", "Rare.mode=1"}}, "Rare has no cycle time"},
           {{.constants = {"Rates.slew=0,1,2"}}, "--constant Rates.slew=0,1,2: must be such as"},
           {{.constants = {"Rates=0,1"}}, "--constant Rates=0,1: must be such as"},
           {{.constants = {"Rates.slew=0", "Setting=1", "Own.mode=1"}}, "Own is sent by Machine, and Rates by Knuckle"},
           {{.constants = {"Rates.slew=0", "Setting=1", "Setting=2"}}, "--constant Setting: is said twice"},
           {{.counters = {"Setting.alive", "Setting.horn"}}, "--counter Setting (counter): is said twice"},
           {{.counters = {"Setting"}}, "--counter Setting: must be such as MESSAGE.SIGNAL"},
           {{.checksums = {"Setting.mode=crc32"}},
            "--checksum Setting.mode=crc32: must be such as MESSAGE.SIGNAL=crc8-j1850, or with one of sum, xor, "
            "crc8-j1850, crc8-h2f"},
           {{.checksums = {"Setting=xor"}}, "--checksum Setting=xor: must be such as"},
           {{.checksums = {"Setting.alive=xor"}}, "--checksum Setting.alive: is said twice"},
       }) {
    ImportOptions said = kTold;
    if (!c.instead.commands.empty()) said.commands = c.instead.commands;
    if (!c.instead.constants.empty()) said.constants = c.instead.constants;
    if (!c.instead.counters.empty()) said.counters = c.instead.counters;
    said.checksums = c.instead.checksums;
    test::expect_refused([&] { return told(said); }, c.said);
  }
}

/// What docs/can-bus.md shows: all of standard200 by the DBC that its maker would give.
const ImportOptions kStandard200{
    .signals = {"boom_angle=front_angle.boom", "arm_angle=front_angle.arm", "bucket_angle=front_angle.bucket",
                "slope=body_slope.pitch", "boom_head_pressure=cylinder_pressure.boom_bottom",
                "boom_rod_pressure=cylinder_pressure.boom_rod", "arm_head_pressure=cylinder_pressure.arm_bottom",
                "arm_rod_pressure=cylinder_pressure.arm_rod", "bucket_head_pressure=cylinder_pressure.bucket_bottom",
                "bucket_rod_pressure=cylinder_pressure.bucket_rod", "pilot_on=machine_state.pilot_on",
                "e_stop_closed=machine_state.e_stop_closed"},
    .commands = {"boom=front_rate.boom_rate:extend=0.37,retract=-0.37",
                 "arm=front_rate.arm_rate:extend=-0.6,retract=0.6",
                 "bucket=front_rate.bucket_rate:extend=-1,retract=1"},
    .constants = {"front_rate=0", "machine_setting.engine_rpm=900,1800", "machine_setting.front_by_bus=0,2",
                  "machine_setting=0"},
    .counters = {"machine_setting.alive_counter"},
    .checksums = {"machine_setting.checksum=crc8-j1850"}};

TEST(DbcCommands, Standard200IsWhatItsMakersDbcSays) {
  const std::string folder = test::source_dir() + "/config/machines/";
  const std::string text = test::content(folder + "standard200.toml"), dbc = test::content(folder + "standard200.dbc");
  EXPECT_TRUE(parse_dbc(dbc, "m.dbc").slips.empty());
  const BusDescription before = parse_machine(text, "m.toml").bus;
  EXPECT_EQ(bus_of(imported(kStandard200, dbc, text)), before);

  const Import import = imported(kStandard200, dbc, slow_solar_text());  // of nodes
  const BusDescription bus = bus_of(import);
  EXPECT_TRUE(bus.nodes.empty());
  ASSERT_EQ(bus.commands.size(), 2U);
  EXPECT_EQ(bus.commands[1].closing, before.commands[1].closing);
  EXPECT_FALSE(says(import.text, "\n\n\n")) << "nodes that are gone leave no gaps";
}

}  // namespace
}  // namespace knuckle::eds
