#include "app/console/screens/camera_pane.h"

#include <fmt/format.h>

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "app/console/picture/camera.h"
#include "app/console/picture/machine_panel.h"
#include "app/console/screens/console_data.h"
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

std::string CameraAlign::text() const {
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

namespace {

/// Across the picture, larger than anything else on screen.
void write_alarm(const Ui& ui, const Area& area, const std::string& alarm) {
  const Theme& t = ui.theme;
  const ImFont* font = t.fonts.display;
  const float wanted = 1.5F * font->FontSize;
  const float width = font->CalcTextSizeA(wanted, FLT_MAX, 0, alarm.c_str()).x;
  const float size = wanted * std::min(1.F, (area.width() - t.unit(4)) / std::max(width, 1.F));
  const ImVec2 large = font->CalcTextSizeA(size, FLT_MAX, 0, alarm.c_str());
  const ImVec2 at{std::round(area.centre().x - large.x / 2), std::round(area.centre().y - large.y / 2)};
  canvas().AddRectFilled({at.x - t.unit(2), at.y - t.unit()}, {at.x + large.x + t.unit(2), at.y + large.y + t.unit()},
                         t.colours.stop, t.px(8));
  canvas().AddText(font, size, at, t.colours.stop_text, alarm.c_str());
}

/// On a ground of its own.
void put_note(const Ui& ui, const Area& area, const std::string& text) {
  const Theme& t = ui.theme;
  canvas().AddRectFilled({area.min.x - t.unit(0.5F), area.min.y - t.unit(0.5F)}, area.max, t.colours.surface, t.px(6));
  put_lines(t.fonts.small, t.colours.text, area, text);
}

/// Where the middle of the pixel under the mouse is in a picture, which is drawn in whole pixels.
Eigen::Vector2d share_at_mouse(const Area& picture) {
  const ImGuiIO& io = ImGui::GetIO();
  const ImVec2 s = io.DisplayFramebufferScale;
  const picture::Viewport port = picture::viewport_of(picture);
  const double x_px = static_cast<double>((io.MousePos.x + 0.5F) * s.x) - port.left_px;
  const double up_px = static_cast<double>((io.DisplaySize.y - io.MousePos.y - 0.5F) * s.y) - port.bottom_px;
  return {x_px / port.width_px, 1 - up_px / port.height_px};
}

}  // namespace

std::string video_alarm(video::VideoState state, double age_s) {
  const char* what = state == video::VideoState::kFrozen ? "FROZEN"
                     : state == video::VideoState::kLate ? "LATE"
                                                         : nullptr;
  return what == nullptr ? std::string() : fmt::format("VIDEO {} {:.1f} s", what, age_s);
}

std::string camera_title(const ImFont* font, float width, const std::string& name, const std::string& age) {
  if (age.empty()) return fitted_text(font, width, name);
  const std::string behind = "  " + age;
  return fitted_text(font, width - text_width(font, behind), name) + behind;
}

void CameraPane::add(CameraFeed feed) {
  cameras_.push_back({CameraWatch(std::move(feed)), nullptr});
}

std::optional<Time> CameraPane::watch(Time now, const ConsoleView& view, double view_age_s, EventBook& events) {
  std::optional<Time> came;
  std::vector<CameraWatch::News> news;
  taken_.clear();
  for (Camera& camera : cameras_) {
    const std::unique_ptr<video::Frame> frame = camera.watch.watch(now, news);
    if (!frame) continue;
    taken_.push_back({stamp_of(camera.watch, *frame, now, view.now + from_seconds(view_age_s)), *frame});
    if (!camera.video) camera.video = std::make_unique<picture::VideoView>();
    camera.video->upload(*frame);
    if (&camera == &cameras_[shown_]) came = frame->received;
  }
  if (align_) align_->watch(view, !measured_freshness(view).after(view_age_s).stale());
  if (!given_up_.empty())
    news.push_back({Severity::kInfo, "camera " + given_up_ + ": not aligned: another picture was made large"});
  given_up_.clear();
  for (const CameraWatch::News& n : news) events.add(view.now, view.run, n.severity, "camera", n.what);
  return came;
}

std::optional<estimation::CameraFit> CameraPane::align(const MachineDescription& machine) {
  if (!align_) {
    if (large()) align_.emplace(machine, cameras_[shown_].watch.name());
    return std::nullopt;
  }
  const estimation::CameraFit fit = align_->fit();
  align_.reset();
  return fit;
}

/// On the picture, and the marks of those before: a cross where the tip was clicked, a ring where the fit sees it.
void CameraPane::take_clicks(const Ui& ui, const Camera& camera, const Area& picture) {
  const Theme& t = ui.theme;
  pointer_area("align", picture, ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  if (ImGui::IsItemActivated() && ImGui::IsMouseDown(ImGuiMouseButton_Right)) {
    align_->undo();
  } else if (ImGui::IsItemActivated()) {
    align_->click(share_at_mouse(picture), camera.video->width_px(), camera.video->height_px());
  }
  const auto at = [&picture](const Eigen::Vector2d& share) {
    return ImVec2(picture.min.x + static_cast<float>(share.x()) * picture.width(),
                  picture.min.y + static_cast<float>(share.y()) * picture.height());
  };
  const float arm = t.px(7);
  for (const CameraAlign::Mark& mark : align_->marks()) {
    const ImVec2 c = at(mark.clicked);
    canvas().AddLine({c.x - arm, c.y}, {c.x + arm, c.y}, t.colours.notice, t.px(2));
    canvas().AddLine({c.x, c.y - arm}, {c.x, c.y + arm}, t.colours.notice, t.px(2));
    if (mark.fitted != mark.clicked) canvas().AddCircle(at(mark.fitted), arm, t.colours.notice, 0, t.px(2));
  }
  const Area below = Area(picture).inset(t.unit()).cut_bottom(t.px(66));
  put_note(ui, below, align_->text());
}

void CameraPane::next() {
  if (align_) given_up_ = align_->camera();
  align_.reset();
  if (cameras_.empty()) return;
  if (!machine_large_ && shown_ + 1 < cameras_.size()) {
    ++shown_;
  } else if (!machine_large_) {
    machine_large_ = true;
  } else {
    machine_large_ = false;
    shown_ = 0;
  }
}

bool CameraPane::large() const noexcept {
  return !cameras_.empty() && !machine_large_ && cameras_[shown_].had_picture();
}

const CameraPane::Placed* CameraPane::drawn_large() const noexcept {
  const CameraWatch& watch = cameras_[shown_].watch;
  const bool holds = drawn_ && drawn_->large && drawn_->live && watch.state() == video::VideoState::kLive &&
                     watch.damaged() == drawn_->damaged && drawn_->video->aspect() == drawn_->aspect;
  return holds ? &*drawn_ : nullptr;
}

std::optional<double> CameraPane::aspect() const {
  if (cameras_.empty()) return std::nullopt;
  const Camera& camera = cameras_[shown_];
  return camera.video ? camera.video->aspect() : 16.0 / 9;
}

void CameraPane::place(const Ui& ui, const Area& picture) {
  const Camera& camera = cameras_[shown_];
  placed_ = {picture,
             large(),
             camera.watch.state() == video::VideoState::kLive,
             camera.watch.damaged(),
             *aspect(),
             &camera.watch.name(),
             camera.video.get()};
  write(ui, camera, picture);
  if (align_ && large() && placed_->live) take_clicks(ui, camera, picture);
}

void CameraPane::write(const Ui& ui, const Camera& camera, const Area& area) const {
  const Theme& t = ui.theme;
  const CameraWatch& watch = camera.watch;
  const bool live = watch.state() == video::VideoState::kLive;
  Area rest = area.inset(t.unit());
  const Area head = rest.cut_top(t.px(28), t.unit());
  const std::string age =
      live ? fmt::format("{}{:.2f} s", watch.age_is_relative() ? "+" : "", watch.age_s()) : std::string{};
  const std::string title = camera_title(t.fonts.small, head.width() - chip_width(ui, ""), watch.name(), age);
  const float left = head.min.x + t.unit() +
                     chip(ui, {head.min.x, head.centre().y}, live ? Icon::kDot : Icon::kWarning, title,
                          live ? t.colours.surface : t.colours.notice);
  if (live && watch.damaged()) {
    const std::string damage =
        fitted_text(t.fonts.small, head.max.x - left - chip_width(ui, ""), "DAMAGED: packets lost, parts may be old");
    chip(ui, {left, head.centre().y}, Icon::kWarning, damage, t.colours.notice);
  }
  if (live) return;
  const std::string alarm = video_alarm(watch.state(), watch.age_s());
  if (!alarm.empty()) write_alarm(ui, area, alarm);
  const std::string problem = !watch.problem().empty() ? watch.problem() : alarm.empty() ? "no picture yet" : "";
  if (problem.empty()) return;
  const Area below = rest.cut_bottom(std::min(rest.height(), t.px(66)));
  put_note(ui, below, problem);
}

}  // namespace knuckle::console::screens
