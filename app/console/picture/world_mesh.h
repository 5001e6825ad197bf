// What stands around the machine as solids: a scene's lines are profiles of it in the arm's plane.
#pragma once

#include "app/console/picture/mesh.h"
#include "app/session/scene.h"
#include "machine/description.h"

namespace knuckle::console::picture {

struct WorldMeshes {
  Mesh ground;         ///< A slab under the machine, where the scene has ground: what is not known is not drawn.
  Mesh grid;           ///< Lines on it.
  Mesh solids;         ///< Walls, pieces, pipes.
  Mesh soil;           ///< Shown transparent: what is dug for lies in it.
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

}  // namespace knuckle::console::picture
