// What stands around the machine of a simulated session while it runs: walls break, pieces fall and are taken.
#pragma once

#include <cstdint>

#include "app/console/console_view.h"
#include "app/session/scene.h"
#include "sim/world.h"

namespace knuckle::console::picture {

class LiveScene {
 public:
  /// @param reach_m of the machine.
  explicit LiveScene(double reach_m) : reach_m_(reach_m) {}
  /// Another session's world; none: nothing is known of what stands there.
  void begin(const sim::WorldDescription& world);
  /// Takes in what has happened since the view before.
  void watch(const sim::WorldEventRing& events);
  [[nodiscard]] const session::Scene& scene() const noexcept { return scene_; }

 private:
  double reach_m_;
  sim::WorldDescription world_;
  session::SessionRecord record_;  ///< Events alone.
  std::uint64_t read_ = 0;
  session::Scene scene_;
};

}  // namespace knuckle::console::picture
