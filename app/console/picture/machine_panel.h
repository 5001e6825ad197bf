// The picture of the machine on the Operate screen: fed from the view, turned by the mouse; in the side view the mouse
// pulls the tip.
#pragma once

#include <optional>

#include "app/console/console_view.h"
#include "app/console/hand_input.h"
#include "app/console/picture/machine_view.h"
#include "app/console/picture/world_mesh.h"
#include "app/console/widgets/theme.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::console::picture {

/// Where an area of the screen lies in the framebuffer. While ImGui's frame is open, or before the next.
[[nodiscard]] Viewport viewport_of(const Area& picture);

class MachinePanel {
 public:
  /// @throws InputError as MachineView does.
  explicit MachinePanel(const MachineDescription& machine);

  /// The world of the simulated session on screen.
  void begin(const sim::WorldDescription& world) { scene_.begin(world); }
  void watch(const ConsoleView& view);
  /// Takes the mouse in, while ImGui's frame is open. @param picture where the picture lies; screen pixels.
  void take_mouse(const Area& picture, bool side_view, const ConsoleView& view);
  /// Into the bound framebuffer. @param grid of a side view; nothing: none is drawn. @param beside the same time of
  /// another run; nullptr: there is none.
  void draw(const Area& picture, bool side_view, bool light, bool stale, const ConsoleView& view,
            const std::optional<Grid>& grid, const ConsoleView* beside = nullptr);
  /// Outlines and force, over the picture of a camera on the machine.
  void draw_over(const Area& picture, const CameraDescription& mount, bool light, const ConsoleView& view);
  /// From where it is seen.
  [[nodiscard]] const Camera& camera(bool side_view) const noexcept { return side_view ? side_ : orbit_; }
  // By keys. Nothing while the mouse pulls the tip: the place under the mouse would move, and the machine with it.
  /// Positive steps come closer, in the side view to this point of the plane.
  void zoom(bool side_view, double steps, const PlanarVector& about_m);
  /// As at the start.
  void show_whole();
  /// The tip pulled by the mouse; nothing is held where it is not.
  [[nodiscard]] const HandInput& pulled() const noexcept { return pulled_; }
  /// The pull is over, though its button is still down.
  [[nodiscard]] bool pull_ended() const noexcept { return pull_ended_; }

 private:
  [[nodiscard]] MachinePicture picture_of(const ConsoleView& view, bool stale,
                                          const ConsoleView* beside = nullptr) const;

  MachineDescription machine_;
  Kinematics kinematics_;
  MachineView view_;
  Camera side_, orbit_;
  LiveScene scene_;
  HandInput pulled_;
  std::optional<Viewport> pulled_in_;  ///< Where the picture was when the pull began.
  bool pull_ended_ = false;            ///< Though the button is still down.
  Time contact_since_ = kNever;
};

}  // namespace knuckle::console::picture
