// `knuckle bus migrate`: the same machine with its nodes in [[bus.node]] tables.
#include "app/eds/migrate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "machine/load.h"
#include "recording/recording.h"
#include "tests/eds/bus_program.h"
#include "tests/eds/machine_texts.h"
#include "tests/support/refusal.h"

namespace knuckle::eds {
namespace {

using test::keyed;
using test::replaced;
using test::says;
using test::shipped_text;
using test::with_crlf;

std::string migrated(const std::string& text) {
  return with_node_tables(text, "my.toml");
}
std::string refusal_of(const std::string& text) {
  return test::refusal([&] { (void)migrated(text); });
}
std::vector<std::string> comments_of(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (const auto at = line.find('#'); at != std::string::npos) all.push_back(line.substr(at));
  return all;
}

const std::string kBoom =
    "boom_valve           = { id = 0x10, device_type = 0x0198, vendor = 0x4B4E, product = 0x0408 }\n";
const std::string kTilt =
    "tilt                 = { id = 0x38, device_type = 0x019A, vendor = 0x4B4E, product = 0x0410 }\n";
const std::string kBoomKeys = "id = 0x10\ndevice_type = 0x0198\nvendor = 0x4B4E\nproduct = 0x0408\n";
/// Shipped files, by name, whose sensors are all nodes: the older words know no broadcasts.
std::vector<std::pair<std::string, std::string>> shipped_of_nodes() {
  std::vector<std::pair<std::string, std::string>> all;
  for (const auto& file : std::filesystem::directory_iterator(test::source_dir() + "/config/machines")) {
    if (file.path().extension() != ".toml") continue;
    const std::string text = whole_file(file.path(), 1);
    if (text.find("[[bus.broadcast]]") == std::string::npos) all.emplace_back(file.path().filename(), text);
  }
  return all;
}

/// Machine files in the older words: shipped ones, those in recordings, and with all that a node or the bus may say.
std::vector<std::pair<std::string, std::string>> older_files() {
  std::vector<std::pair<std::string, std::string>> all;
  for (const auto& [name, text] : shipped_of_nodes()) all.emplace_back(name, test::with_keyed_nodes(text));
  for (const auto& file : std::filesystem::directory_iterator(test::source_dir() + "/tests/recordings_replayed"))
    if (file.path().extension() == ".mcap")
      all.emplace_back(file.path().filename(),
                       test::with_keyed_nodes(recording::Recording({file.path().string()}).head().machine_file));
  std::string full = replaced(keyed(), "id = 0x11, ", "tpdo = 0x2A1, rpdo = 0x321, id = 0x11, profile = \"cia408\", ");
  full = replaced(full, "id = 0x12, ", "id = 0x12, profile = 'cia408/pved', ");
  full = replaced(full, "id = 0x38, ", "id = 5_6, tpdo = 0x2B8,");
  full = replaced(full, "[bus.nodes]\n",
                  "[bus.wire]\nvalve_full_stroke = 1000\npressure_value = \"float\"\n[bus.nodes]\n");
  all.emplace_back("with profiles, frames and scalings", full);
  return all;
}

TEST(BusMigrate, KeepsTheModelAndTheCommentsOfEveryFileAndChangesNothingTheSecondTime) {
  const auto files = older_files();
  EXPECT_GE(files.size(), 6U);
  for (const auto& [name, text] : files) {
    const std::string after = migrated(text);
    EXPECT_EQ(parse_machine(after, "my.toml").bus, parse_machine(text, "my.toml").bus) << name;
    EXPECT_EQ(comments_of(after), comments_of(text)) << name;
    EXPECT_FALSE(says(after, "bus.nodes")) << name;
    EXPECT_EQ(migrated(after), after) << name;
    const auto begin = text.find("[bus.nodes]"), end = text.find("\n[limits]");
    EXPECT_EQ(after.substr(0, begin), text.substr(0, begin)) << name;
    EXPECT_TRUE(after.ends_with(text.substr(end))) << name;
  }
}

TEST(BusMigrate, KeepsCommentsWhereTheyStood) {
  std::string text = replaced(keyed(), "[bus.nodes]\n", "[bus.nodes]   # as wired\n# Valves { first = 1 }\n\n");
  text = replaced(text, kBoom, "boom_valve={vendor=0x4b4E,id=0x10 ,product= 0x0408,device_type=408} # a } # b\n");
  text = replaced(text, kTilt, kTilt + "  # the last\n");
  EXPECT_TRUE(says(migrated(text),
                   "controller_id = 1\n# as wired\n# Valves { first = 1 }\n\n[[bus.node]]\n"
                   "name = \"boom_valve\"  # a } # b\nprofile = \"cia408\"\n"
                   "channels = { 1 = \"boom_spool\" }\nvendor = 0x4b4E\nid = 0x10\nproduct = 0x0408\n"
                   "device_type = 408\n\n[[bus.node]]\n"));
  EXPECT_TRUE(says(migrated(text), "product = 0x0410\n\n  # the last\n[[bus.node]]\nname = \"enable\"\n"));
  EXPECT_EQ(comments_of(migrated(text)), comments_of(text));
}

TEST(BusMigrate, KeepsLineEndsTheMissingLastOneAndRecordsBehind) {
  EXPECT_EQ(migrated(with_crlf(keyed())), with_crlf(migrated(keyed())));
  const std::string commented = replaced(keyed(), "[bus.nodes]\n" + kBoom,
                                         "[bus.nodes]  # all\n# one\n\n" + replaced(kBoom, "}\n", "}  # two\n"));
  EXPECT_EQ(migrated(with_crlf(commented)), with_crlf(migrated(commented)));
  const std::string own = replaced(keyed(), kBoom, "") + "\n[bus.nodes.boom_valve]  # own\n" + kBoomKeys;
  EXPECT_EQ(migrated(with_crlf(own)), with_crlf(migrated(own)));
  const std::string record =
      "\n[commissioning]\nbus = \"can0\"\n[[commissioning.nodes]]\nid = 0x10\nname = \"boom_valve\"";
  EXPECT_EQ(migrated(keyed() + record), migrated(keyed()) + record);
  // The nodes are the end of the file.
  std::string last = keyed();
  const auto begin = last.find("[bus.nodes]"), end = last.find("\n[limits]");
  const std::string nodes = last.substr(begin, end - begin);
  last = last.erase(begin, end - begin) + nodes.substr(0, nodes.find_last_not_of('\n') + 1);
  EXPECT_TRUE(migrated(last).ends_with("product = 0x0401"));
  EXPECT_TRUE(migrated(last + '\n').ends_with("product = 0x0401\n"));
}

TEST(BusMigrate, TakesANodeThatIsATableOfItsOwnWithItsKeysAndComments) {
  const std::string keys =
      "\n# wired last\nid = 0x10   # switches\ndevice_type = 0x0198\nvendor = 0x4B4E\nproduct = 0x0408\n";
  const std::string opening = "name = \"boom_valve\"\n", channels = "channels = { 1 = \"boom_spool\" }\n";
  std::string text = replaced(keyed(), kBoom, "") + "\n[bus.nodes.boom_valve] # [own]\n" + keys;
  EXPECT_TRUE(
      migrated(text).ends_with("\n[[bus.node]] # [own]\n" + opening + "profile = \"cia408\"\n" + channels + keys))
      << migrated(text);
  EXPECT_EQ(parse_machine(migrated(text), "my.toml").bus, parse_machine(keyed(), "my.toml").bus);
  text += "profile = \"cia408/pved\"  # says its plate\n";
  EXPECT_TRUE(migrated(text).ends_with("\n[[bus.node]] # [own]\n" + opening + channels + keys +
                                       "profile = \"cia408/pved\"  # says its plate\n"));
  EXPECT_EQ(parse_machine(migrated(text), "my.toml").bus.valve(0).profile, ValveProfile::kPved);
}

TEST(BusMigrate, RefusesInOneLineWhatItCannotRewrite) {
  const std::string needs = "needs boom_valve = { ... } on one line in [bus.nodes], or [bus.nodes.boom_valve]";
  std::string dotted = keyed(), keys;
  std::istringstream lines(kBoomKeys);
  for (std::string line; std::getline(lines, line);) keys += "boom_valve." + line + '\n';
  dotted = replaced(dotted, kBoom, keys);
  const auto line = std::count(dotted.begin(), dotted.begin() + static_cast<std::ptrdiff_t>(dotted.find(keys)), '\n');
  EXPECT_EQ(refusal_of(dotted), "my.toml: line " + std::to_string(line + 1) + ": " + needs);
  std::string in_bus = replaced(keyed(), "[bus.nodes]\n", "");
  for (const NodeDescription& node : parse_machine(keyed(), "my.toml").bus.nodes)
    in_bus = replaced(in_bus, "\n" + node.name + " ", "\nnodes." + node.name + " ");
  EXPECT_EQ(parse_machine(in_bus, "my.toml").bus, parse_machine(keyed(), "my.toml").bus);
  EXPECT_EQ(refusal_of(in_bus), "my.toml: " + needs);
  // A text of many lines that looks like nodes is none.
  EXPECT_TRUE(says(refusal_of(keyed() + "\n[commissioning]\nnote = '''\n[bus.nodes]\n'''\n"), "my.toml: line "));
  EXPECT_TRUE(says(refusal_of("name = \"a\"\n"), "my.toml"));
}

TEST(BusMigrate, TheOlderWordsOfAShippedFileSayTheSameBus) {
  for (const auto& [name, text] : shipped_of_nodes()) {
    const std::string before = test::with_keyed_nodes(text);
    EXPECT_EQ(parse_machine(before, "my.toml").bus, parse_machine(text, "my.toml").bus) << name;
  }
}

TEST(BusMigrateProgram, ChangesTheFileAndKeepsTheOlderOne) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("my.toml");
  std::ofstream(file) << keyed();
  const auto run = [&] {
    const auto ran = test::run_bus({"migrate", "--machine", file});
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return ran.out;
  };
  EXPECT_EQ(run(), file + ": its nodes are [[bus.node]] tables (before: " + folder.file("my.1.toml") + ")\n");
  EXPECT_EQ(test::content(file), migrated(keyed()));
  EXPECT_EQ(test::content(folder.file("my.1.toml")), keyed());
  EXPECT_EQ(run(), file + ": its nodes are [[bus.node]] tables already: nothing changed\n");
  EXPECT_EQ(test::content(file), migrated(keyed()));
  EXPECT_FALSE(std::filesystem::exists(folder.file("my.2.toml")));
}

TEST(BusMigrateProgram, RefusesBadInputInOneLineAndWritesNothing) {
  const test::TemporaryFolder folder;
  const std::string file = folder.file("my.toml"), bad = replaced(keyed(), "id = 0x10", "id = 0x80");
  std::ofstream(file) << bad;
  const auto refused = [](const std::string& machine, const std::string& why) {
    const auto ran = test::run_bus({"migrate", "--machine", machine});
    EXPECT_EQ(ran.exit_code, 2) << machine;
    EXPECT_TRUE(says(ran.err, why));
    EXPECT_EQ(std::count(ran.err.begin(), ran.err.end(), '\n'), 1) << ran.err;
  };
  refused(file, "key 'bus.nodes.boom_valve.id' = 0x80: must be a whole number within [1, 127]");
  EXPECT_EQ(test::content(file), bad);
  EXPECT_FALSE(std::filesystem::exists(folder.file("my.1.toml")));
  refused(folder.file("none.toml"), "none.toml");
  refused("solar015", "is a machine that comes with Knuckle: copy its file first");
}

}  // namespace
}  // namespace knuckle::eds
