#include "app/console/screens/camera_align.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/console/picture/camera.h"

namespace knuckle::console::screens {
namespace {

constexpr double kAtRest_radps = 0.01;
constexpr double kApart = 0.03;  // from one tip to the next, in parts of the machine's reach

CameraDescription start_of(const MachineDescription& machine, const std::string& camera) {
  const auto known = std::find_if(machine.cameras.begin(), machine.cameras.end(),
                                  [&camera](const CameraDescription& c) { return c.name == camera; });
  if (known != machine.cameras.end()) return *known;
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
  at_rest_ = view.machine.velocity_radps.cwiseAbs().maxCoeff() < kAtRest_radps;
  tip_m_ = kinematics_.tip(view.machine.position_rad);
}

void CameraAlign::click(const Eigen::Vector2d& share, int width_px, int height_px) {
  const bool same = std::any_of(sights_.begin(), sights_.end(), [this](const estimation::TipSight& sight) {
    return (sight.tip_m - tip_m_).norm() < kApart * reach_m_;
  });
  refused_click_ = !fresh_     ? "not taken: where the machine is, is not known now"
                   : !at_rest_ ? "not taken: the machine moves; let it stand still, then click"
                   : same      ? "not taken: the tip was clicked here before; move it on"
                               : "";
  if (!refused_click_.empty()) return;
  width_px_ = width_px;
  height_px_ = height_px;
  sights_.push_back({tip_m_, share.cwiseProduct(Eigen::Vector2d(width_px, height_px))});
  solve();
}

void CameraAlign::undo() {
  if (!sights_.empty()) sights_.pop_back();
  refused_click_.clear();
  solve();
}

void CameraAlign::solve() {
  fit_ = estimation::fit_camera(sights_, start_, width_px_, height_px_, reach_m_);
}

std::string CameraAlign::words() const {
  const std::string what = "Align " + start_.name + ": click the middle of the bucket's tip with the machine at rest. ";
  if (!refused_click_.empty()) return what + refused_click_;
  if (!fit_.refused.empty()) return what + fit_.refused;
  return fmt::format("{}{} poses, residual {:.1f} px (drawn over within {:.0f} px). K: done", what, sights_.size(),
                     fit_.rms_px, 2 * fit_.drawn_sd_px);
}

std::vector<CameraAlign::Mark> CameraAlign::marks() const {
  std::vector<Mark> marks;
  const Eigen::Array2d size(width_px_, height_px_);
  const picture::Viewport port{.width_px = width_px_, .height_px = height_px_};
  picture::Camera camera;
  camera.kind = picture::Camera::Kind::kMounted;
  camera.mount = fit_.camera;
  for (const estimation::TipSight& sight : sights_) {
    const auto at = picture::pixel_of(camera, port, {sight.tip_m.x(), 0, sight.tip_m.y()});
    const Eigen::Vector2d clicked = sight.pixel.array() / size;
    marks.push_back({clicked, fit_.residual_px.empty() || !at ? clicked : Eigen::Vector2d(at->array() / size)});
  }
  return marks;
}

}  // namespace knuckle::console::screens
