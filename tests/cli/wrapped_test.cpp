// Help on a narrow terminal.
#include <gtest/gtest.h>

#include "app/cli/printable_output.h"

namespace knuckle::cli {
namespace {

TEST(Wrapped, BreaksBetweenWordsAndGoesOnBelowTheDescription) {
  EXPECT_EQ(wrapped("  --device TEXT     Haptic device name or .toml file (default: knuckle1_MACHINE)\n", 48),
            "  --device TEXT     Haptic device name or .toml\n"
            "                    file (default:\n"
            "                    knuckle1_MACHINE)\n");
}

TEST(Wrapped, LeavesWhatFitsAndWordsThatDoNot) {
  EXPECT_EQ(wrapped("short\n\n  a  b\n", 40), "short\n\n  a  b\n");
  const std::string name(60, 'n');
  EXPECT_EQ(wrapped("see " + name + " there\n", 40), "see\n" + name + "\nthere\n");
}

TEST(Wrapped, PlainTextGoesOnAtTheMargin) {
  EXPECT_EQ(wrapped("Exit codes: 0 done; 1 failed or a criterion was not met\n", 30),
            "Exit codes: 0 done; 1 failed\nor a criterion was not met\n");
}

}  // namespace
}  // namespace knuckle::cli
