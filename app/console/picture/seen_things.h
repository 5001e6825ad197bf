// What only a camera on a simulated machine sees: the target balls on its bucket, and dust.
#pragma once

#include <vector>

#include "app/console/picture/camera.h"
#include "app/console/picture/dust.h"
#include "app/console/picture/gl_program.h"
#include "app/console/picture/painter.h"
#include "app/console/picture/picture_colours.h"
#include "machine/description_fwd.h"

namespace knuckle::console::picture {

class SeenThings {
 public:
  SeenThings();
  /// @param bucket its place, frame M.
  void draw_balls(Painter& painter, const Eigen::Matrix4f& bucket, const MachineDescription& machine,
                  const PictureColours& colours) const;
  /// Blending is on.
  void draw_dust(Painter& painter, const std::vector<Puff>& puffs, const Camera& camera, const Rgb& colour) const;

 private:
  GlMesh ball_, puff_;
};

}  // namespace knuckle::console::picture
