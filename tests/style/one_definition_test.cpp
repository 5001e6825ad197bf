// No name is defined twice in one program: the linker would take one of the two for both, and say nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/style/definitions.h"
#include "tests/support/places.h"

namespace knuckle::test {
namespace {

namespace fs = std::filesystem;

using Contents = std::map<std::string, std::string>;
using Definitions = std::map<std::string, std::set<std::string>>;  ///< Files by what they define.

/// Adds what the files define. A program's own main() is not another's.
void add(Definitions& all, const Contents& files) {
  for (const auto& [file, text] : files) {
    for (const std::string& name : definitions_in(text)) {
      if (!name.starts_with("main(")) all[name].insert(file);
    }
  }
}

/// "NAME: FILE, FILE" of each name that two files define.
std::vector<std::string> defined_twice(const Definitions& all) {
  std::vector<std::string> lines;
  for (const auto& [name, files] : all) {
    if (files.size() < 2) continue;
    std::string line = name + ":";
    for (const std::string& file : files) line += (line.back() == ':' ? " " : ", ") + file;
    lines.push_back(line);
  }
  return lines;
}
std::vector<std::string> defined_twice_in(const Contents& files) {
  Definitions all;
  add(all, files);
  return defined_twice(all);
}

/// Sources of the product under "", and those of each folder of tests under its path; a fuzzer is a program of its own.
std::map<std::string, Contents> sources_by_program() {
  const fs::path root = test::source_dir();
  std::map<std::string, Contents> programs;
  const std::set<std::string> skipped{".git", "build", "out"};
  for (auto it = fs::recursive_directory_iterator(root); it != fs::recursive_directory_iterator(); ++it) {
    if (it.depth() == 0 && skipped.contains(it->path().filename().string())) it.disable_recursion_pending();
    if (it->path().extension() != ".h" && it->path().extension() != ".cpp") continue;
    const std::string file = fs::relative(it->path(), root).generic_string();
    const bool fuzzer = file.starts_with("tests/fuzz/") && file.ends_with(".cpp");
    const std::string folder = file.substr(0, file.rfind('/'));
    const std::string program = fuzzer ? file : folder.starts_with("tests/") ? folder : "";
    std::ifstream stream(it->path(), std::ios::binary);
    programs[program][file] = {std::istreambuf_iterator<char>(stream), {}};
  }
  return programs;
}

TEST(OneDefinition, EveryNameIsDefinedOnceInEachProgram) {
  const auto programs = sources_by_program();
  ASSERT_GT(programs.at("").size(), 100u) << "no sources under " << test::source_dir();
  std::set<std::string> told;
  const auto tell = [&told](const Definitions& all) {
    for (const std::string& line : defined_twice(all)) {
      if (told.insert(line).second) ADD_FAILURE() << line;
    }
  };
  Definitions product;
  add(product, programs.at(""));
  tell(product);
  add(product, programs.at("tests/support"));
  tell(product);
  for (const auto& [program, files] : programs) {
    Definitions linked = product;
    if (!program.empty() && program != "tests/support") add(linked, files);
    tell(linked);
  }
}

TEST(OneDefinition, SeesTypesOfOneNameInTwoFiles) {
  const std::string a = "namespace knuckle::app {\nstruct Finding { int row; };\nstruct Other {};\n}",
                    b = "namespace knuckle { namespace app {\nclass Finding final : Base { void f() {} };\n} }";
  EXPECT_EQ(defined_twice_in({{"a.h", a}, {"b.cpp", b}}),
            std::vector<std::string>{"knuckle::app::Finding: a.h, b.cpp"});
  EXPECT_EQ(defined_twice_in({{"a.h", a}, {"b.h", "namespace knuckle::window { struct Finding {}; }"}}).size(), 0u);
  EXPECT_EQ(
      defined_twice_in({{"a.h", a}, {"b.h", "namespace knuckle::app { namespace { struct Finding {}; } }"}}).size(),
      0u);
  EXPECT_EQ(defined_twice_in({{"a.h", a}, {"b.h", "namespace knuckle::app { struct Finding; }"}}).size(), 0u);
}

TEST(OneDefinition, TellsWhatAFileDefines) {
  using Names = std::set<std::string>;
  EXPECT_EQ(definitions_in("struct A { struct Inner {}; int f() { return 1; } } a;"), Names{"A"});
  EXPECT_EQ(definitions_in("enum class [[nodiscard]] E : std::uint8_t { kA };"), Names{"E"});
  EXPECT_EQ(definitions_in("namespace n { template <class T, int N = (3 > 2)> struct T1 {}; }"), Names{"n::T1"});
  EXPECT_EQ(definitions_in("template <> struct T1<int> {};"), Names{"T1<int>"});
  EXPECT_EQ(definitions_in(
                "// struct A {};\n/* struct B {}; */ const char* s = \"struct C {};\";\n#define D \\\n struct D {};\n"),
            Names{});
  EXPECT_EQ(definitions_in("auto r = R\"x(struct A {};)x\"; struct B {};"), Names{"B"});
}

TEST(OneDefinition, KnowsFunctionsByTheirParameters) {
  using Names = std::set<std::string>;
  EXPECT_EQ(definitions_in("[[nodiscard]] inline int f(const A& a, int n = 3) { return n; }"),
            Names{"f(const A&,int)"});
  EXPECT_EQ(definitions_in("int f(const A&, int) noexcept { return 1; }"), Names{"f(const A&,int)"});
  EXPECT_EQ(definitions_in("std::map<int, A> g() { return {}; }"), Names{"g()"});
  EXPECT_EQ(definitions_in("A::A(int a) : a_{a}, b_(2) {} int after() {}"), (Names{"A::A(int)", "after()"}));
  EXPECT_EQ(definitions_in("bool operator==(A a, A b) { return true; }"), Names{"operator==(A,A)"});
  EXPECT_EQ(definitions_in("namespace { int f() { return 1; } } static int g() { return 1; } int h();"), Names{});
}

TEST(OneDefinition, KnowsInlineVariables) {
  using Names = std::set<std::string>;
  EXPECT_EQ(definitions_in(
                "inline constexpr double kA = 1; inline constexpr std::array<int, 2> kB{1, 2}; constexpr int kC = 2;"),
            (Names{"kA", "kB"}));
  EXPECT_EQ(definitions_in("inline int f(); const int k = f();"), Names{});
}

}  // namespace
}  // namespace knuckle::test
