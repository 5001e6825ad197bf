// What files, devices or the network say reaches a terminal as text, whoever prints it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <tuple>

#include "app/cli/command.h"
#include "app/cli/output_file.h"
#include "app/cli/terminal.h"
#include "tests/support/run_inside.h"

namespace knuckle::cli {
namespace {

constexpr const char* kForeign = "desk\x1b[2J\x1b]0;owned\x07 1";
constexpr const char* kShown = "desk\\x1b[2J\\x1b]0;owned\\x07 1";

std::string shown(const char* before, const char* after) {
  std::string text = before;
  text += kShown;
  text += after;
  return text;
}

TEST(PrintableOutput, MakesControlCharactersVisibleAndKeepsLinesAndTabs) {
  std::ostringstream destination;
  std::ostream out(destination.rdbuf());
  {
    const PrintableOutput printable(out);
    out << "a\tb\n" << kForeign << "\r\n" << std::flush;
    EXPECT_EQ(destination.str(), shown("a\tb\n", "\\x0d\n"));
    out << "K\xc3\xbc"
           "bel";
  }
  EXPECT_TRUE(
      destination.str().ends_with("K\xc3\xbc"
                                  "bel"))
      << "what was not flushed is not lost";
  out << kForeign;
  EXPECT_TRUE(destination.str().ends_with(kForeign)) << "as before";
}

TEST(PrintableOutput, TellsThatItsDestinationRefuses) {
  std::ofstream full("/dev/full");
  std::ostream out(full.rdbuf());
  const PrintableOutput printable(out);
  out << "text" << std::flush;
  EXPECT_FALSE(out);
}

TEST(PrintableOutput, CoversAllThatACommandPrints) {
  const Program program{"prints", "", "", {{"print", "", [](const OptionList&) {
                                              return [] {
                                                std::cout << kForeign << '\n';
                                                std::cerr << kForeign << '\n';
                                                return 0;
                                              };
                                            }}}};
  const test::ProgramRun run = test::run_inside(program, {"print"});
  EXPECT_EQ(run.out, shown("", "\n"));
  EXPECT_EQ(run.err, shown("", "\n"));
  EXPECT_EQ(run.exit_code, 0);
}

/// A terminal, and what it was sent.
class Terminal {
 public:
  Terminal() : screen_(posix_openpt(O_RDWR | O_NOCTTY)) {
    grantpt(screen_);
    unlockpt(screen_);
    name_ = ptsname(screen_);
    kept_open_ = open(name_.c_str(), O_RDWR | O_NOCTTY);
  }
  ~Terminal() {
    close(kept_open_);
    close(screen_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::string shown() const {
    std::array<char, 4096> text{};
    const auto size = read(screen_, text.data(), text.size());
    return size < 0 ? "" : std::string(text.data(), static_cast<std::size_t>(size));
  }

 private:
  int screen_, kept_open_;
  std::string name_;
};

TEST(PrintableOutput, DataGoToATerminalPrintableAndToAFileAsTheyAre) {
  const Terminal terminal;
  OutputFile out("--json", terminal.name());
  out.stream() << kForeign << "\xc2\x9b" << '\n';
  out.commit();
  EXPECT_EQ(terminal.shown(), shown("", "\\xc2\\x9b\r\n"));
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  OutputFile piped("--json", "/dev/fd/" + std::to_string(pipe_ends[1]));
  piped.stream() << kForeign;
  piped.commit();
  std::array<char, 64> read_back{};
  const auto size = read(pipe_ends[0], read_back.data(), read_back.size());
  EXPECT_EQ(std::string(read_back.data(), static_cast<std::size_t>(size)), kForeign);
  for (const int end : pipe_ends) close(end);
}

TEST(Wrapped, BreaksBetweenWordsAndGoesOnBelowTheDescriptionOrAtTheMargin) {
  const std::string name(60, 'n');
  const std::tuple<std::string, std::size_t, std::string> table[] = {
      {"  --device TEXT     Haptic device name or .toml file (default: knuckle1_MACHINE)\n", 48,
       "  --device TEXT     Haptic device name or .toml\n"
       "                    file (default:\n"
       "                    knuckle1_MACHINE)\n"},
      {"Exit codes: 0 done; 1 failed or a criterion was not met\n", 30,
       "Exit codes: 0 done; 1 failed\nor a criterion was not met\n"},
      {"short\n\n  a  b\n", 40, "short\n\n  a  b\n"},
      {"see " + name + " there\n", 40, "see\n" + name + "\nthere\n"},
  };
  for (const auto& [text, width, shown] : table) EXPECT_EQ(wrapped(text, width), shown);
}

}  // namespace
}  // namespace knuckle::cli
