// Manual pages and completion follow the options that commands declare.
#include "app/cli/manual.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>

#include "tests/support/run_program.h"
#include "tests/support/says.h"
#include "tests/support/temporary_folder.h"

namespace knuckle::cli {
namespace {

struct Given {
  std::string machine, table;
  double slow = 0;
  bool fast = false;
};

Program program() {
  return {"arm-tool",
          "Arm-tool: moves arms.\n",
          "",
          {{"dig", "Dig: a pit, or \\two", [](const OptionList& command) {
              const auto given = std::make_shared<Given>();
              command.add_option("TABLE", given->table, "What to dig");
              command.add_option("--machine", given->machine, "Machine name or .toml file");
              command.add_option("--slow", given->slow, "'Seconds' of it").show_default();
              command.add_flag("--fast", given->fast, ".Not slowly");
              return [given] { return 0; };
            }}}};
}

std::string page(const std::string& name, const ManualSections& sections = {}) {
  for (const ManualPage& one : manual_pages(program(), sections)) {
    if (one.name == name) return one.text;
  }
  return "none";
}

TEST(ManualPages, HaveEveryOptionWithItsValueAndItsHelp) {
  const std::string text = page("arm-tool-dig");
  for (const std::string part :
       {".SH NAME\narm\\-tool\\-dig \\- dig: a pit, or \\etwo\n",
        ".B arm\\-tool dig\n\\fITABLE\\fP\n[\\fIoption\\fP...]",
        "\\fB\\-\\-machine\\fP \\fIvalue\\fP\nMachine name or .toml file.\n",
        "\\fB\\-\\-slow\\fP \\fInumber\\fP\n\\&'Seconds' of it (default: 0).\n",  // a quote begins a request of roff
        "\\fB\\-\\-fast\\fP\n\\&.Not slowly.\n", ".SH EXIT STATUS\n0 done", ".BR arm\\-tool (1)\n"})
    EXPECT_TRUE(test::says(text, part));
}

TEST(ManualPages, ListTheCommands) {
  const std::string text = page("arm-tool");
  EXPECT_TRUE(test::says(text, ".SH NAME\narm\\-tool \\- moves arms\n"));
  EXPECT_TRUE(test::says(text, ".B dig\nDig: a pit"));
  EXPECT_TRUE(test::says(text, ".BR arm\\-tool\\-dig (1)"));
}

TEST(ManualPages, HoldTheSectionsGivenForThem) {
  const std::string text = page("arm-tool-dig", [](const std::string& name) {
    return name == "arm-tool-dig" ? ".SH DESCRIPTION\nIt digs.\n.SH EXAMPLES\nMany.\n" : "";
  });
  const auto described = text.find("It digs."), options = text.find(".SH OPTIONS"), examples = text.find("Many.");
  EXPECT_LT(described, options);
  EXPECT_LT(options, examples);
  EXPECT_NE(examples, std::string::npos);
}

class Completion : public testing::Test {
 protected:
  Completion() {
    std::ofstream(folder_.file("completion")) << bash_completion(program());
    std::filesystem::create_directories(folder_.path() / "config/machines");
    std::ofstream(folder_.file("config/machines/big.toml")) << "";
    std::ofstream(folder_.file("config/machines/small.toml")) << "";
  }
  /// What bash offers for the last of these words.
  [[nodiscard]] std::string offered(const std::string& words) const {
    const test::ProgramRun run = test::run_program(
        "bash",
        {"-c", "set -u; cd " + folder_.file("config") + "; export KNUCKLE_CONFIG_DIR=$PWD; source ../completion; " +
                   "COMP_WORDS=(" + words + "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _arm_tool arm-tool; " +
                   "printf '%s ' \"${COMPREPLY[@]}\""});
    EXPECT_EQ(run.err, "");
    return run.out;
  }
  test::TemporaryFolder folder_;
};

TEST_F(Completion, OffersCommandsThenTheirOptions) {
  EXPECT_EQ(offered("arm-tool d"), "dig ");
  EXPECT_EQ(offered("arm-tool dig --"), "--help --machine --slow --fast ");
  EXPECT_EQ(offered("arm-tool dig --fast --s"), "--slow ");
}

TEST_F(Completion, OffersNamesOfConfigurationFilesAndFiles) {
  EXPECT_EQ(offered("arm-tool dig --machine s"), "small ");
  EXPECT_EQ(offered("arm-tool dig --machine m"), "machines ");
  EXPECT_EQ(offered("arm-tool dig ma"), "machines ");
}

TEST(GivenOptions, AreWrittenSoThatAShellReadsThemAsTheyWere) {
  std::string written;
  Given given;
  const Program tool{"arm-tool", "", "", {{"dig", "", [&](const OptionList& command) {
                                             command.add_option("TABLE", given.table, "");
                                             command.add_option("--machine", given.machine, "");
                                             command.add_flag("--fast", given.fast, "");
                                             return [&written, command] {
                                               written = command.as_given();
                                               return command.given("--fast") && !command.given("--machine") ? 1 : 0;
                                             };
                                           }}}};
  EXPECT_EQ(parse_command_line(tool, {"dig", "a.csv", "--machine", "it's $HOME", "--fast"}).run(), 0);
  EXPECT_EQ(written, " a.csv --machine 'it'\\''s $HOME' --fast");
  EXPECT_EQ(parse_command_line(tool, {"dig", "--fast"}).run(), 1);
  EXPECT_EQ(written, " --fast");
  EXPECT_EQ(parse_command_line(tool, {"dig", "--machine=--odd"}).run(), 0);
  EXPECT_EQ(written, " --machine=--odd");
}

}  // namespace
}  // namespace knuckle::cli
