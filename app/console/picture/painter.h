// Draws meshes with the one shader of the picture.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "app/console/picture/camera.h"
#include "app/console/picture/dust.h"
#include "app/console/picture/gl_program.h"
#include "app/console/picture/picture_colours.h"
#include "machine/description_fwd.h"
#include "machine/kinematics.h"

namespace knuckle::console::picture {

/// How a mesh looks this time.
struct Look {
  Rgb tint = Rgb::Zero();
  float tinted = 0;  ///< Share of the tint in the colour; the rest is the material's.
  float alpha = 1;
  bool lit = true;
  Eigen::Vector4f kept{0, 0, 0,
                       1};  ///< Plane in the mesh's axes; with GL_CLIP_DISTANCE0, what is below it is not drawn.
};

/// A plane frame as one in space: x forward, y to the left, z up.
[[nodiscard]] Eigen::Matrix4f in_space(const Frame2& frame);

/// The same with its axes stretched.
[[nodiscard]] Eigen::Matrix4f scaled(const Eigen::Matrix4f& frame, double x, double y, double z);

class Painter {
 public:
  Painter();
  /// Before the meshes of a frame.
  void begin(const Eigen::Matrix4f& view_projection, const PictureColours& colours);
  void triangles(const GlMesh& mesh, const Eigen::Matrix4f& model, const Look& look);
  void edges(const GlMesh& mesh, const Eigen::Matrix4f& model, const Look& look);
  void wires(const GlMesh& mesh, const Eigen::Matrix4f& model, const Look& look);

 private:
  void set(const Eigen::Matrix4f& model, const Look& look);
  GlProgram program_;
  Eigen::Matrix4f view_projection_ = Eigen::Matrix4f::Identity();
};

/// Towards the light.
[[nodiscard]] Eigen::Vector3f sun_direction();

// What only a camera on a simulated machine sees: the target balls on its bucket, and dust.

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
