// What the banner has to say is there whole, with what to do, whatever else stands beside it.
#include <string>

#include "app/console/screens/screens.h"
#include "machine/reason_text.h"
#include "tests/console/window/shown_console.h"

namespace knuckle::console::window {
namespace {

constexpr auto kReasons = static_cast<std::uint16_t>(ReasonCode::kCount);

class Banner : public ShownConsole {
 protected:
  void SetUp() override {
    ShownConsole::SetUp();
    if (!console_) return;
    // As many tags as there can be.
    view_.status.calibrated = false;
    view_.link.loss = 0.31;
    view_.hand.warning = {ReasonCode::kEnergyWatchdog, 0, 0.04F, 0.03F};
    view_.paused = false;
    state().sound_problem = "no audio device";
    resize(1280, 720);
  }
  /// The banner's texts right of the block with the mode.
  [[nodiscard]] std::vector<DrawnText> in_banner() {
    std::vector<DrawnText> all = drawn();
    std::erase_if(all, [](const DrawnText& text) { return text.min.y > 82 || text.min.x < 328; });
    return all;
  }
  void expect_whole(const std::string& words) {
    int seen = 0;
    for (const DrawnText& text : in_banner()) {
      if (text.text.find(words.substr(0, 12)) == std::string::npos) continue;
      ++seen;
      EXPECT_NE(text.text.find(words), std::string::npos) << text.text << "\n is not\n" << words;
      EXPECT_LE(text.cut_px, 0) << words;
      EXPECT_GE(text.min.y, 10) << words;
      EXPECT_LE(text.max.y, 82) << words;
      EXPECT_LE(text.max.x, 1270) << words;
    }
    EXPECT_EQ(seen, 1) << words;
  }
};

TEST_F(Banner, ShowsEveryFaultItsNodeAndALostLinkWholeWithWhatToDo) {
  view_.machine.mode = Mode::kFault;
  view_.machine.blocking = {ReasonCode::kReleaseToRecover, 0, 0, 0};
  const MachineDescription& machine = console_->facts().machine;
  const JointLoads loads = joint_loads(view_.machine, machine, Kinematics(machine));
  for (std::uint16_t code = 1; code < kReasons; ++code) {
    view_.machine.fault = {static_cast<ReasonCode>(code), 2, 123.4F, 125.4F};
    if (view_.machine.fault.code == ReasonCode::kReleaseToRecover) continue;
    const std::string words = screens::banner_reason(view_, false, 0, {HandSource::kKeyboard}, loads);
    EXPECT_NE(words.find("release enable"), std::string::npos) << words;
    expect_whole(words);
  }
  const NodeDescription& node = machine.bus.encoder(kBoom);
  view_.machine.fault = view_.machine.blocking = {ReasonCode::kSensorStale, node.id, 41, 25};
  expect_whole(node_text(node) + ": sensor has stopped sending: check node and cable");
  view_.link.silence_s = 0.31;
  view_.machine.mode = Mode::kEngaged;
  expect_whole("the machine may still follow for 0.5 s and may go on when the link returns: let go of enable");
}

TEST_F(Banner, ShowsNoTickWhereThisPersonCannotLead) {
  view_.machine.mode = Mode::kReady;
  view_.machine.contact = false;
  view_.machine.blocking = {ReasonCode::kNoPresence, 0, 0, 0};
  const ImU32 ready = theme().mode_colour(Mode::kReady), amber = theme().colours.notice;
  const auto block = [this](ImU32 colour) { return count_near(pixels(), {20, 20, 310, 70}, colour); };
  EXPECT_GT(block(ready), 8000);
  for (const InputSide& input :
       {InputSide{.unattended = true}, InputSide{.dropped = Dropped::kNoFocus},
        InputSide{.release_enable = true, .dropped = Dropped::kStalled}, InputSide{.release_enable = true}}) {
    view_.input = input;
    EXPECT_EQ(block(ready), 0);
    EXPECT_GT(block(amber), 8000);
  }
  view_.input = {};
  state().pad_ignored = true;
  EXPECT_GT(block(amber), 8000);
  view_.led_by_scenario = true;
  EXPECT_GT(block(ready), 8000) << "nobody here leads";
}

/// For going home on two: there only while that is offered, and no longer pressed than it is held.
class HomeButton : public ShownConsole {
 protected:
  void offer() {
    view_.machine.mode = Mode::kFault;
    view_.machine.fault = {ReasonCode::kSensorStale, 0x20, 60, 50};
    view_.machine.blocking = {ReasonCode::kHomeOffered, kBoom, 0, 0};
    view_.machine.home_offered = true;
    frames();
  }
};

TEST_F(HomeButton, AsksForAsLongAsItIsHeldAndOnlyWhereItIsOffered) {
  EXPECT_FALSE(draws("Home on two"));
  offer();
  const std::vector<DrawnText> buttons = drawn_with("Home on two");
  ASSERT_EQ(buttons.size(), 1U);
  move_mouse(int(buttons[0].min.x) + 20, int(buttons[0].min.y) + 8);
  EXPECT_FALSE(console_->input(Time{}).home) << "the pointer is over it, no more";
  does("mousedown 1");
  EXPECT_TRUE(console_->input(Time{}).home);
  view_.hand.home_asked = 0.7;
  frames();
  EXPECT_TRUE(console_->input(Time{}).home);
  view_.machine.home_offered = false;  // the machine has taken it
  frames();
  EXPECT_FALSE(console_->input(Time{}).home);
  does("mouseup 1");
  offer();
  EXPECT_FALSE(console_->input(Time{}).home);
  view_.link.silence_s = 2;
  EXPECT_FALSE(draws("Home on two")) << "the machine is not heard";
  view_ = canned_view();
  view_.machine.home_on_two = true;
  for (const Mode mode : {Mode::kReady, Mode::kEngaged, Mode::kFault}) {
    view_.machine.mode = mode;
    EXPECT_EQ(draws_exactly("HOME ON TWO"), 1) << name(mode) << ": on its way";
  }
}

}  // namespace
}  // namespace knuckle::console::window
