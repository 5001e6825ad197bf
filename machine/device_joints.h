// The haptic device's three joints: each leads the machine's joint of the same index.
#pragma once

#include "core/joints.h"

namespace knuckle {

inline constexpr PerJoint<const char*> kDeviceJointNames{"forearm", "wrist", "finger"};

}  // namespace knuckle
