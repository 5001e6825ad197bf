// Who may include whom, read from the #include lines of the tree; and files that would only work on one computer.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/places.h"

namespace knuckle {
namespace {

namespace fs = std::filesystem;

/// What a subject may include besides itself: whole subjects, or single headers. A subject is the longest of these
/// names that a file's path begins with.
using Table = std::map<std::string, std::set<std::string>>;

std::set<std::string> operator+(std::set<std::string> some, const std::set<std::string>& more) {
  some.insert(more.begin(), more.end());
  return some;
}

Table make_table() {
  const std::set<std::string> loops{"core", "machine", "transport", "estimation", "slave", "sim"};
  const std::set<std::string> tables{"core", "machine", "estimation", "app/cli", "app/recordings"};
  const std::set<std::string> screens =
      loops + std::set<std::string>{"master", "recording", "video", "app/session", "app/console"};
  Table table{
      {"core", {}},
      {"machine", {"core"}},
      {"transport", {"core"}},
      {"transport/secure", {"core", "transport"}},
      {"transport/ice", {"core", "transport", "transport/secure"}},
      {"recording/mcap", {"core"}},
      {"video", {"core"}},
      {"estimation", {"core", "machine"}},
      {"master", {"core", "machine", "transport"}},
      {"slave", {"core", "machine", "transport", "estimation"}},
      {"sim",
       {"core", "transport", "machine/description.h", "machine/description_fwd.h", "machine/arm_description.h",
        "machine/bus_description.h", "machine/device_description.h"}},
      {"recording", {"core", "machine", "transport", "master", "slave", "recording/mcap"}},
      {"app/cli", {"core"}},
      {"app/pairing", {"core", "machine/toml_reader.h", "transport", "transport/secure", "transport/ice", "app/cli"}},
      {"app/rendezvous", {"core", "transport", "transport/secure", "transport/ice", "app/cli"}},
      {"app/audit", {"core", "app/cli"}},
      {"app/recordings",
       {"core", "machine", "estimation", "slave/slave_state.h", "recording", "recording/mcap", "app/cli"}},
      {"app/session", loops + tables + std::set<std::string>{"master", "recording"}},
      {"app/explain",
       {"core", "machine", "transport", "estimation", "master", "slave", "app/cli", "recording", "recording/mcap"}},
      {"app/replay", {"core", "machine", "app/cli", "recording", "recording/mcap"}},
      {"app/operators", {"core", "machine", "transport", "master", "slave", "recording", "app/cli"}},
      {"app/motion", loops + std::set<std::string>{"app/cli"}},
      {"app/report", tables + std::set<std::string>{"app/session"}},
      {"app/bringup",
       loops + tables + std::set<std::string>{"app/motion", "transport/secure", "app/pairing", "recording"}},
      {"app/identify", tables + std::set<std::string>{"sim", "app/motion", "app/report", "app/session/truth_file.h"}},
      {"app/battery", tables + std::set<std::string>{"sim", "app/session", "app/report"}},
      {"app/check", tables + std::set<std::string>{"sim", "transport", "app/session", "app/report", "app/battery"}},
      {"app/programs",
       loops + tables +
           std::set<std::string>{"master", "recording", "app/session", "app/report", "app/bringup", "app/battery",
                                 "app/pairing", "transport/secure", "app/audit", "video"}},
      {"app/export",
       {"core", "machine", "transport", "estimation", "slave", "recording", "recording/mcap", "master", "app/cli",
        "app/recordings", "app/report/html.h"}},
      {"app/relay",
       {"core", "machine/load.h", "transport", "app/cli", "app/programs/program_console.h",
        "app/programs/program_options.h", "app/session/link_file.h"}},
      {"app/studies",
       tables + std::set<std::string>{"sim", "app/motion", "app/report", "app/identify", "app/session", "app/battery"}},
      {"app/console/player", screens + std::set<std::string>{"app/replay"}},
      {"app/console/widgets", screens},
      {"app/console/picture", screens + std::set<std::string>{"app/console/widgets"}},
      {"app/console/screens", screens + std::set<std::string>{"app/replay", "app/console/player", "app/console/widgets",
                                                              "app/console/picture"}},
  };
  table["app/console"] = table["app/programs"] + std::set<std::string>{"app/programs"};
  table["app/console/window"] =
      table["app/console"] + table["app/console/screens"] + std::set<std::string>{"app/console/screens"};
  std::set<std::string> everything;
  for (const auto& [subject, may] : table) everything.insert(subject);
  table["app"] = everything;  // main() alone
  return table;
}

const Table kTable = make_table();

/// Empty where the path is in none.
std::string subject_of(const std::string& path) {
  std::string longest;
  for (const auto& [subject, may] : kTable) {
    if (path.rfind(subject + '/', 0) == 0 && subject.size() > longest.size()) longest = subject;
  }
  return longest;
}

/// One line per #include in text that the table forbids to a file of this subject.
std::vector<std::string> violations(const std::string& subject, const std::string& file, const std::string& text) {
  static const std::regex include_line(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<std::string> found;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::smatch match;
    if (!std::regex_search(line, match, include_line)) continue;
    const std::string header = match[2];
    const std::string target = subject_of(header);
    const std::string at = file + ":" + std::to_string(number) + ": ";
    if (match[1] == "\"" && target.empty()) {
      found.push_back(at + "\"" + header + "\" is not FOLDER/FILE of this project");
    } else if (!target.empty() && target != subject && !kTable.at(subject).contains(target) &&
               !kTable.at(subject).contains(header)) {
      found.push_back(at + subject + " may not include " + header);
    }
  }
  return found;
}

/// Namespaces that a subject's files may open, besides unnamed ones: its own and what is inside it; and of core and
/// machine and transport, which hold what everything is made of, that of the project. What is inside app, transport or
/// recording is named without them.
bool belongs(const std::string& subject, const std::string& name) {
  const bool common = subject == "core" || subject == "machine" || subject == "transport" || subject == "app";
  std::string own = "knuckle";
  if (!common) own += "::" + std::regex_replace(subject, std::regex("^(app|transport|recording)/"), "");
  own = std::regex_replace(own, std::regex("/"), "::");
  own = std::regex_replace(own, std::regex("::export$"), "::exporting");  // a keyword names no namespace
  own = std::regex_replace(own, std::regex("::check$"), "::checking");    // a function is called so
  return name == own || name.rfind(own + "::", 0) == 0;
}

/// One line per namespace in text that is another subject's.
std::vector<std::string> strangers(const std::string& subject, const std::string& file, const std::string& text) {
  static const std::regex opening(R"(^namespace (knuckle[a-z_:]*) \{)");
  std::vector<std::string> found;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::smatch match;
    if (!std::regex_search(line, match, opening) || belongs(subject, match[1])) continue;
    found.push_back(file + ":" + std::to_string(number) + ": " + subject + " may not define in " + match[1].str());
  }
  return found;
}

std::string contents(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// Every file of the tree but builds, outputs and git's own.
std::vector<fs::path> project_files(const fs::path& root) {
  const std::set<std::string> skipped{".git", "build", "out"};
  std::vector<fs::path> files;
  for (auto it = fs::recursive_directory_iterator(root); it != fs::recursive_directory_iterator(); ++it) {
    if (it.depth() == 0 && skipped.contains(it->path().filename().string())) {
      it.disable_recursion_pending();
    } else if (it->is_regular_file()) {
      files.push_back(fs::relative(it->path(), root));
    }
  }
  return files;
}

bool is_source(const fs::path& path) {
  return path.extension() == ".h" || path.extension() == ".cpp";
}

/// Directories that exist on one computer only, such as somebody's home.
bool names_a_private_path(const std::string& text) {
  static const std::regex path(R"((^|[\s"'`=(:,>])/(home|root|work|workspace|Users|mnt)/)");
  return std::regex_search(text, path);
}

TEST(IncludeTable, EveryFileIncludesAndDefinesOnlyWhatItsSubjectMay) {
  const fs::path root = test::source_dir();
  int checked = 0;
  for (const fs::path& file : project_files(root)) {
    const std::string subject = subject_of(file.generic_string());
    if (!is_source(file) || subject.empty()) continue;
    ++checked;
    const std::string text = contents(root / file);
    for (const std::string& line : violations(subject, file.generic_string(), text)) ADD_FAILURE() << line;
    for (const std::string& line : strangers(subject, file.generic_string(), text)) ADD_FAILURE() << line;
  }
  EXPECT_GT(checked, 10) << "no sources under " << root;
}

TEST(IncludeTable, SeesWhatItForbids) {
  EXPECT_EQ(violations("sim", "sim/plant.h", "#include \"machine/description.h\"\n#include <cmath>\n").size(), 0u);
  EXPECT_EQ(violations("sim", "sim/plant.h", "\n#include \"machine/kinematics.h\"\n"),
            std::vector<std::string>{"sim/plant.h:2: sim may not include machine/kinematics.h"});
  EXPECT_EQ(violations("master", "master/a.cpp", "#include \"slave/loop.h\"").size(), 1u);
  EXPECT_EQ(violations("master", "master/a.cpp", "#include \"estimation/force_estimator.h\"").size(), 1u);
  EXPECT_EQ(violations("slave", "slave/a.cpp", "  #  include <master/loop.h>").size(), 1u);
  EXPECT_EQ(violations("core", "core/a.cpp", "#include \"local.h\"").size(), 1u);
  EXPECT_EQ(violations("app/session", "app/session/a.cpp", "#include \"app/report/html.h\"").size(), 1u);
  EXPECT_EQ(violations("app/programs", "app/programs/a.cpp", "#include \"app/studies/sweep.h\"").size(), 1u);
  EXPECT_EQ(violations("app/console", "app/console/a.cpp", "#include \"app/console/window/window.h\"").size(), 1u);
  EXPECT_EQ(violations("app/console/window", "app/console/window/a.cpp", "#include \"app/console/keys.h\"").size(), 0u);
}

TEST(IncludeTable, SeesADefinitionInTheNamespaceOfAnotherSubject) {
  EXPECT_EQ(strangers("app/report", "app/report/a.h", "namespace knuckle::report {\nnamespace {\n").size(), 0u);
  EXPECT_EQ(strangers("app/report", "app/report/a.h", "\nnamespace knuckle::session {\n"),
            std::vector<std::string>{"app/report/a.h:2: app/report may not define in knuckle::session"});
  EXPECT_EQ(strangers("app/console/window", "a.h", "namespace knuckle::console::window {\n").size(), 0u);
  EXPECT_EQ(strangers("transport/secure", "a.h", "namespace knuckle::secure {\n").size(), 0u);
  EXPECT_EQ(strangers("transport/secure", "a.h", "namespace knuckle {\n").size(), 1u);
  EXPECT_EQ(strangers("app/console/window", "a.h", "namespace knuckle::console {\n").size(), 1u);
  EXPECT_EQ(strangers("app/report", "a.h", "namespace knuckle {\n").size(), 1u);
  EXPECT_EQ(strangers("app/export", "a.h", "namespace knuckle::exporting {\n").size(), 0u);
}

/// Who may make the frame that opens a valve: its codec, and one function that takes what a gate let pass.
TEST(ValveFrames, AreMadeFromWhatAGatePassedAndNowhereElse) {
  const fs::path root = test::source_dir();
  const std::string call = std::string("valve_command") + "_frame(";
  std::set<std::string> makers;
  for (const fs::path& file : project_files(root)) {
    const bool program = !subject_of(file.generic_string()).empty();
    if (program && is_source(file) && contents(root / file).find(call) != std::string::npos) {
      makers.insert(file.generic_string());
    }
  }
  EXPECT_EQ(makers, (std::set<std::string>{"slave/valve_frame.h", "transport/canopen.cpp", "transport/canopen.h"}));
  EXPECT_NE(contents(root / "slave/valve_frame.h").find("const PassedCommands&"), std::string::npos);
}

/// Each costs every file that includes it seconds of compiling.
TEST(HeavyHeaders, AreIncludedByFewFilesOfTheProgram) {
  const fs::path root = test::source_dir();
  std::set<std::string> command_lines, json;
  for (const fs::path& file : project_files(root)) {
    if (!is_source(file) || !file.generic_string().starts_with("app/")) continue;
    const std::string text = contents(root / file);
    if (text.find("#include <CLI/CLI.hpp>") != std::string::npos) command_lines.insert(file.generic_string());
    if (text.find("#include <nlohmann/json.hpp>") != std::string::npos)
      json.insert(file.parent_path().generic_string());
  }
  EXPECT_EQ(command_lines, (std::set<std::string>{"app/cli/command.cpp", "app/cli/manual.cpp", "app/cli/options.cpp"}));
  // Those that read JSON; what is only written is put together by app/cli/json.h.
  EXPECT_EQ(json, (std::set<std::string>{"app/audit", "app/battery", "app/bringup", "app/cli", "app/studies"}));
}

TEST(ProjectFiles, NameNoPrivatePath) {
  const fs::path root = test::source_dir();
  for (const fs::path& file : project_files(root)) {
    EXPECT_FALSE(names_a_private_path(contents(root / file))) << file << " names a directory of one computer";
  }
}

TEST(ProjectFiles, PrivatePathsAreSeen) {
  EXPECT_TRUE(names_a_private_path(std::string("see \"/") + "home/ann/x.csv\""));
  EXPECT_TRUE(names_a_private_path(std::string("DIR=/") + "root/build"));
  EXPECT_FALSE(names_a_private_path("/usr/share/doc and ~/.cache"));
  EXPECT_FALSE(names_a_private_path(std::string("tests/") + "work/x"));
}

}  // namespace
}  // namespace knuckle
