// The picture of the machine and of what it touches, drawn with OpenGL 3.3.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "app/console/picture/camera.h"
#include "app/console/picture/dust.h"
#include "app/console/picture/picture_colours.h"
#include "app/session/scene.h"
#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::console::picture {

/// What the picture shows; all frame M, from the newest view.
struct MachinePicture {
  JointVector measured_rad = JointVector::Zero();  ///< Drawn solid.
  bool measured_is_stale = false;                  ///< Drawn grey.
  // Where there is such a pose:
  std::optional<JointVector> commanded_rad;  ///< Outline.
  std::optional<JointVector> hand_rad;       ///< Translucent: where the operator's hand asks to be.
  std::optional<JointVector> beside_rad;     ///< Translucent with an outline: the machine in another run.
  PlanarVector tip_force_N = PlanarVector::Zero();
  std::array<double, 3> covariance_N2{};       ///< xx, xz, zz: drawn as ellipse of 95 %.
  double line_offset_m = 0, line_sigma_m = 0;  ///< Of the force's line of action (SlaveState); 0: at the tip.
  double confidence = 1;                       ///< [0, 1]; the arrow fades with it.
  bool contact = false;                        ///< Ring on the line of action, as near to the tip as it comes.
  double contact_s = 1e9;                      ///< How long; the ring flashes at first.
  const session::Scene* scene = nullptr;       ///< None: the machine alone.
  double scene_s = 0;                          ///< Time of the scene's session.
  std::optional<Grid> grid;                    ///< Behind everything; of a side view.
  const std::vector<Puff>* dust = nullptr;     ///< In front of what is behind it.
  bool as_seen = false;  ///< As a camera sees it: nothing shines through, and what is not there is not drawn.
};

/// How long forces are drawn.
struct ForceScale {
  double full_N = 1;   ///< A round number that this machine presses with.
  double full_m = 1;   ///< Length of its arrow; longer ones are cut off at 1.25 times.
  double least_N = 0;  ///< Shorter arrows are not drawn.
};
[[nodiscard]] ForceScale force_scale(const MachineDescription& machine);

class MachineView {
 public:
  /// @throws InputError where the driver refuses the shaders. OpenGL 3.3 context current, here and in all the rest.
  explicit MachineView(const MachineDescription& machine);
  MachineView(const MachineView&) = delete;
  MachineView& operator=(const MachineView&) = delete;
  ~MachineView();

  /// Fills the viewport of the bound framebuffer, which needs a depth buffer and five bits of stencil. Clears what
  /// it needs; leaves depth test, stencil test, scissor test, blending and face culling off.
  void draw(const MachinePicture& picture, const Camera& camera, const Viewport& viewport,
            const PictureColours& colours);
  /// Over what is in the viewport: the outlines of the machine as measured (white) and as commanded, and the force. In
  /// front of everything. The same framebuffer as for draw().
  void draw_over(const MachinePicture& picture, const Camera& camera, const Viewport& viewport,
                 const PictureColours& colours);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace knuckle::console::picture
