// What stands around the machine as solids: a scene's lines are profiles of it in the arm's plane.
#pragma once

#include <cstdint>

#include "app/console/console_view.h"
#include "app/console/picture/mesh.h"
#include "app/session/scene.h"
#include "machine/description.h"
#include "sim/world.h"

namespace knuckle::console::picture {

struct WorldMeshes {
  Mesh ground;         ///< A slab under the machine, where the scene has ground: what is not known is not drawn.
  Mesh grid;           ///< Lines on it.
  Mesh solids;         ///< Walls, pieces, pipes.
  Mesh soil;           ///< std::string transparent: what is dug for lies in it.
  Mesh cracks;         ///< Lines on walls that can break.
  Mesh virtual_walls;  ///< Lines: border and hatching; ticks on the forbidden side, right of the scene's line.
};

/// The lines of a scene that exist at this time of its session.
[[nodiscard]] session::Scene scene_at(const session::Scene& scene, double time_s);

/// Where the tracks stand, frame M: on the scene's ground or soil; else as low as tracks usually are.
[[nodiscard]] double track_level_m(const session::Scene& scene, double reach_m);

[[nodiscard]] WorldMeshes world_meshes(const session::Scene& scene, double reach_m);

/// The limits of a machine's tip as lines of a scene; none where the file sets none.
[[nodiscard]] session::Scene virtual_walls(const LimitsDescription& limits, double reach_m);

/// 0.5 m, or more for a large machine: what one square of the ground's grid measures.
[[nodiscard]] double grid_step_m(double reach_m);

// Shapes that mark something in the picture, one metre large: they are scaled to what they say.

/// Of radius 1, in the arm's plane.
[[nodiscard]] Mesh disc_mesh();
/// Lines a metre apart in the arm's plane, to all sides of the origin.
[[nodiscard]] Mesh grid_mesh();
// Of an arrow along x.
[[nodiscard]] Mesh arrow_shaft();
[[nodiscard]] Mesh arrow_head();

// What stands around the machine of a simulated session while it runs: walls break, pieces fall and are taken.

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
