// Whatever size the window is given, the program goes on: a layout that has room for all of it, or one sentence.
#include <algorithm>
#include <array>
#include <string>

#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

TEST(ContentScale, IsByTheWindowUnlessThePersonChoseOneAndNeverLeavesTheLayoutWithoutRoom) {
  EXPECT_FLOAT_EQ(content_scale(1280, 800, 1, 0), 1);
  EXPECT_FLOAT_EQ(content_scale(1920, 1080, 1, 0), 1);
  EXPECT_FLOAT_EQ(content_scale(2560, 1440, 1, 0), 1);
  EXPECT_FLOAT_EQ(content_scale(3840, 2160, 1, 0), 1.5) << "4K: by the window";
  EXPECT_FLOAT_EQ(content_scale(3840, 2160, 2, 0), 2) << "by the monitor, which asks for more";
  EXPECT_FLOAT_EQ(content_scale(3840, 2160, 1, 1), 1) << "chosen";
  EXPECT_FLOAT_EQ(content_scale(3840, 2160, 2, 1.25), 2.5);
  EXPECT_FLOAT_EQ(content_scale(1280, 720, 1, 3), 1) << "no room for more";
  EXPECT_FLOAT_EQ(content_scale(1024, 768, 2, 0), 0.8F);
  EXPECT_FLOAT_EQ(content_scale(kLeastWidth, kLeastHeight, 1, 0), kSmallestScale);
  EXPECT_FLOAT_EQ(content_scale(1, 1, 1, 3), kSmallestScale);
  EXPECT_FLOAT_EQ(content_scale(0, 0, 1, 0), kSmallestScale);
}

class SmallWindow : public ShownConsole {
 protected:
  [[nodiscard]] static bool one_sentence(const std::vector<DrawnText>& texts) {
    return texts.size() == 1 && texts[0].text.starts_with("This window is too small");
  }
};

TEST_F(SmallWindow, OfAnySizeShowsEachScreenWholeOrOneSentence) {
  constexpr std::array<std::pair<int, int>, 5> kWithRoom{
      {{kLeastWidth, kLeastHeight}, {1280, 720}, {1600, kLeastHeight}, {kLeastWidth, 1200}, {1280, 800}}};
  state().hold_to_run = state().measures.grade_on = true;  // as much to be laid out as there can be
  const auto inside = [this](const DrawnText& text) {
    const auto [width, height] = console_->window().framebuffer_size();
    return text.min.x >= 0 && text.min.y >= 0 && text.max.x <= float(width) && text.max.y <= float(height);
  };
  for (const auto& [width, height] : kWithRoom) {
    SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height));
    resize(width, height);
    for (int screen = 0; screen <= static_cast<int>(Screen::kCount); ++screen) {
      SCOPED_TRACE(screen);
      state().help = screen == static_cast<int>(Screen::kCount);
      state().screen = static_cast<Screen>(state().help ? 0 : screen);
      frames(2);
      const std::vector<DrawnText> texts = drawn();
      for (const char* words : {"STOP", "ENGAGED"})
        EXPECT_TRUE(std::ranges::any_of(texts, [&](const DrawnText& t) { return t.text == words && inside(t); }));
    }
  }
  constexpr std::array<std::pair<int, int>, 8> kNoRoom{{{500, 400},
                                                        {300, 300},
                                                        {900, 30},
                                                        {kLeastWidth - 1, 800},
                                                        {1280, kLeastHeight - 1},
                                                        {1280, 1},
                                                        {1, 800},
                                                        {1, 1}}};
  for (const auto& [width, height] : kNoRoom) {
    SCOPED_TRACE(std::to_string(width) + "x" + std::to_string(height));
    resize(width, height);
    const std::vector<DrawnText> texts = drawn();
    ASSERT_TRUE(one_sentence(texts)) << (texts.empty() ? "nothing" : texts.back().text);
    if (width < 300 || height < 30) continue;  // no room for all of it
    EXPECT_TRUE(texts[0].text.ends_with("Stop: Space or a click")) << texts[0].text;
    EXPECT_TRUE(inside(texts[0]));
  }
}

TEST_F(SmallWindow, LetsNobodyLeadSaysSoAndStopsAsEver) {
  frames();
  does("keydown shift");
  ASSERT_TRUE(console_->input(view_.now).hand.enable);
  EXPECT_FALSE(console_->input(view_.now).too_small);
  resize(900, 400);
  EXPECT_TRUE(console_->input(view_.now).too_small);
  const std::vector<DrawnText> texts = drawn();
  ASSERT_TRUE(one_sentence(texts));
  EXPECT_NE(texts[0].text.find("960 x 540"), std::string::npos) << texts[0].text;
  EXPECT_NE(texts[0].text.find("Enable counts as let go"), std::string::npos) << texts[0].text;
  EXPECT_FALSE(console_->input(view_.now).stop);
  does("key space");
  EXPECT_TRUE(console_->input(view_.now).stop);
  EXPECT_EQ(drawn()[0].text.rfind("Stop is pressed", 0), 0U);
  does("keyup shift");
  state().stop = false;
  does("mousemove 300 200 mousedown 1");
  EXPECT_TRUE(console_->input(view_.now).stop) << "there is no other place for a button";
  does("mouseup 1");
  EXPECT_TRUE(console_->input(view_.now).stop);
  resize(1280, 800);
  EXPECT_FALSE(console_->input(view_.now).too_small);
  EXPECT_TRUE(console_->input(view_.now).stop) << "until it is released";
}

}  // namespace
}  // namespace knuckle::console::window
