// Cameras on the Operate screen: one of them, or the machine, fills the pane, the other is a small picture in it. A
// picture that is not live is grey, with its age across it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/console/camera_watch.h"
#include "app/console/console_view.h"
#include "app/console/picture/layer.h"
#include "app/console/widgets/widgets.h"
#include "estimation/identification/camera_fit.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::console::screens {

// Aligning a camera: its place on the machine from clicks on the bucket's tip in its picture. No window here.

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
  [[nodiscard]] std::string text() const;
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

/// The name gives way where both do not fit, so that the age is always read. @param age may be empty.
[[nodiscard]] std::string camera_title(const ImFont* font, float width, const std::string& name,
                                       const std::string& age);

class CameraPane {
 public:
  void add(CameraFeed feed);
  /// What the machine's side seals the pictures of a camera with, by its name.
  void set_keys(const std::function<video::PictureKey(const std::string&)>& key_of) const {
    for (const Camera& camera : cameras_) camera.watch.set_key(key_of(camera.watch.name()));
  }
  [[nodiscard]] bool empty() const noexcept { return cameras_.empty(); }
  /// Once a frame: takes the newest pictures in, and notes what has happened. OpenGL's context is current.
  /// @param now video::now(). @param view_age_s how much earlier the view was made. @return when the new picture of the
  /// camera that is shown was here; nullopt: there is no new one.
  std::optional<Time> watch(Time now, const ConsoleView& view, double view_age_s, EventBook& events);
  struct Taken {
    recording::CameraStamp stamp;
    video::Frame frame;
  };
  /// What the last watch() took in.
  [[nodiscard]] const std::vector<Taken>& taken() const noexcept { return taken_; }
  /// The key: each camera in turn fills the pane, then the machine.
  void next();

  /// The key: begins to align the camera that fills the pane. @return what came of one that was begun before; nullopt:
  /// none was.
  std::optional<estimation::CameraFit> align(const MachineDescription& machine);
  [[nodiscard]] bool aligning() const noexcept { return align_.has_value(); }

  /// Whether the camera, not the machine, fills the pane. One that never gave a picture does not.
  [[nodiscard]] bool large() const noexcept;

  /// Of the chosen camera's picture; nullopt: there is no camera.
  [[nodiscard]] std::optional<double> aspect() const;
  /// Where the chosen camera's picture goes, and what is said of it. Once a frame, on the screen that has the pane.
  void place(const Ui& ui, const Area& picture);

  /// What place() has found, until draw_done().
  struct Placed {
    Area picture;        ///< Of the camera; its whole width and height are in it.
    bool large = false;  ///< It fills the pane, the machine is the small one.
    bool live = false;
    bool damaged = false;
    double aspect = 0;
    const std::string* name = nullptr;
    const picture::VideoView* video = nullptr;
  };
  [[nodiscard]] const std::optional<Placed>& placed() const noexcept { return placed_; }
  void draw_done() noexcept { drawn_ = std::exchange(placed_, std::nullopt); }
  /// What was placed in the whole frame drawn last: the camera that fills the pane, where it is live and what is
  /// written over it still holds.
  [[nodiscard]] const Placed* drawn_large() const noexcept;

 private:
  struct Camera {
    CameraWatch watch;
    std::unique_ptr<picture::VideoView> video;  ///< Made with the first picture.
    bool had_picture() const noexcept { return watch.state() != video::VideoState::kNone; }
  };
  void write(const Ui& ui, const Camera& camera, const Area& area) const;
  void take_clicks(const Ui& ui, const Camera& camera, const Area& picture);

  std::vector<Camera> cameras_;
  std::vector<Taken> taken_;
  std::size_t shown_ = 0;  ///< The camera that is shown, large or small.
  bool machine_large_ = false;
  std::optional<CameraAlign> align_;  ///< Of the camera that is shown.
  std::string given_up_;              ///< The camera whose alignment was given up since the last watch().
  std::optional<Placed> placed_, drawn_;
};

/// "VIDEO FROZEN 0.4 s"; empty while it is live.
[[nodiscard]] std::string video_alarm(video::VideoState state, double age_s);

}  // namespace knuckle::console::screens
