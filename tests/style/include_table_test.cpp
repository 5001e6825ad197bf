// Who may include whom, read from the #include lines of the tree; files that would only work on one computer; and links
// of the documentation that lead nowhere.
#include <gtest/gtest.h>

#include <cctype>
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

/// A subject is the longest of these names that a file's path begins with. Outside app: what each may include besides
/// itself, whole subjects or single headers.
using Table = std::map<std::string, std::set<std::string>>;
const Table kOutsideApp{
    {"core", {}},
    {"machine",
     {"core", "transport/canopen.h", "transport/can_load.h", "transport/frame_checksum.h", "transport/j1939.h",
      "transport/signal_codec.h"}},
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
};

/// Inside app: each subject may include what is outside app, and of app what stands on lower floors: not its
/// neighbours.
const std::vector<std::set<std::string>> kFloorsOfApp{
    {"app/cli"},
    {"app/pairing", "app/rendezvous", "app/audit", "app/motion", "app/recordings", "app/explain", "app/operators"},
    {"app/session", "app/bringup", "app/eds", "app/replay"},
    {"app/report"},
    {"app/battery", "app/identify", "app/export"},
    {"app/check", "app/programs", "app/studies"},
    {"app/relay", "app/console"},
    {"app/console/widgets", "app/console/player"},
    {"app/console/picture"},
    {"app/console/screens"},
    {"app/console/window"},
    {"app"},  // the main files
};

Table make_table() {
  Table table = kOutsideApp;
  std::set<std::string> below;
  for (const auto& [subject, may] : kOutsideApp) below.insert(subject);
  for (const std::set<std::string>& floor : kFloorsOfApp) {
    for (const std::string& subject : floor) table[subject] = below;
    below.insert(floor.begin(), floor.end());
  }
  table["app/cli"] = {"core"};
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
  own = std::regex_replace(own, std::regex("::widgets$"), "");            // what every part of the console draws with
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

/// Text without its blocks of code.
std::string prose(const std::string& markdown) {
  std::string text, line;
  bool code = false;
  for (std::istringstream lines(markdown); std::getline(lines, line);) {
    if (line.rfind("```", 0) == 0)
      code = !code;
    else if (!code)
      text += line + '\n';
  }
  return text;
}

/// Anchors of a page's headings, made as GitHub makes them.
std::set<std::string> anchors(const std::string& markdown) {
  std::set<std::string> found;
  std::string line;
  for (std::istringstream lines(prose(markdown)); std::getline(lines, line);) {
    if (line.empty() || line[0] != '#') continue;
    std::string anchor;
    for (const char c : line.substr(line.find_first_not_of("# "))) {
      if (c == ' ')
        anchor += '-';
      else if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
        anchor += static_cast<char>(std::tolower(c));
    }
    found.insert(anchor);
  }
  return found;
}

/// Links in a text to files that are not there, or to headings that their page has not: [..](PAGE#ANCHOR) of a page,
/// and docs/PAGE#ANCHOR wherever it is written.
std::vector<std::string> dead_links(const fs::path& root, const fs::path& file, const std::string& text) {
  static const std::regex link(R"(\]\(([^)#\s]*)(#[^)\s]*)?\))"), mention(R"((docs/[a-z-]+\.md)(#[a-z0-9-]+)?)");
  std::vector<std::string> dead;
  const auto check = [&](const fs::path& target, const std::string& anchor) {
    const bool there = fs::exists(target);
    if (there && (anchor.empty() || anchors(contents(target)).contains(anchor.substr(1)))) return;
    dead.push_back(file.generic_string() + ": " + fs::relative(target, root).generic_string() + anchor);
  };
  const bool page = file.extension() == ".md";
  const std::string read = page ? prose(text) : text;
  for (auto it = std::sregex_iterator(read.begin(), read.end(), page ? link : mention); it != std::sregex_iterator();
       ++it) {
    const std::string target = (*it)[1], anchor = (*it)[2];
    if (target.find("://") != std::string::npos || (page && target.empty() && anchor.empty())) continue;
    const fs::path base = page ? (root / file).parent_path() : root;
    check(target.empty() ? root / file : (base / target).lexically_normal(), anchor);
  }
  return dead;
}

TEST(IncludeTable, EveryFileIncludesAndDefinesOnlyWhatItsSubjectMay) {
  const fs::path root = test::source_dir();
  int checked = 0;
  for (const fs::path& file : project_files(root)) {
    const std::string subject = subject_of(file.generic_string());
    if (!is_source(file) || subject.empty()) continue;
    ++checked;
    EXPECT_EQ(file.parent_path() == "app", subject == "app") << file << " stands on no floor of app";
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
  EXPECT_EQ(violations("app/cli", "app/cli/a.cpp", "#include \"machine/load.h\"").size(), 1u);
  EXPECT_EQ(violations("slave", "slave/a.cpp", "#include \"app/cli/json.h\"").size(), 1u);
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
TEST(HeavyHeaders, AreIncludedByFewFiles) {
  const fs::path root = test::source_dir();
  std::set<std::string> command_lines, json, expressions;
  for (const fs::path& file : project_files(root)) {
    if (!is_source(file)) continue;
    const std::string text = contents(root / file);
    const std::string name = file.generic_string();
    if (name.starts_with("tests/") && text.find("\n#include <regex>") != std::string::npos) expressions.insert(name);
    if (!name.starts_with("app/")) continue;
    if (text.find("#include <CLI/CLI.hpp>") != std::string::npos) command_lines.insert(name);
    if (text.find("#include <nlohmann/json.hpp>") != std::string::npos)
      json.insert(file.parent_path().generic_string());
  }
  EXPECT_EQ(command_lines, (std::set<std::string>{"app/cli/command.cpp", "app/cli/manual.cpp", "app/cli/options.cpp"}));
  EXPECT_EQ(expressions,
            (std::set<std::string>{"tests/console/window/imperial_test.cpp", "tests/style/include_table_test.cpp",
                                   "tests/support/candump.cpp", "tests/support/patterns.cpp"}));
  // Those that read JSON; what is only written is put together by app/cli/json.h.
  EXPECT_EQ(json, (std::set<std::string>{"app/audit", "app/battery", "app/bringup", "app/cli", "app/studies"}));
}

TEST(Pages, EveryLinkLeadsToAFileAndAHeadingThatAreThere) {
  const fs::path root = test::source_dir();
  for (const fs::path& file : project_files(root)) {
    // This file has dead links on purpose; a recording has the files that it was made with.
    if (file.filename() == "include_table_test.cpp" || file.extension() == ".mcap") continue;
    for (const std::string& line : dead_links(root, file, contents(root / file))) ADD_FAILURE() << line;
  }
}

TEST(Pages, DeadLinksAreSeen) {
  const fs::path root = test::source_dir();
  EXPECT_EQ(dead_links(root, "docs/x.md", "[a](safety.md) [b](https://example.org/c) [d](../README.md#safety)").size(),
            0u);
  EXPECT_EQ(dead_links(root, "docs/x.md", "[a](gone.md)"), std::vector<std::string>{"docs/x.md: docs/gone.md"});
  EXPECT_EQ(dead_links(root, "docs/x.md", "[a](safety.md#gone)").size(), 1u);
  EXPECT_EQ(dead_links(root, "core/x.h", "// see docs/safety.md#gone").size(), 1u);
  EXPECT_EQ(anchors("## `[[fault]]`: what breaks\n```\n# no heading\n```\n"),
            std::set<std::string>{"fault-what-breaks"});
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
