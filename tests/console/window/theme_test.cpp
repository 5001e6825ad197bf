// Colours and units: what a person must be able to read.
#include "app/console/widgets/theme.h"

#include <gtest/gtest.h>

#include <utility>

#include "app/console/widgets/units.h"

namespace knuckle::console::window {
namespace {

constexpr double kAaText = 4.5;    // WCAG 2.1, 1.4.3
constexpr double kAaShapes = 3.0;  // 1.4.11

TEST(Theme, TextReachesContrastAAOnEverySurface) {
  for (const Palette& p : {dark_palette(), light_palette()}) {
    for (const ImU32 under : {p.background, p.surface, p.raised}) {
      for (const ImU32 text : {p.text, p.muted, p.accent, p.good, p.notice, p.bad}) {
        EXPECT_GE(contrast(text, under), kAaText) << std::hex << text << " on " << under;
      }
    }
    EXPECT_GE(contrast(p.stop_text, p.stop), kAaText);
    for (const ImU32 series : p.series) EXPECT_GE(contrast(series, p.surface), kAaShapes) << std::hex << series;
  }
}

TEST(Theme, ModeWordsAreReadableOnTheirColours) {
  for (int mode = 0; mode <= static_cast<int>(Mode::kEStop); ++mode) {
    const ImU32 fill = Theme{}.mode_colour(static_cast<Mode>(mode));
    EXPECT_GE(contrast(text_on(fill), fill), kAaText) << name(static_cast<Mode>(mode));
  }
}

TEST(Theme, ContrastIsThatOfWcag) {
  EXPECT_NEAR(contrast(IM_COL32_WHITE, IM_COL32_BLACK), 21, 1e-9);
  EXPECT_NEAR(contrast(IM_COL32(0x77, 0x77, 0x77, 255), IM_COL32_WHITE), 4.48, 0.005);  // known just to fail
}

TEST(Units, SwitchBetweenMetricAndImperialInOnePlace) {
  const Units metric, imperial{UnitSystem::kImperial};
  const auto both = [&](Quantity q, double si) {
    return std::pair<std::string, std::string>{metric.text(q, si), imperial.text(q, si)};
  };
  using Texts = std::pair<std::string, std::string>;
  EXPECT_EQ(both(Quantity::kForce, 4448.22), Texts("4448 N", "1000 lbf"));
  EXPECT_EQ(both(Quantity::kSmallLength, 0.0254), Texts("25 mm", "1.00 in"));
  EXPECT_EQ(both(Quantity::kPressure, 20e6), Texts("200 bar", "2901 psi"));
  EXPECT_EQ(both(Quantity::kMass, 45.359237), Texts("45.4 kg", "100.0 lb"));
  EXPECT_EQ(both(Quantity::kFlow, 1e-3), Texts("60.0 L/min", "15.9 gpm"));
}

TEST(Units, NumbersThatAreNoneAndNegativeZeroesAreNotShown) {
  EXPECT_EQ(Units{}.text(Quantity::kForce, std::nan("")), "- N");
  EXPECT_EQ(Units{}.text(Quantity::kForce, -0.2), "0 N");
  EXPECT_EQ(Units{}.text(Quantity::kMass, -0.06), "-0.1 kg");
}

TEST(Units, DurationsTakeTheUnitThatFits) {
  EXPECT_EQ(shown_duration(12e-6), "12 \xC2\xB5s");
  EXPECT_EQ(shown_duration(0.00123), "1.23 ms");
  EXPECT_EQ(shown_duration(0.25), "250 ms");
  EXPECT_EQ(shown_duration(1.24), "1.2 s");
}

}  // namespace
}  // namespace knuckle::console::window
