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

namespace knuckle {
namespace {

namespace fs = std::filesystem;

/// What a folder may include besides itself: whole folders, or single headers.
const std::map<std::string, std::set<std::string>> kTable{
    {"core", {}},
    {"machine", {"core"}},
    {"transport", {"core"}},
    {"estimation", {"core", "machine"}},
    {"master", {"core", "machine", "transport"}},
    {"slave", {"core", "machine", "transport", "estimation"}},
    {"sim", {"core", "transport", "machine/description.h"}},
    {"app", {"core", "machine", "transport", "estimation", "master", "slave", "sim"}},
};

std::string folder_of(const std::string& path) {
  return path.substr(0, path.find('/'));
}

/// One line per #include in text that the table forbids to a file of folder.
std::vector<std::string> violations(const std::string& folder, const std::string& file, const std::string& text) {
  static const std::regex include_line(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<std::string> found;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::smatch match;
    if (!std::regex_search(line, match, include_line)) continue;
    const std::string header = match[2];
    const std::string target = folder_of(header);
    const std::string at = file + ":" + std::to_string(number) + ": ";
    if (match[1] == "\"" && !kTable.contains(target)) {
      found.push_back(at + "\"" + header + "\" is not FOLDER/FILE of this project");
    } else if (kTable.contains(target) && target != folder && !kTable.at(folder).contains(target) &&
               !kTable.at(folder).contains(header)) {
      found.push_back(at + folder + " may not include " + header);
    }
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

TEST(IncludeTable, EveryFileIncludesOnlyWhatItsFolderMay) {
  const fs::path root = KNUCKLE_SOURCE_DIR;
  int checked = 0;
  for (const fs::path& file : project_files(root)) {
    const std::string folder = folder_of(file.generic_string());
    if (!is_source(file) || !kTable.contains(folder)) continue;
    ++checked;
    for (const std::string& line : violations(folder, file.generic_string(), contents(root / file))) {
      ADD_FAILURE() << line;
    }
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
}

TEST(ProjectFiles, NameNoPrivatePath) {
  const fs::path root = KNUCKLE_SOURCE_DIR;
  for (const fs::path& file : project_files(root)) {
    EXPECT_FALSE(names_a_private_path(contents(root / file))) << file << " names a directory of one computer";
  }
}

TEST(ProjectFiles, PrivatePathsAreSeen) {
  EXPECT_TRUE(names_a_private_path(std::string("see \"/") + "home/ann/x.csv\""));
  EXPECT_TRUE(names_a_private_path(std::string("DIR=/") + "root/build"));
  EXPECT_FALSE(names_a_private_path("/usr/share/doc and ~/.cache and tests/work/x"));
}

}  // namespace
}  // namespace knuckle
