// How a commissioning asks, and what it takes for an answer.
#include "app/bringup/commission_dialogue.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <deque>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/says.h"

namespace knuckle::bringup {
namespace {

using knuckle::test::says;
TEST(CommissionDialogue, LinesComeWholeFromAPipeAndItsEndIsTold) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  LineInput input(ends[0]);
  EXPECT_EQ(input.poll(), std::nullopt);
  ASSERT_EQ(write(ends[1], "rea", 3), 3);
  EXPECT_EQ(input.poll(), std::nullopt);
  ASSERT_EQ(write(ends[1], "dy\r\ngo\n", 7), 7);
  EXPECT_EQ(input.poll(), "ready");
  EXPECT_EQ(input.poll(), "go");
  EXPECT_EQ(input.poll(), std::nullopt);
  ASSERT_EQ(write(ends[1], "go", 2), 2);
  close(ends[1]);
  EXPECT_THROW((void)input.poll(), CommissionEnded) << "perhaps half an answer";
  close(ends[0]);
}

TEST(CommissionDialogue, TheLastLineOfAFileMayLackItsEnd) {
  std::FILE* const file = std::tmpfile();
  ASSERT_NE(file, nullptr);
  std::fputs("ready\nfinish", file);
  std::rewind(file);
  LineInput input(fileno(file));
  EXPECT_EQ(input.poll(), "ready");
  EXPECT_EQ(input.poll(), "finish");
  EXPECT_THROW((void)input.poll(), CommissionEnded);
  std::fclose(file);
}

TEST(CommissionDialogue, PersonsTypeAheadIsNoAnswerAndMeansStopWhileSomethingMoves) {
  std::deque<std::optional<std::string>> typed;
  std::ostringstream out;
  const auto next = [&typed]() -> std::optional<std::string> {
    if (typed.empty()) return std::nullopt;
    auto line = typed.front();
    typed.pop_front();
    return line;
  };
  Dialogue dialogue(terminal(out, next, true), [&typed] { typed.emplace_back("go"); });
  typed.emplace_back("pilot");  // before the question
  EXPECT_EQ(dialogue.ask("?", {"pilot", "go"}), 1);
  EXPECT_FALSE(dialogue.interrupted());
  typed.emplace_back("");
  EXPECT_TRUE(dialogue.interrupted());
}

TEST(CommissionDialogue, APersonWhoMistypesIsAskedAgainAndAScriptIsNot) {
  std::ostringstream out;
  std::vector<std::string> typed;
  const auto next = [&typed]() -> std::optional<std::string> {
    if (typed.empty()) return std::nullopt;
    std::string line = typed.front();
    typed.erase(typed.begin());
    return line;
  };
  std::vector<std::string> person{"yes", "go", "45", "1,5", "30"};
  const auto types = [&] {
    if (!person.empty()) {
      typed.push_back(person.front());
      person.erase(person.begin());
    }
  };
  Dialogue live(terminal(out, next, true), types);
  EXPECT_EQ(live.ask("ready?", {"no", "go"}), 1);
  EXPECT_EQ(live.ask_number("tilt?", -30, 30, "degrees"), 30);
  EXPECT_TRUE(person.empty());
  EXPECT_TRUE(says(out.str(), "the answer 'yes' is not one of no | go: nothing moves; once more"));
  EXPECT_TRUE(says(out.str(), "the answer '45' is not a number from -30 to 30"));
  typed = {"yes", "go"};
  Dialogue script(terminal(out, next, false), [] {});
  EXPECT_THROW((void)script.ask("ready?", {"no", "go"}), CommissionEnded);
}

TEST(CommissionDialogue, NumbersAreTakenWithinTheirBoundsOnly) {
  const auto answer = [](const std::string& line) {
    std::ostringstream out;
    Dialogue dialogue(terminal(
                          out, [&line] { return std::optional(line); }, false),
                      [] {});
    return dialogue.ask_number("?", -30, 30, "degrees");
  };
  EXPECT_EQ(answer("-30"), -30);
  EXPECT_EQ(answer("1.5"), 1.5);
  for (const char* bad : {"", "30.1", "nan", "1,5", "1 deg", "inf"})
    EXPECT_THROW((void)answer(bad), CommissionEnded) << bad;
}

}  // namespace
}  // namespace knuckle::bringup
