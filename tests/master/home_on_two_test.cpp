// The operator asks to go home on two: by holding the clutch, or what is set from outside, for three seconds, while the
// machine offers it.
#include <gtest/gtest.h>

#include <array>
#include <utility>

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

TEST(HomeOnTwo, IsNotAskedForWithoutAnOfferNorWithEnableHeldNorByNobodyNorOverADeadLink) {
  const std::array<std::pair<const char*, void (*)(Offered&)>, 4> cases{{
      {"not offered", [](Offered& rig) { rig.machine.home_offered = false; }},
      {"enable held", [](Offered& rig) { rig.intent.enable = true; }},
      {"nobody there", [](Offered& rig) { rig.intent.presence = false; }},
      {"what the machine says was said long ago", [](Offered& rig) { rig.machine_silent = true; }},
  }};
  for (const auto& [why, happens] : cases) {
    Offered rig;
    happens(rig);
    rig.intent.clutch = true;
    rig.run(5);
    EXPECT_EQ(rig.homes_heard, 0) << why;
  }
}

TEST(HomeOnTwo, IsNotAskedForByShortPressesNorByAClutchThatWasHeldBefore) {
  Offered rig;
  const auto hold = [&](bool clutch, double seconds) {
    rig.intent.clutch = clutch;
    rig.run(seconds);
  };
  for (int i = 0; i < 4; ++i) {
    hold(true, 2.5);
    hold(false, 0.1);
  }
  EXPECT_EQ(rig.homes_heard, 0);

  rig.machine.home_offered = false;
  hold(true, 1);
  rig.machine.home_offered = true;
  hold(true, 5);
  EXPECT_EQ(rig.homes_heard, 0);
  hold(false, 0.1);
  hold(true, 3.2);
  EXPECT_GT(rig.homes_heard, 0);
}

}  // namespace
}  // namespace knuckle::master
