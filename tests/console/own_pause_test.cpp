// A console that did not run says that it was the console: neither the device nor the link is to be blamed for what
// grew old meanwhile.
#include "tests/console/far_rig.h"

namespace knuckle::test {
namespace {

TEST(OwnPause, IsNamedForAShortOneThatMakesTheHandsReportsOld) {
  FarRig rig;
  rig.engage();
  rig.runs = false;
  rig.run(26ms);
  rig.runs = true;
  rig.run(500ms);
  EXPECT_EQ(rig.view.machine.fault.code, ReasonCode::kDeviceStale);
  EXPECT_NEAR(rig.view.input.own_pause_s, 0.027, 2e-3);
  EXPECT_TRUE(rig.told);
  rig.keys = {};
  rig.run(500ms);
  rig.keys.enable = true;
  rig.run(3s);
  EXPECT_EQ(rig.view.machine.mode, Mode::kEngaged) << text(rig.view.machine.blocking);
  EXPECT_EQ(rig.view.input.own_pause_s, 0) << "it is over";
}

TEST(OwnPause, IsNamedForOneThatIsLongEnoughForTheMachineToMissTheLink) {
  FarRig rig;
  rig.engage();
  rig.runs = false;
  rig.run(260ms);
  rig.runs = true;
  rig.run(500ms);
  EXPECT_EQ(rig.view.machine.fault.code, ReasonCode::kLinkLost);
  EXPECT_NEAR(rig.view.input.own_pause_s, 0.261, 2e-3);
  EXPECT_TRUE(rig.told);
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
