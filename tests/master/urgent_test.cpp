// Stop and release of enable: sent in the step in which they are noticed, and told by every later message.
#include <gtest/gtest.h>

#include "tests/master/master_rig.h"

namespace knuckle::master {
namespace {

using test::MasterRig;

TEST(MasterLoop, SendsAStopInTheStepInWhichItIsPressed) {
  for (const int ticks : {0, 1}) {
    MasterRig rig;
    rig.engage();
    rig.run(1e-3 * ticks);
    rig.loop.set_stop(true);
    rig.tick();
    rig.loop.set_stop(false);
    rig.tick();  // on the link
    EXPECT_EQ(rig.heard_at, rig.now) << ticks;
    EXPECT_TRUE(rig.heard.stop) << ticks;
    EXPECT_EQ(rig.heard.stops, 1U);
    rig.run(0.5);
    EXPECT_FALSE(rig.heard.stop);
    EXPECT_EQ(rig.heard.stops, 1U) << "told for good";
    EXPECT_EQ(rig.heard.releases, 0U);
  }
}

TEST(MasterLoop, SendsAReleaseOfEnableInTheStepInWhichItIsNoticed) {
  for (const int ticks : {0, 1}) {
    MasterRig rig;
    rig.engage();
    rig.intent.enable = true;
    rig.run(0.1 + 1e-3 * ticks);
    ASSERT_TRUE(rig.heard.enable);
    const std::uint32_t before = rig.heard.releases;
    rig.intent.enable = false;
    while (rig.loop.device().enable) rig.tick();
    rig.intent.enable = true;
    rig.tick();  // on the link
    EXPECT_EQ(rig.heard_at, rig.now) << ticks;
    EXPECT_FALSE(rig.heard.enable) << ticks;
    EXPECT_EQ(rig.heard.releases, before + 1);
    rig.run(0.5);
    EXPECT_TRUE(rig.heard.enable);
    EXPECT_EQ(rig.heard.releases, before + 1) << "told for good";
  }
}

TEST(MasterLoop, WhoCeasesToLeadWithEnableHeldHasReleasedIt) {
  const std::function<void(MasterRig&)> ways[] = {
      [](MasterRig& r) { r.loop.set_nobody(true); },
      [](MasterRig& r) { r.loop.let_go(); },
      [](MasterRig& r) { r.cable.unplug(); },
      [](MasterRig& r) { r.status.machine = MachineName("another"); },
  };
  for (const auto& cease : ways) {
    MasterRig rig;
    rig.engage();
    rig.intent.enable = true;
    rig.run(0.1);
    const std::uint32_t before = rig.heard.releases;
    cease(rig);
    rig.run(0.1);
    EXPECT_FALSE(rig.heard.enable);
    EXPECT_EQ(rig.heard.releases, before + 1);
  }
}

}  // namespace
}  // namespace knuckle::master
