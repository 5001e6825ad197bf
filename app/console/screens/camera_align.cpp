#include "app/console/screens/camera_align.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/console/picture/camera.h"
#include "machine/load.h"

namespace knuckle::console::screens {
namespace {

constexpr double kAtRest_radps = 0.01;
constexpr Duration kRested = 1s;  // longer than a live picture is old: it shows the pose that is measured now
// In parts of the machine's reach:
constexpr double kAtRest = 0.003;  // where the tip was when it came to rest
constexpr double kApart = 0.03;    // from one tip to the next

CameraDescription start_of(const MachineDescription& machine, const std::string& camera) {
  if (const CameraDescription* known = find_camera(machine, camera)) return *known;
  CameraDescription start;
  start.name = camera;
  return start;
}

}  // namespace

CameraAlign::CameraAlign(const MachineDescription& machine, const std::string& camera)
    : kinematics_(machine), start_(start_of(machine, camera)), reach_m_(reach_m(machine)) {
  solve();
}

void CameraAlign::watch(const ConsoleView& view, bool fresh) noexcept {
  fresh_ = fresh;
  const PlanarVector tip_m = kinematics_.tip(view.machine.position_rad);
  const bool moves = view.machine.velocity_radps.cwiseAbs().maxCoeff() >= kAtRest_radps ||
                     (tip_m - rest_m_).norm() > kAtRest * reach_m_ || view.now < rest_since_;
  if (moves || !fresh || rest_since_ == kNever) {
    rest_since_ = view.now;
    rest_m_ = tip_m;
  }
  rested_ = view.now - rest_since_ >= kRested;
  tip_m_ = tip_m;
}

void CameraAlign::click(const Eigen::Vector2d& share, int width_px, int height_px) {
  const bool same = std::any_of(clicks_.begin(), clicks_.end(), [this](const Click& click) {
    return (click.tip_m - tip_m_).norm() < kApart * reach_m_;
  });
  refused_click_ = !fresh_    ? "not taken: where the machine is, is not known now"
                   : !rested_ ? "not taken: the machine has to stand still for a second before the click"
                   : same     ? "not taken: the tip was clicked here before; move it on"
                              : "";
  if (!refused_click_.empty()) return;
  width_px_ = width_px;
  height_px_ = height_px;
  clicks_.push_back({tip_m_, share});
  solve();
}

void CameraAlign::undo() {
  if (!clicks_.empty()) clicks_.pop_back();
  refused_click_.clear();
  solve();
}

void CameraAlign::solve() {
  const Eigen::Vector2d size_px(width_px_, height_px_);
  std::vector<estimation::TipSight> sights;
  for (const Click& click : clicks_) sights.push_back({click.tip_m, click.share.cwiseProduct(size_px)});
  fit_ = estimation::fit_camera(sights, start_, width_px_, height_px_, reach_m_);
}

std::string CameraAlign::words() const {
  const std::string what = "Align " + start_.name + ": click the middle of the bucket's tip with the machine at rest. ";
  if (!refused_click_.empty()) return what + refused_click_;
  if (!fit_.refused.empty()) return what + fit_.refused;
  return fmt::format("{}{} poses, residual {:.1f} px (drawn over within {:.0f} px). K: done", what, clicks_.size(),
                     fit_.rms_px, 2 * fit_.drawn_sd_px);
}

std::vector<CameraAlign::Mark> CameraAlign::marks() const {
  std::vector<Mark> marks;
  const Eigen::Array2d size(width_px_, height_px_);
  const picture::Viewport port{.width_px = width_px_, .height_px = height_px_};
  picture::Camera camera;
  camera.kind = picture::Camera::Kind::kMounted;
  camera.mount = fit_.camera;
  for (const Click& click : clicks_) {
    const auto at = picture::pixel_of(camera, port, {click.tip_m.x(), 0, click.tip_m.y()});
    marks.push_back({click.share, fit_.residual_px.empty() || !at ? click.share : Eigen::Vector2d(at->array() / size)});
  }
  return marks;
}

}  // namespace knuckle::console::screens
