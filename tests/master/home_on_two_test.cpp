// The operator asks to go home on two: by holding the clutch, or what is set from outside, for three seconds, while the
// machine offers it.
#include <gtest/gtest.h>

#include "tests/master/master_rig.h"

namespace knuckle::master {
namespace {

using test::MasterRig;

struct Offered : MasterRig {
  Offered() {
    machine.mode = Mode::kFault;
    machine.fault = {ReasonCode::kSensorStale, 0x23, 60, 50};
    machine.home_offered = true;
    machine.unknown_torques = 1;
    run(0.5);
  }
};

TEST(HomeOnTwo, IsAskedForByTheClutchOrFromOutsideHeldForThreeSeconds) {
  for (const bool outside : {false, true}) {
    Offered rig;
    rig.loop.set_home(outside);
    rig.intent.clutch = !outside;
    rig.run(2.8);
    EXPECT_EQ(rig.homes_heard, 0);
    EXPECT_GT(rig.loop.home_asked(), 0.9);
    rig.run(0.3);
    EXPECT_GT(rig.homes_heard, 3);
    EXPECT_EQ(rig.home_heard.cylinder, rig.machine.unknown_torques);
    rig.loop.set_home(false);
    rig.intent.clutch = false;
    rig.run(0.1);
    const int heard = rig.homes_heard;
    rig.run(5);
    EXPECT_EQ(rig.homes_heard, heard);
  }
}

TEST(HomeOnTwo, IsNotAskedForWithoutAnOfferNorWithEnableHeldNorByShortPresses) {
  Offered none;
  none.machine.home_offered = false;
  none.intent.clutch = true;
  none.run(5);
  EXPECT_EQ(none.homes_heard, 0);

  Offered enabled;
  enabled.intent.enable = enabled.intent.clutch = true;
  enabled.loop.set_home(true);
  enabled.run(5);
  EXPECT_EQ(enabled.homes_heard, 0);

  Offered shortly;
  for (int i = 0; i < 4; ++i) {
    shortly.intent.clutch = true;
    shortly.run(2.5);
    shortly.intent.clutch = false;
    shortly.run(0.1);
  }
  EXPECT_EQ(shortly.homes_heard, 0);

  Offered nobody;
  nobody.intent.presence = false;
  nobody.intent.clutch = true;
  nobody.run(5);
  EXPECT_EQ(nobody.homes_heard, 0);

  Offered held;  // the clutch was held before anything was offered
  held.machine.home_offered = false;
  held.intent.clutch = true;
  held.run(1);
  held.machine.home_offered = true;
  held.run(5);
  EXPECT_EQ(held.homes_heard, 0);
  held.intent.clutch = false;
  held.run(0.1);
  held.intent.clutch = true;
  held.run(3.2);
  EXPECT_GT(held.homes_heard, 0);

  Offered silent;
  silent.intent.clutch = true;
  silent.machine_silent = true;
  silent.run(5);
  EXPECT_EQ(silent.homes_heard, 0) << "what the machine says was said long ago";
}

}  // namespace
}  // namespace knuckle::master
