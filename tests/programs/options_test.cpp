// The command line: what it accepts, and one clear line for everything it does not.
#include <gtest/gtest.h>

#include <string>

#include "app/cli/command.h"
#include "app/programs/programs.h"
#include "core/error.h"
#include "tests/support/places.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::programs {
namespace {

/// What the program would run `simulate` with.
session::SimulateOptions simulate_options(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "simulate");
  session::SimulateOptions asked;
  const cli::Command entry = simulate_entry([&](const session::SimulateOptions& options, const std::string&) {
    asked = options;
    return 0;
  });
  EXPECT_EQ(cli::parse_command_line({"knuckle", "", "", {entry}}, arguments).run(), 0);
  return asked;
}

/// Help or version.
std::string printed(const std::vector<std::string>& arguments) {
  const cli::CommandLine line = cli::parse_command_line(
      {"knuckle", "", "", {simulate_entry([](const session::SimulateOptions&, const std::string&) { return 0; })}},
      arguments);
  EXPECT_FALSE(line.run);
  return line.text;
}

/// The message, or "accepted".
std::string refusal(const std::vector<std::string>& arguments) {
  return test::refusal([&] { return simulate_options(arguments); });
}

TEST(CommandLine, TakesEveryOptionOfSimulate) {
  EXPECT_EQ(simulate_options({}).scenario, "dismantle");
  EXPECT_FALSE(simulate_options({}).delay_ms.has_value());
  const session::SimulateOptions o = simulate_options(
      {"--scenario", "wall_contact", "--machine",     "solar015",   "--device", "knuckle1",   "--operator",
       "relaxed",    "--control",    "direct",        "--duration", "12.5",     "--seed",     "18446744073709551615",
       "--delay-ms", "10",           "--jitter-ms=2", "--loss",     "0.1",      "--realtime", "--candump",
       "a.log",      "--csv",        "a.csv",         "--report",   "a.html",   "--json",     "-"});
  EXPECT_EQ(o.scenario, "wall_contact");
  EXPECT_EQ(o.operator_name, "relaxed");
  EXPECT_EQ(o.control, "direct");
  EXPECT_EQ(o.duration_s, 12.5);
  EXPECT_EQ(o.seed, 18446744073709551615u);
  EXPECT_EQ(o.delay_ms, 10);
  EXPECT_EQ(o.jitter_ms, 2);
  EXPECT_EQ(o.loss, 0.1);
  EXPECT_TRUE(o.realtime);
  EXPECT_EQ(o.json, "-");
}

TEST(CommandLine, HelpAndVersionAreTextNotErrors) {
  EXPECT_TRUE(test::says(printed({"--help"}), "simulate"));
  EXPECT_TRUE(test::says(printed({"simulate", "--help"}), "--delay-ms"));
  EXPECT_EQ(printed({"--version"}).rfind("knuckle ", 0), 0u);
}

struct BadInput {
  std::vector<std::string> arguments;
  std::vector<std::string> named;  ///< What the one line must contain.
};

TEST(CommandLine, EveryBadInputIsRefusedInOneLineThatNamesIt) {
  const std::string map = test::source_dir() + "/CMakeLists.txt";  // any file that is there
  const std::vector<BadInput> table{
      {{"stray"}, {"stray"}},
      {{"--delay-ms", "-1"}, {"--delay-ms", "-1", "0", "5000"}},
      {{"--loss", "1.01"}, {"--loss", "1.01", "from 0 to 1"}},
      {{"--duration", "0"}, {"--duration", "0.1"}},
      {{"--duration", "1e9"}, {"--duration", "3600"}},
      {{"--scenario", ""}, {"--scenario"}},
      {{"--control", "wave"}, {"--control wave: must be echo, cues or direct"}},
      {{"--operator", "path:/nowhere.mcap,"}, {"--operator: must name a file after 'path:' and after each comma"}},
      {{"--log", "session.csv"}, {"--log", "session.csv", "must end in .mcap"}},
      {{"--operator", "path:/nowhere.csv"}, {"--operator", "/nowhere.csv", "no such file"}},
      {{"--operator", "path:" + map}, {"--operator", "--map"}},
      {{"--operator", "path:" + map, "--map", "/nowhere.toml"}, {"--map", "/nowhere.toml"}},
      {{"--operator", "path:/", "--map", map}, {"--operator", "folder"}},
      {{"--map", map}, {"--map", "--operator path:"}},
      {{"--truth", "/nowhere.toml"}, {"--truth", "/nowhere.toml"}},
      {{"--json", "-", "--candump", "-"}, {"--json", "--candump", "standard output"}},
      {{"--json", "x", "--csv", "./x"}, {"--json", "--csv"}},
      {{"--truth", map, "--csv", map}, {"--csv", "--truth"}},
      {{"--realtime", "--listen", "127.0.0.1:0", "--connect", "foo"}, {"--connect foo: is not HOST:PORT"}},
      {{"--realtime", "--listen", "foo", "--connect", "127.0.0.1:9"}, {"--listen foo: is not ADDR:PORT"}},
  };
  for (const BadInput& bad : table) {
    const std::string message = refusal(bad.arguments);
    EXPECT_NE(message, "accepted") << bad.arguments[0];
    EXPECT_FALSE(test::says(message, "\n"));
    for (const std::string& word : bad.named) EXPECT_TRUE(test::says(message, word)) << " lacks ";
  }
}

/// By what runs the session, before anything runs.
TEST(CommandLine, WhatASessionCannotDoIsRefused) {
  const std::vector<BadInput> table{
      {{"--machine", "solar016"}, {"solar016", "solar015"}},
      {{"--device", "knuckle9"}, {"knuckle9", "knuckle1"}},
      {{"--operator", "nobody"}, {"--operator", "nobody", "relaxed", "path:FILE.mcap"}},
      {{"--realtime", "--delay-ms", "10"}, {"--delay-ms", "--realtime"}},
      {{"--scenario", "recorded_dig"}, {"recorded_dig", "--operator"}},
      {{"--json", "/dev/null/a.json"}, {"--json", "/dev/null/a.json"}},
      {{"--report", "/proc/a.html"}, {"--report", "/proc/a.html"}},
  };
  for (BadInput bad : table) {
    bad.arguments.insert(bad.arguments.begin(), {"simulate", "--duration", "1"});
    const std::string message = test::refusal([&] {
      const cli::Command entry =
          simulate_entry([](const session::SimulateOptions& options, const std::string& command_line) {
            return simulate_command(options, command_line, session::run_simulation);
          });
      return cli::parse_command_line({"knuckle", "", "", {entry}}, bad.arguments).run();
    });
    EXPECT_FALSE(test::says(message, "\n"));
    for (const std::string& word : bad.named) EXPECT_TRUE(test::says(message, word));
  }
}

/// What `master`, `slave` or `device` says, called like this; none of these gets as far as a wire.
std::string program_refusal(const std::vector<std::string>& arguments) {
  return test::refusal([&] {
    return cli::parse_command_line({"knuckle", "", "", {master_entry(), slave_entry({}), device_entry()}}, arguments)
        .run();
  });
}

std::vector<std::string> with(std::vector<std::string> all, const std::vector<std::string>& more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

TEST(CommandLine, OptionsThatWouldDoNothingAreRefused) {
  const std::vector<std::string> observe{"master",    "--observe",      "--device",   "none",
                                         "--connect", "127.0.0.1:5683", "--duration", "0.1"};
  const std::vector<std::string> plain{"slave",      "--simulate", "--listen", "127.0.0.1:0",
                                       "--insecure", "--duration", "0.1"};
  for (const std::vector<std::string>& more : std::vector<std::vector<std::string>>{{"--machine", "solar015"},
                                                                                    {"--device-file", "knuckle1"},
                                                                                    {"--mirror", "127.0.0.1:5690"},
                                                                                    {"--control", "echo"},
                                                                                    {"--assist-force-limit", "1000"},
                                                                                    {"--assist-stop-on-object"},
                                                                                    {"--csv", "a.csv"}})
    EXPECT_EQ(program_refusal(with(observe, more)), more[0] + ": does not go with --observe");
  EXPECT_EQ(program_refusal({"master", "--observe", "--device", "hid", "--connect", "127.0.0.1:5683"}),
            "--observe: goes with --device none");
  EXPECT_EQ(program_refusal({"master", "--device", "none", "--connect", "127.0.0.1:5683"}),
            "--machine: is required, unless --observe is given");
  for (const char* law : {"direct", "tdpa"})
    EXPECT_EQ(program_refusal({"master", "--machine", "solar015", "--device", "none", "--connect", "127.0.0.1:5683",
                               "--control", law}),
              std::string("--control ") + law + ": must be echo or cues: no other law leads a machine");
  EXPECT_EQ(program_refusal(with(plain, {"--observers", "2"})),
            "--observers 2: goes with a paired link, not with --insecure");
  EXPECT_EQ(program_refusal(with(plain, {"--keys", "/tmp"})),
            "--keys /tmp: does not go with --insecure: no key is used");
}

TEST(CommandLine, TheDeviceIsRefusedWhatItCannotDo) {
  const std::vector<std::string> null{"device", "--gadget", "/dev/null"};
  EXPECT_EQ(program_refusal({"device"}), "--gadget: is required, such as --gadget /dev/hidg0");
  EXPECT_EQ(program_refusal({"device", "--gadget", "/nowhere/hidg0"}),
            "--gadget /nowhere/hidg0: cannot be opened: No such file or directory");
  EXPECT_EQ(program_refusal(with(null, {"--scenario", "wall_contact"})),
            "--scenario wall_contact: needs --screen: the simulated operator must see the machine");
  EXPECT_EQ(program_refusal(with(null, {"--operator", "strong"})),
            "--operator strong: must be one of relaxed, normal, co_contracted, light_grip");
  EXPECT_EQ(program_refusal(null), "--gadget /dev/null: is a device of the class mem, not of a HID gadget (hidg)");
  EXPECT_TRUE(test::says(program_refusal({"device", "--descriptor", "r.toml"}), "configuration file"));
  for (const std::string option : {"--gadget", "--csv", "--json"})
    EXPECT_EQ(program_refusal({"device", "--descriptor", "r.bin", option, "x"}),
              option + " x: does not go with --descriptor, which only writes that");
}

TEST(CommandLine, TheMachinesSideTakesExactlyOneBusAndNothingInVain) {
  const std::vector<BadInput> table{
      {{}, {"needs --can, or --simulate"}},
      {{"--simulate", "--can", "vcan0"}, {"--can vcan0: give --can or --simulate, not both"}},
      {{"--simulate", "--wait-for-can"}, {"--wait-for-can: only goes with --can"}},
      {{"--can", "vcan0"}, {"--machine: is required with --can"}},
      {{"--can", "vcan0", "--machine", "solar015", "--scenario", "dismantle"},
       {"--scenario dismantle: only goes with"}},
      {{"--simulate", "--scenario", "link_faults"}, {"link_faults.toml: schedules faults, which need virtual time"}},
      {{"--can", "nosuch7", "--machine", "solar015"}, {"\"nosuch7\": no such interface"}},
      {{"--can", "lo", "--machine", "solar015", "--wait-for-can"}, {"\"lo\": is not a CAN interface"}},
      {{"--can", "vcan0", "--machine", "solar015", "--seed", "3"}, {"--seed 3: only goes with --simulate"}},
      {{"--can", "nosuch7", "--machine", "solar015", "--wait-for-can", "--csv", "/dev/null/x.csv"}, {"--csv"}},
      {{"--simulate", "--scenario", "no_such_scenario"}, {"no_such_scenario"}}};
  for (const BadInput& bad : table) {
    const std::string message =
        program_refusal(with({"slave", "--listen", "127.0.0.1:0", "--insecure", "--duration", "1"}, bad.arguments));
    EXPECT_FALSE(test::says(message, "\n"));
    EXPECT_TRUE(test::says(message, bad.named[0]));
  }
}

TEST(CommandLine, SerialAndFirstIdOfASimulatedNodeAreOfANodeThatThereIsAndWithinTheirBounds) {
  const auto refused = [](const std::string& option, const std::string& value) {
    return test::refusal([&] {
      return cli::parse_command_line({"knuckle", "", "", {node_entry()}},
                                     {"node", "--can", "no_such_can", option, value})
          .run();
    });
  };
  EXPECT_EQ(refused("--serial", "boom_valve=4294967296"),
            "--serial boom_valve=4294967296: must be a number of 32 bits");
  EXPECT_EQ(refused("--node-id", "boom_valve=0x80"), "--node-id 0x80: must be a node id, 1 to 127 or 0x01 to 0x7F");
  for (const std::string option : {"--serial", "--node-id", "--eds"}) {
    for (const std::string value : {"swing_valve=7", "boom_valve"})
      EXPECT_EQ(refused(option, value).find(option + ' ' + value + ": must be NODE=...; nodes are boom_valve, "), 0U);
  }
  EXPECT_EQ(refused("--node-id", "boom_valve=none").find("CAN interface"), 0U) << "taken";
  EXPECT_EQ(refused("--serial", "boom_valve=0xFFFFFFFF").find("CAN interface"), 0U);
}

TEST(CommandLine, EveryCommandGetsItsOwnOptionsAndGivesItsOwnExitCode) {
  const auto entry = [](const char* name, int code) {
    return cli::Command{name, "", [code](const cli::OptionList&) { return [code] { return code; }; }};
  };
  const cli::Program program{"knuckle",
                             "",
                             "",
                             {entry("dig", 3), entry("lift", 4),
                              simulate_entry([](const session::SimulateOptions&, const std::string&) { return 5; })}};
  EXPECT_EQ(cli::parse_command_line(program, {"lift"}).run(), 4);
  EXPECT_EQ(cli::parse_command_line(program, {"simulate", "--seed", "2"}).run(), 5);
  EXPECT_THROW((void)cli::parse_command_line(program, {"dig", "--seed", "2"}), InputError);
}

}  // namespace
}  // namespace knuckle::programs
