#include "app/console/picture/machine_panel.h"

#include <imgui.h>

#include <cmath>

#include "app/console/machine_text.h"
#include "app/console/widgets/widgets.h"
#include "estimation/line_of_action.h"

namespace knuckle::console::picture {
namespace {

Eigen::Vector2d pixels(ImVec2 v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y)};
}

estimation::BucketLoad load_of(const SlaveMessage& m) {
  const auto& [xx, xz, zz] = m.covariance_N2;
  estimation::BucketLoad load;
  load.force_N = m.tip_force_N;
  load.covariance_N2 << xx, xz, xz, zz;
  load.torque_Nm = m.tip_torque_Nm;
  load.torque_variance_N2m2 = m.tip_torque_sigma_Nm * m.tip_torque_sigma_Nm;
  load.covariance_N2m = {m.force_torque_covariance_N2m[0], m.force_torque_covariance_N2m[1]};
  return load;
}

}  // namespace

Viewport viewport_of(const Area& picture) {
  const ImGuiIO& io = ImGui::GetIO();
  const ImVec2 s = io.DisplayFramebufferScale;
  const auto pixel = [](float v) { return static_cast<int>(std::lround(v)); };
  return {.left_px = pixel(picture.min.x * s.x),
          .bottom_px = pixel((io.DisplaySize.y - picture.max.y) * s.y),
          .width_px = std::max(1, pixel(picture.width() * s.x)),
          .height_px = std::max(1, pixel(picture.height() * s.y)),
          .line_scale = static_cast<double>(ImGui::GetFontSize()) / 18};
}

MachinePanel::MachinePanel(const MachineDescription& machine)
    : machine_(machine),
      kinematics_(machine),
      view_(machine),
      side_(side_camera(machine)),
      orbit_(orbit_camera(machine)),
      scene_(reach_m(machine)) {
  scene_.begin({});
}

void MachinePanel::watch(const ConsoleView& view) {
  if (!force_text(view).contact || view.now < contact_since_)
    contact_since_ = kNever;
  else if (contact_since_ == kNever)
    contact_since_ = view.now;
  if (view.simulated) scene_.watch(view.truth.events);
}

void MachinePanel::take_mouse(const Area& picture, bool side_view, const ConsoleView& view) {
  pulled_ = {};
  // A pull that has ended begins anew with a new press only.
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) {
    pulled_in_.reset();
    pull_ended_ = false;
  }
  if (picture.width() < 1 || picture.height() < 1) {
    pull_ended_ |= pulled_in_.has_value();
    return;
  }
  pointer_area("picture", picture, ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  const ImGuiIO& io = ImGui::GetIO();
  const Viewport port = viewport_of(picture);
  const Eigen::Vector2d scale = pixels(io.DisplayFramebufferScale);
  const Eigen::Vector2d drag = pixels(io.MouseDelta).cwiseProduct(scale);
  const bool held = ImGui::IsItemActive(), left = held && ImGui::IsMouseDown(ImGuiMouseButton_Left);
  const ImVec2 at{io.MousePos.x - picture.min.x, io.MousePos.y - picture.min.y};
  const auto mouse_m = plane_point(side_, port, pixels(at).cwiseProduct(scale));
  Camera& camera = side_view ? side_ : orbit_;
  const bool pulls = left && side_view;
  // A press that began by turning the view does not become a pull.
  pull_ended_ |= left && !side_view;
  // A picture that has got another place or size under the mouse ends the pull, too.
  pull_ended_ |= pulled_in_ && !(pulls && *pulled_in_ == port);
  if (!pulls && held && ImGui::IsMouseDown(ImGuiMouseButton_Right)) camera = shifted(camera, drag, port);
  if (!pulls && ImGui::IsItemHovered() && io.MouseWheel != 0)
    camera = zoomed(camera, static_cast<double>(io.MouseWheel), mouse_m.value_or(PlanarVector::Zero()));
  if (left && !side_view) orbit_ = turned(orbit_, drag, port);
  if (!pulls) return;
  if (!pulled_in_) pulled_in_ = port;
  if (mouse_m && !pull_ended_)
    pulled_ = hand_from_drag(*mouse_m - kinematics_.tip(view.hand.ghost_rad), view.hand.ghost_rad, kinematics_);
}

void MachinePanel::zoom(bool side_view, double steps, const PlanarVector& about_m) {
  if (pulled_.presence) return;
  Camera& camera = side_view ? side_ : orbit_;
  camera = zoomed(camera, steps, about_m);
}

void MachinePanel::show_whole() {
  if (pulled_.presence) return;
  side_ = side_camera(machine_);
  orbit_ = orbit_camera(machine_);
}

MachinePicture MachinePanel::picture_of(const ConsoleView& view, bool stale, const ConsoleView* beside) const {
  const SlaveMessage& m = view.machine;
  MachinePicture p;
  p.measured_rad = view.link.heard || !view.hand.set_point_rad.allFinite() ? m.position_rad : view.hand.set_point_rad;
  p.measured_is_stale = stale;
  // Before the machine is led or the device held, both are a loop's initial values: neither commanded nor requested.
  const bool usable = !view.hand.device && view.link.heard, leads = usable && led(m.mode);
  // What was not recorded is no number.
  if (leads && view.hand.set_point_rad.allFinite()) p.commanded_rad = view.hand.set_point_rad;
  if ((leads || (usable && view.hand.presence)) && view.hand.ghost_rad.allFinite()) p.hand_rad = view.hand.ghost_rad;
  if (beside != nullptr && beside->link.heard) p.beside_rad = beside->machine.position_rad;
  const ForceText said = force_text(view);
  if (said.known && !stale) {
    p.tip_force_N = m.tip_force_N;
    p.covariance_N2 = m.covariance_N2;
    const estimation::LineOfAction line = estimation::line_of_action(load_of(m));
    p.line_offset_m = line.offset_m;
    p.line_sigma_m = line.sigma_m;
    p.confidence = m.confidence;
    p.contact = said.contact;
    p.contact_s = contact_since_ == kNever ? 1e9 : to_seconds(view.now - contact_since_);
  }
  p.scene = &scene_.scene();
  p.scene_s = view.simulated_s;
  return p;
}

void MachinePanel::draw(const Area& picture, bool side_view, bool light, bool stale, const ConsoleView& view,
                        const std::optional<Grid>& grid, const ConsoleView* beside) {
  MachinePicture p = picture_of(view, stale, beside);
  p.grid = grid;
  view_.draw(p, camera(side_view), viewport_of(picture), light ? light_picture_colours() : dark_picture_colours());
}

void MachinePanel::draw_over(const Area& picture, const CameraDescription& mount, bool light, const ConsoleView& view) {
  view_.draw_over(picture_of(view, false), mounted_camera(machine_, mount), viewport_of(picture),
                  light ? light_picture_colours() : dark_picture_colours());
}

}  // namespace knuckle::console::picture
