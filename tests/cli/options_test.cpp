// What a command line's options take and how they refuse: one line that names option, value and bound, in words of
// Knuckle's own, not of the library that reads them.
#include "app/cli/options.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include "app/cli/command.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::cli {
namespace {

struct Digging {
  double slow = 0;
  std::uint64_t seed = 0;
  std::uint32_t machines = 0, weight = 0;
  std::optional<int> jobs;
  std::vector<double> depths;
  std::vector<std::string> places;
  std::string mode = "echo", map, pit;
  bool mute = false;
};

const auto kDug = std::make_shared<Digging>();

std::function<int()> declare_dig(const OptionList& c) {
  c.add_option("--pit", kDug->pit, "Which").required();
  c.add_option("--slow", kDug->slow, "Speed");
  c.add_option("--seed", kDug->seed, "Seed").check(seed_error);
  c.add_option("--machines", kDug->machines, "How many").check(ensemble_size_error);
  c.add_option("--weight", kDug->weight, "Of what is dug");
  c.add_option("--jobs", kDug->jobs, "At once").check(count_within(0, 1024));
  c.add_option("--depth", kDug->depths, "Each").one_value_each();
  c.add_option("--place", kDug->places, "Each").one_value_each();
  c.add_option("--mode", kDug->mode, "How").one_of({"echo", "cues"});
  c.add_option("--map", kDug->map, "File");
  c.add_flag("--mute", kDug->mute, "No sound");
  return [] { return 3; };
}

const Program kTool{"arm-tool", "Moves arms.\n", "", {{"dig", "A pit", declare_dig}}};

/// "": accepted.
std::string refusal(const std::vector<std::string>& arguments) {
  *kDug = {};
  return test::refusal([&] { (void)parse_command_line(kTool, arguments); });
}

TEST(CommandLineOptions, AreRefusedInWordsOfTheProgram) {
  struct Row {
    std::vector<std::string> given;
    std::string why;
  };
  for (const Row& row :
       {Row{{"--slow", "fast"}, "--slow fast: is not a number"},
        {{"--slow", "1,5"}, "--slow 1,5: is not a number: decimals need a point, not a comma"},
        {{"--slow", "1e400"}, "--slow 1e400: is larger or smaller than any number of this computer"},
        {{"--slow="}, "--slow: needs a value"},
        {{"--slow", "1", "--slow", "2"}, "--slow: is given more than once"},
        {{"--slow=1", "--slow=2"}, "--slow: is given more than once"},
        {{"--weight", "-1"}, "--weight -1: must be a whole number from 0 to 4294967295"},
        {{"--depth", "1", "--depth", "two"}, "--depth two: is not a number"},
        {{"--seed", "-1"}, "--seed -1: must be a whole number from 0 to 18446744073709551615"},
        {{"--seed", "18446744073709551616"},
         "--seed 18446744073709551616: must be a whole number from 0 to 18446744073709551615"},
        {{"--machines", "1"}, "--machines 1: must be a whole number from 2 to 10000 machines, or 0: none"},
        {{"--machines", "nan"}, "--machines nan: must be a whole number from 2 to 10000 machines, or 0: none"},
        {{"--jobs", "1e9"}, "--jobs 1e9: must be a whole number from 0 to 1024"},
        {{"--jobs", ""}, "--jobs \"\": must be a whole number from 0 to 1024"},
        {{"--mode", "telepathy"}, "--mode telepathy: not in {echo,cues}"},
        {{"--mute=1"}, "--mute: takes no value"},
        {{"--map"}, "--map: needs a value"},
        {{"--map", "--mute"}, "--map: needs a value"},
        {{"--map", "--no-such"}, "--map: needs a value"},
        {{"--map", "-h"}, "--map: needs a value"},
        {{"--slow", "--mute"}, "--slow: needs a value"},
        {{"--place", "a", "--place", "--mute"}, "--place: needs a value"},
        {{"--duraton", "3"}, "--duraton: unknown option"},
        {{"--sed", "3"}, "--sed: unknown option; did you mean '--seed'?"}}) {
    std::vector<std::string> arguments{"dig", "--pit", "deep"};
    arguments.insert(arguments.end(), row.given.begin(), row.given.end());
    EXPECT_EQ(refusal(arguments), row.why + " (see arm-tool dig --help)");
  }
  EXPECT_EQ(refusal({"dig"}), "--pit is required (see arm-tool dig --help)");
  EXPECT_EQ(refusal({"dig", "--pit", ""}), "--pit \"\": must not be empty");
  EXPECT_EQ(refusal({"--versoin"}), "--versoin: unknown option; did you mean '--version'? (see arm-tool --help)");
  EXPECT_EQ(refusal({"--zzz", "dig"}), "--zzz: unknown option (see arm-tool --help)");
  EXPECT_EQ(refusal({"dug"}), "unknown command 'dug': the commands are dig (see arm-tool --help)");
}

TEST(CommandLineOptions, TakeWhatIsANumberOrAWordOfTheirs) {
  EXPECT_EQ(refusal({"dig",        "--pit", "deep",    "--slow", "-1.5e-3", "--seed=18446744073709551615",
                     "--machines", "0",     "--jobs",  "7",      "--depth", "1",
                     "--depth",    "-2",    "--place", "a b",    "--place", "c",
                     "--mode",     "cues",  "--mute"}),
            "accepted");
  EXPECT_EQ(kDug->slow, -1.5e-3);
  EXPECT_EQ(kDug->seed, 18446744073709551615U);
  EXPECT_EQ(kDug->jobs, 7);
  EXPECT_EQ(kDug->depths, (std::vector<double>{1, -2}));
  EXPECT_EQ(kDug->places, (std::vector<std::string>{"a b", "c"}));
  EXPECT_EQ(kDug->mode, "cues");
  EXPECT_TRUE(kDug->mute);
  EXPECT_EQ(refusal({"dig", "--pit", "-", "--map=--mute", "--place", "-x"}), "accepted");
  EXPECT_EQ(kDug->pit, "-");
  EXPECT_EQ(kDug->map, "--mute");
  EXPECT_EQ(kDug->places, std::vector<std::string>{"-x"});
  EXPECT_FALSE(kDug->mute);
}

TEST(Places, RefuseWhateverAnOutputWouldReplace) {
  const test::TemporaryFolder folder;
  const auto content = [&folder](const std::string& name, const std::string& text) {
    std::ofstream(folder.file(name)) << text;
  };
  content("device.toml", "mine");
  content("kept", "mine");
  content("key.bin", "-----BEGIN PRIVATE KEY-----\nMC4C\n");
  content("ec.bin", "-----BEGIN CERTIFICATE-----\nMC4C\n-----END CERTIFICATE-----\n-----BEGIN EC PRIVATE KEY-----\n");
  content("trail.bin",
          "{\"n\":1,\"utc\":\"2026-11-21T05:00:00.000Z\",\"mono_s\":1.5,\"event\":\"file\",\"before\":\"00\"}\n");
  content("log.bin", "\x89MCAP0\r\n\x01");
  content("a.csv", "of before");
  content("valve.EDS", "[FileInfo]\n");
  const std::string messages(10'000, '\n');
  content("maker.DBC", "VERSION \"\"\n" + messages + "CM_ \"Made by hand.\";\n");
  content("own.dbc",
          "VERSION \"\"\n" + messages + "CM_ \"CANopen bus of a. Written by knuckle 0.1.0 from a.toml.\";\n");
  content("empty.dbc", "");
  std::filesystem::create_symlink(folder.file("device.toml"), folder.file("link.csv"));
  std::filesystem::create_symlink(folder.file("kept"), folder.file("link.json"));
  const Program keeps{"tool", "", "", {}, {[](const std::filesystem::path& place) {
                        return place.filename() == "kept" ? "is named like what is kept" : nullptr;
                      }}};
  (void)parse_command_line(keeps, {});
  const auto refused = [&](const std::string& name, void (Places::*use)(const std::string&, const std::string&)) {
    return test::refusal([&] {
      Places places;
      places.input("--map", folder.file("map.csv"));
      places.output("--csv", folder.file("taken.csv"));
      places.output("--report", "-");
      (places.*use)("--json", name.starts_with('-') || name.starts_with('/') ? name : folder.file(name));
    });
  };
  const std::pair<const char*, const char*> table[] = {
      {"device.toml", "is named like a machine or other configuration file: choose another name"},
      {"link.csv", "configuration file"},
      {"new.toml", "configuration file"},
      {"kept", "kept: is named like what is kept: choose another name"},
      {"link.json", "is named like what is kept"},
      {"new/kept", "is named like what is kept"},
      {"key.bin", "holds a private key"},
      {"ec.bin", "holds a private key"},
      {"trail.bin", "holds an audit trail"},
      {"log.bin", "holds a recording: choose another name"},
      {"valve.EDS", "is a vendor's device file: choose another name"},
      {"maker.DBC", "is a DBC that Knuckle did not write: choose another name"},
      {"own.dbc", "accepted"},
      {"empty.dbc", "accepted"},
      {"new.dbc", "accepted"},
      {"map.csv", "already taken by --map"},
      {"./taken.csv", "already taken by --csv"},
      {"-", "already taken by --report: only one output can be standard output"},
      {"/dev/stdout", "only one output can be standard output"},
      {"a.csv", "accepted"},
  };
  for (const auto& [name, said] : table) EXPECT_TRUE(test::says(refused(name, &Places::output), said));
  EXPECT_TRUE(test::says(refused("a.csv", &Places::configuration_output), "must end in .toml"));
  EXPECT_EQ(refused("device.toml", &Places::configuration_output), "accepted");
  (void)parse_command_line(kTool, {});
}

}  // namespace
}  // namespace knuckle::cli
