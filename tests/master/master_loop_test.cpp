// The whole operator's side against a simulated hand and a scripted machine.
#include "master/master_loop.h"

#include <gtest/gtest.h>

#include "tests/master/master_rig.h"

namespace knuckle::master {
namespace {

using test::kMidPosture;
using test::MasterRig;

TEST(MasterLoop, SendsTheHandsJointsFiveHundredTimesASecond) {
  MasterRig rig;
  rig.run(0.5);
  const std::uint32_t first = rig.heard.sequence;
  rig.run(1);
  EXPECT_EQ(rig.heard.sequence - first, 500u);
  EXPECT_TRUE(rig.heard.device_ok && rig.heard.presence);
  EXPECT_NEAR((rig.heard.position_rad - kMidPosture).norm(), 0, 1e-3);
}

}  // namespace
}  // namespace knuckle::master
