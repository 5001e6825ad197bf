// With imperial units no number is left in metric ones, on any screen, whatever the loops and the machine's side say.
#include <regex>
#include <string>

#include "app/console/screens/screens.h"
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

/// A unit alone, as behind a number of another font; or behind a number.
bool has_metric_unit(const std::string& text) {
  static const std::regex kUnit(
      R"((^|[0-9] ?|, |in )(N|kN|kN/m|m|cm|mm|m/s|mm/s|bar|kg|L/min|W|kW|J|N/mm)(:|;|,|\)|\.| |$))");
  return std::regex_search(text, kUnit);
}

class Imperial : public ShownConsole {
 protected:
  /// Of what is drawn now.
  [[nodiscard]] std::string metric() {
    std::string found;
    for (const DrawnText& text : drawn())
      if (has_metric_unit(text.text)) found += "'" + text.text + "' ";
    return found;
  }
};

TEST_F(Imperial, LeavesNoMetricUnitOnAnyScreen) {
  for (const sim::WorldEventKind piece :
       {sim::WorldEventKind::kPieceBroke, sim::WorldEventKind::kScooped, sim::WorldEventKind::kDug}) {
    ConsoleEvent event;
    event.kind = ConsoleEventKind::kPiece;
    event.piece = piece;
    event.value = 812;
    event.at = view_.now;
    events_.add(event, {});
  }
  state().measures.ground_m = -0.2;
  state().measures.grade_on = true;
  state().hold_to_run = true;
  state().assist.force_limit_N = 1500;
  view_.machine.mode = Mode::kReady;  // the banner has a force, a limit and its unit
  view_.machine.blocking = {ReasonCode::kPowerLimit, 0, 9.1F, 9};
  EXPECT_NE(metric(), "") << "the test sees what is drawn";
  does("key F9");
  EXPECT_TRUE(state().light && theme().light) << "in the other colours, too";
  does("key F10");
  for (const char* screen : {"F1", "F2", "F3", "F4", "F5", "F6", "F7"}) {
    does(std::string("key ") + screen);
    EXPECT_EQ(metric(), "") << screen;
  }
}

TEST(Units, LeaveNoMetricOneInAnyReason) {
  const Units imperial{UnitSystem::kImperial};
  ConsoleView view = canned_view();
  view.machine.mode = Mode::kReady;
  for (int code = 1; code < static_cast<int>(ReasonCode::kCount); ++code) {
    view.machine.blocking = {static_cast<ReasonCode>(code), 0, 9.1F, 9};
    const std::string shown = imperial.as_shown(screens::banner_reason(view, false, 0));
    EXPECT_FALSE(has_metric_unit(shown)) << shown;
  }
}

TEST(Units, TurnTheNumbersInATextThatHaveAMetricUnitAndNoOthers) {
  const Units imperial{UnitSystem::kImperial};
  EXPECT_EQ(imperial.as_shown("contact, 820 N"), "contact, 184 lbf");
  EXPECT_EQ(imperial.as_shown("limited (9.1 kW; limit 9 kW)"), "limited (12.2 hp; limit 12.1 hp)");
  EXPECT_EQ(imperial.as_shown("encoder preset: 512.0 mm before, 510.2 mm now"),
            "encoder preset: 20.16 in before, 20.09 in now");
  EXPECT_EQ(imperial.as_shown("1011.6 mm between its stops, expected 1010.0 mm"),
            "39.827 in between its stops, expected 39.764 in");
  EXPECT_EQ(imperial.as_shown("length 0.755 to 1.135 m"), "length 2.48 to 3.724 ft");
  EXPECT_EQ(imperial.as_shown("from 2 to 3 of stroke"), "from 2 to 3 of stroke");
  EXPECT_EQ(imperial.as_shown("-0.3 m"), "-0.984 ft");
  for (const char* same : {"node 0x22: 41 ms; limit 25 ms", "12 of stroke", "5 min", "3 nodes", "F10", "0.4 s", "30 %",
                           "wall.1.toml", "2 Notes", ""})
    EXPECT_EQ(imperial.as_shown(same), same);
  EXPECT_EQ(Units{}.as_shown("820 N"), "820 N");
}

}  // namespace
}  // namespace knuckle::console::window
