// What Operate has to say is there whole.
#include "app/console/screens/screens.h"
#include "estimation/force_estimator.h"
#include "tests/console/window/drawn_texts.h"
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

class Operate : public ShownConsole {};

TEST_F(Operate, ShowsEveryLineOfWhyTheForceIsNotKnownBetter) {
  for (unsigned bit = 0; bit < 8; ++bit) {
    for (const unsigned beside : {0U, unsigned{estimation::kNotTared}, unsigned{estimation::kStuckFriction}}) {
      view_.status.force_doubts = static_cast<std::uint8_t>(1U << bit | beside);
      const std::string words = screens::confidence_words(view_);
      int seen = 0;
      for (const DrawnText& text : texts_of([this] { frames(1); })) {
        if (text.words.find(words) == std::string::npos) continue;
        ++seen;
        EXPECT_LE(text.cut_px, 0) << words;
      }
      EXPECT_EQ(seen, 1) << words;
    }
  }
}

TEST_F(Operate, EndsThemWithDotsWhereTheyAreMoreThanItHasRoomFor) {
  view_.status.force_doubts = 0xFF;
  const std::string begin = screens::confidence_words(view_).substr(0, 20);
  int seen = 0;
  for (const DrawnText& text : texts_of([this] { frames(1); })) {
    if (text.words.find(begin) == std::string::npos) continue;
    ++seen;
    EXPECT_LE(text.cut_px, 0);
    EXPECT_TRUE(text.words.ends_with("...")) << text.words;
  }
  EXPECT_EQ(seen, 1);
}

}  // namespace
}  // namespace knuckle::console::window
