// Aligning a camera: its place on the machine from clicks on the bucket's tip in its picture. No window here.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "app/console/console_view.h"
#include "estimation/identification/camera_fit.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::console::screens {

class CameraAlign {
 public:
  /// @param camera its name; where it is from, the machine's file may say.
  CameraAlign(const MachineDescription& machine, const std::string& camera);

  [[nodiscard]] const std::string& camera() const noexcept { return start_.name; }
  /// Once a frame. @param fresh what is measured of the machine is of now.
  void watch(const ConsoleView& view, bool fresh) noexcept;
  /// The tip was clicked. @param share of the picture's width and height, from its upper left corner. Does nothing but
  /// say why, where the machine has not stood still for a second or the tip is where it was clicked before.
  void click(const Eigen::Vector2d& share, int width_px, int height_px);
  void undo();

  /// What to do, and what came of it so far; one or two lines.
  [[nodiscard]] std::string words() const;
  /// Where each tip was clicked, and where the fit sees it; shares.
  struct Mark {
    Eigen::Vector2d clicked, fitted;
  };
  [[nodiscard]] std::vector<Mark> marks() const;
  [[nodiscard]] const estimation::CameraFit& fit() const noexcept { return fit_; }

 private:
  void solve();

  Kinematics kinematics_;
  CameraDescription start_;
  double reach_m_;
  PlanarVector tip_m_ = PlanarVector::Zero();
  PlanarVector rest_m_ = PlanarVector::Zero();
  Time rest_since_ = kNever;
  bool rested_ = false, fresh_ = false;
  struct Click {
    PlanarVector tip_m;
    Eigen::Vector2d share;  ///< Of the picture, which may come in another size next.
  };
  std::vector<Click> clicks_;
  int width_px_ = 1, height_px_ = 1;  ///< Of the picture that was clicked last.
  estimation::CameraFit fit_;
  std::string refused_click_;
};

}  // namespace knuckle::console::screens
