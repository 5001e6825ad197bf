// What a long program says: in order, not without end, and on one line of the terminal.
#include "app/programs/program_console.h"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/support/says.h"

namespace knuckle::programs {
namespace {

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> all;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) all.push_back(line);
  return all;
}

TEST(ProgramConsole, TellsEventsInTheOrderOfTheirTimes) {
  std::ostringstream out;
  ProgramConsole console("p", out, false);
  console.event(Time(42ms), "policy");
  console.event(Time(30ms), "self test");
  console.tend(Time(42ms));
  console.event(Time(41ms), "older, and handed over later");
  console.tend(Time(62ms));
  console.note("the end");
  EXPECT_EQ(lines(out.str()),
            (std::vector<std::string>{"p: 0.030 s: self test", "p: 0.041 s: older, and handed over later",
                                      "p: 0.042 s: policy", "p: the end"}));
}

TEST(ProgramConsole, WritesNoControlCharactersOfOthers) {
  std::ostringstream out;
  {
    ProgramConsole console("p", out, true);
    console.note("desk\x1b[2J has control");
    console.event(Time(0ms), "desk\x07 asks\nfor control");
    console.status(Time(0ms), {"led by desk\x1b]0;owned\x07"});
  }
  for (const char* shown :
       {"desk\\x1b[2J has control\n", "desk\\x07 asks\\x0afor control\n", "led by desk\\x1b]0;owned\\x07"})
    EXPECT_TRUE(test::says(out.str(), shown));
}

/// A far end that toggles its mode at every step, for a minute.
TEST(ProgramConsole, AFloodOfEventsIsToldInPartAndCountedInFull) {
  std::ostringstream out;
  int told = 0, counted = 0;
  {
    ProgramConsole console("p", out, false);
    for (Time at{}; at < Time(60s); at += 5ms) {
      const bool even = at.time_since_epoch() / 5ms % 2 == 0;
      console.event(at, even ? "ready" : "aligning");
      if (at == Time(33s)) console.event(at, "fault link_lost (203 ms)", "fault link_lost");
      console.tend(at);
    }
  }
  const auto all = lines(out.str());
  for (const std::string& line : all) {
    const auto more = line.find("... and ");
    if (more == std::string::npos) {
      ++told;
    } else {
      counted += std::stoi(line.substr(more + 8));
    }
  }
  EXPECT_EQ(told, 6 * ProgramConsole::kMostEvents + 1) << "and the first fault in the middle of it";
  EXPECT_TRUE(test::says(out.str(), "33.000 s: fault link_lost (203 ms)"));
  EXPECT_EQ(told + counted, 60 * 200 + 1) << "none is missing in the count";
  EXPECT_TRUE(test::says(out.str(), " more events in the last 10.0 s"));
}

TEST(ProgramConsole, KeepsItsStatusInOneLineOfTheTerminal) {
  std::ostringstream out;
  ProgramConsole console("knuckle slave", out, true);
  console.status(Time(2s), {"aligning", std::string(200, 'x'), "round trip 12 ms"});
  EXPECT_LE(out.str().size(), 79U) << "or the terminal breaks it, and the next one does not take it back";
  EXPECT_EQ(out.str().rfind("knuckle slave: aligning | xxx", 0), 0U) << out.str();
  EXPECT_TRUE(test::says(out.str(), "x... | round trip 12 ms"));
}

TEST(FittedLine, CutsNoCharacterInTwoAndLeavesWhatFits) {
  EXPECT_EQ(fitted({"ready", "round trip 12 ms"}, 79), "ready | round trip 12 ms");
  EXPECT_EQ(fitted({"äöüäöüäöü"}, 9), "äöüäöüäöü");
  EXPECT_EQ(fitted({"äöüäöüäöü"}, 8), "äöüäö...");
}

TEST(RunEvents, KeepsTheFirstOfEachKindAndTheNewestOthers) {
  RunEvents<int> events;
  const int many = 10'000;
  for (int i = 0; i < many; ++i) {
    events.add(i, i % 2 == 0 ? "ready" : "aligning");
    if (i == 5000) events.add(-1, "fault link_lost");
  }
  const std::vector<int> kept = events.kept();
  EXPECT_EQ(kept.size(), 3 + RunEvents<int>::kMostOthers);
  EXPECT_EQ(kept[0], 0);
  EXPECT_EQ(kept[1], 1);
  EXPECT_EQ(kept[2], -1) << "the only fault";
  EXPECT_EQ(kept.back(), many - 1);
  EXPECT_EQ(events.left_out(), many + 1 - kept.size());
}

TEST(RunEvents, AFarEndThatMakesUpEverNewKindsFillsNoMemory) {
  RunEvents<int> events;
  for (int i = 0; i < 100'000; ++i) events.add(i, std::to_string(i));
  EXPECT_LE(events.kept().size(), EventKinds::kMost + RunEvents<int>::kMostOthers);
}

}  // namespace
}  // namespace knuckle::programs
