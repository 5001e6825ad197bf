#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>

#include "app/programs/program_options.h"
#include "tests/support/says.h"

namespace knuckle::programs {
namespace {

using Lines = std::vector<std::string>;

/// What somebody writes, at one end of a pipe.
class Typist {
 public:
  Typist() { EXPECT_EQ(pipe(ends_.data()), 0); }
  ~Typist() {
    close(ends_[0]);
    stop();
  }
  Typist(const Typist&) = delete;
  Typist& operator=(const Typist&) = delete;

  [[nodiscard]] int reader() const { return ends_[0]; }
  void type(const std::string& text) {
    EXPECT_EQ(write(ends_[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void stop() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

TEST(ControlInput, GivesWholeLinesWithoutWaiting) {
  Typist typist;
  ControlInput input(typist.reader());
  EXPECT_EQ(input.lines(), Lines{});
  typist.type("gra");
  EXPECT_EQ(input.lines(), Lines{});
  typist.type("nt\n\ntake\nrel");
  EXPECT_EQ(input.lines(), (Lines{"grant", "", "take"}));
  typist.stop();
  EXPECT_EQ(input.lines(), Lines{}) << "a line that never ended is none";
  EXPECT_EQ(input.lines(), Lines{});
}

TEST(ControlInput, TakesOnlySoMuchAtATimeHoweverMuchThereIs) {
  Typist typist;
  ControlInput input(typist.reader());
  std::string flood;
  for (int i = 0; i < 4000; ++i) flood += "y\n";
  typist.type(flood);
  EXPECT_LE(input.lines().size(), 128U);
  EXPECT_LE(input.lines().size(), 128U);
}

TEST(ControlInput, TheEndOfALineThatIsTooLongIsNoLine) {
  Typist typist;
  ControlInput input(typist.reader());
  std::string text(1000, 'x');
  text += "release\ngrant\n";
  typist.type(text);
  Lines lines;
  for (int i = 0; i < 10; ++i) {
    for (const std::string& line : input.lines()) lines.push_back(line);
  }
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_FALSE(test::says(lines[0], "release"));
  EXPECT_EQ(lines[1], "grant");
}

}  // namespace
}  // namespace knuckle::programs
