// A console that did not run says that it was the console: neither the device nor the link is to be blamed for what
// grew old meanwhile.
#include "tests/console/far_rig.h"

namespace knuckle::test {
namespace {

/// A short one makes the hand's reports old; a longer one lets the machine miss the link.
TEST(OwnPause, IsNamedAsTheCauseOfWhatGrewOldUntilItIsOver) {
  for (const auto& [paused, code] :
       {std::pair{26ms, ReasonCode::kDeviceStale}, std::pair{260ms, ReasonCode::kLinkLost}}) {
    SCOPED_TRACE(name(code));
    FarRig rig;
    rig.engage();
    rig.runs = false;
    rig.run(paused);
    rig.runs = true;
    rig.run(500ms);
    EXPECT_EQ(rig.view.machine.fault.code, code);
    EXPECT_NEAR(rig.view.input.own_pause_s, to_seconds(paused) + 0.001, 2e-3);
    EXPECT_TRUE(rig.told);
    rig.keys = {};
    rig.run(500ms);
    rig.keys.enable = true;
    rig.run(3s);
    EXPECT_EQ(rig.view.machine.mode, Mode::kEngaged) << text(rig.view.machine.blocking);
    EXPECT_EQ(rig.view.input.own_pause_s, 0) << "it is over";
  }
}

TEST(OwnPause, IsNotNamedWhereTheLinkWasLostWhileTheConsoleRan) {
  FarRig rig;
  rig.engage();
  rig.network.cut(true);
  rig.run(300ms);
  rig.network.cut(false);
  rig.run(500ms);
  EXPECT_EQ(rig.view.machine.fault.code, ReasonCode::kLinkLost);
  EXPECT_EQ(rig.view.input.own_pause_s, 0);
  EXPECT_FALSE(rig.told);
}

}  // namespace
}  // namespace knuckle::test
