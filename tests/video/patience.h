// Waiting for pictures and sounds that come when they come.
#pragma once

#include <functional>
#include <memory>
#include <thread>

#include "core/time.h"
#include "video/camera.h"

namespace knuckle::video {

/// Until something is so; false where it did not come to be within any patience.
inline bool comes(const std::function<bool()>& so) {
  for (int i = 0; i < 12'000; ++i, std::this_thread::sleep_for(10ms))
    if (so()) return true;
  return false;
}

inline std::unique_ptr<Frame> next_frame(Camera& camera) {
  std::unique_ptr<Frame> frame;
  comes([&] { return (frame = camera.take()) != nullptr; });
  return frame;
}

}  // namespace knuckle::video
