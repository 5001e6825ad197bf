// What somebody sees who has never seen the project.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <sstream>

#include "app/cli/command.h"
#include "tests/support/patterns.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::cli {
namespace {

/// What the expression's first group matches first, in a file of the project.
std::string first_in(const std::string& file, const std::string& expression) {
  const auto found = test::matches(test::content(test::source_dir() + "/" + file), expression);
  return found.empty() ? "" : found[0][1];
}

TEST(FirstLook, ProgramChangelogAndPackageHaveOneVersion) {
  EXPECT_EQ("knuckle " + first_in("CHANGELOG.md", "\n## ([0-9.]+)"), program_version());
  EXPECT_EQ("knuckle " + first_in("packaging/debian/changelog", "^knuckle \\(([0-9.]+)-"), program_version());
}

TEST(FirstLook, ABareProgramPrintsItsCommands) {
  const Program tool{
      "arm-tool", "Moves arms.\n", "", {{"dig", "A pit", [](const OptionList&) { return [] { return 3; }; }}}};
  const CommandLine bare = parse_command_line(tool, {});
  EXPECT_FALSE(bare.run);
  EXPECT_NE(bare.text.find("dig"), std::string::npos) << bare.text;
  EXPECT_EQ(bare.text, parse_command_line(tool, {"--help"}).text);
}

/// Names of packages by their part.
std::map<std::string, std::set<std::string>> packages() {
  std::map<std::string, std::set<std::string>> parts;
  std::istringstream lines(test::content(test::source_dir() + "/scripts/packages.txt"));
  std::string part;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    std::string word;
    if (!(words >> word)) continue;
    if (word.starts_with('['))
      part = word;
    else
      EXPECT_TRUE(parts[part].insert(word).second) << word << " stands twice";
  }
  return parts;
}

TEST(FirstLook, TheDemoNeedsNoMoreThanThirtyPackages) {
  auto parts = packages();
  EXPECT_EQ(parts.size(), 3U);
  EXPECT_LE(parts["[run]"].size() + parts["[build]"].size(), 30U);
  for (const char* only_tests_need :
       {"libgtest-dev", "libbenchmark-dev", "liborocos-kdl-dev", "libmujoco-dev", "libopenmpi-dev"})
    EXPECT_TRUE(parts["[test]"].contains(only_tests_need)) << only_tests_need;
}

}  // namespace
}  // namespace knuckle::cli
