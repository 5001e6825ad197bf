#include "app/report/machine_drawing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <set>
#include <sstream>

#include "app/report/result_text.h"
#include "estimation/line_of_action.h"
#include "machine/description.h"
#include "machine/kinematics.h"

namespace knuckle::report {
namespace {

std::vector<PlanarVector> moved(const Frame2& frame, const std::vector<PlanarVector>& points_m) {
  std::vector<PlanarVector> all;
  for (const PlanarVector& p : points_m) all.push_back(frame * p);
  return all;
}

void draw_cylinder(SvgCanvas& canvas, const CylinderDescription& cylinder, const MachinePose::Cylinder& pins) {
  const auto& [base, rod_end] = pins;
  const PlanarVector along = (rod_end - base).normalized();
  const PlanarVector gland = base + along * barrel_length_m(cylinder, pins.length_m());
  canvas.wide(cylinder.rod_m).polyline("rod", {gland, rod_end});
  canvas.wide(cylinder.bore_m * 1.25).polyline("barrel", {base, gland});
  canvas.circle("pin", base, cylinder.rod_m * 0.55);
  canvas.circle("pin", rod_end, cylinder.rod_m * 0.55);
}

/// Simplified: of the hull, the description has only the place of the boom pin.
void draw_hull(SvgCanvas& canvas, double size_m, double ground_m) {
  const double track_top_m = std::min(ground_m + 0.13 * size_m, -0.1 * size_m);
  canvas.rounded_box("track", {-0.52 * size_m, ground_m}, {0.1 * size_m, track_top_m}, 0.06 * size_m);
  canvas.polygon("hull", {{-0.5 * size_m, track_top_m + 0.01 * size_m},
                          {0.09 * size_m, track_top_m + 0.01 * size_m},
                          {0.09 * size_m, -0.05 * size_m},
                          {0.03 * size_m, 0.03 * size_m},
                          {-0.12 * size_m, 0.05 * size_m},
                          {-0.5 * size_m, 0.04 * size_m}});
}

}  // namespace

std::vector<PlanarVector> outline(const MachineDescription& m, const JointVector& q) {
  const MachinePose pose = pose_of(m, q);
  return {pose.cylinders[kArm].base_m, pose.cylinders[kArm].rod_end_m, pose.cylinders[kBucket].base_m,
          pose.bucket.translation(), pose.tip_m};
}

void draw_machine(SvgCanvas& canvas, const MachineDescription& m, const JointVector& q, double ground_m) {
  const double size = reach_m(m);
  const double boom_length = m.links[kBoom].length_m, arm_length = m.links[kArm].length_m;
  const MachinePose pose = pose_of(m, q);
  const Frame2 &boom = pose.boom, &arm = pose.arm, &bucket = pose.bucket;
  const PlanarVector d = m.boom_mount.child_pin_m, e = m.arm_mount.parent_pin_m;
  const PlanarVector f = m.arm_mount.child_pin_m, g = m.bucket_linkage.cylinder_pin_m,
                     j = m.bucket_linkage.rocker_pin_m;

  draw_hull(canvas, size, ground_m);
  draw_cylinder(canvas, m.cylinders[kBoom], pose.cylinders[kBoom]);
  // The boom is bent: its crest lies between the two cylinder pins.
  const PlanarVector crest = 0.5 * d + 0.5 * e - PlanarVector(0, 0.025 * size);
  const double w = 0.022 * size;
  canvas.polygon("link", moved(boom, {{-w, 0},
                                      {crest.x() * 0.8, crest.y() + w},
                                      {e.x(), e.y() + 0.4 * w},
                                      {e.x() + w, e.y()},
                                      {crest.x() * 1.25, crest.y() + 0.6 * w},
                                      {boom_length + w, 0},
                                      {boom_length, -w},
                                      {crest.x() * 1.15, d.y() - 0.5 * w},
                                      {d.x(), d.y() - w},
                                      {crest.x() * 0.8, d.y() * 0.75 - w},
                                      {0, -w}}));
  const auto corners = bucket_outline(m);
  canvas.polygon("bucket", moved(bucket, {corners.begin(), corners.end()}));
  canvas.polygon("link", moved(arm, {f,
                                     g,
                                     {j.x(), j.y() + 0.9 * w},
                                     {arm_length, 0.8 * w},
                                     {arm_length, -0.8 * w},
                                     {0, -1.3 * w},
                                     {f.x() - 0.4 * w, f.y() - 0.6 * w}}));
  draw_cylinder(canvas, m.cylinders[kArm], pose.cylinders[kArm]);
  canvas.wide(0.6 * w).polyline("rocker", {pose.rocker_pin_m, pose.linkage_pin_m, pose.bucket_pin_m});
  draw_cylinder(canvas, m.cylinders[kBucket], pose.cylinders[kBucket]);
  for (const Frame2* frame : {&boom, &arm, &bucket}) canvas.circle("pin", frame->translation(), 0.45 * w);
}

void SvgCanvas::shape(const char* element, const char* css_class, const std::vector<PlanarVector>& points_m) {
  out_ << '<' << element << " class=\"" << css_class << '"';
  if (width_m_ > 0) out_ << " stroke-width=\"" << width_m_ << '"';
  width_m_ = 0;
  out_ << " points=\"";
  for (const PlanarVector& p : points_m) out_ << p.x() << ',' << -p.y() << ' ';
  out_ << "\"/>";
}

void SvgCanvas::polygon(const char* css_class, const std::vector<PlanarVector>& points_m) {
  shape("polygon", css_class, points_m);
}

void SvgCanvas::polyline(const char* css_class, const std::vector<PlanarVector>& points_m) {
  shape("polyline", css_class, points_m);
}

void SvgCanvas::circle(const char* css_class, const PlanarVector& centre_m, double radius_m) {
  out_ << "<circle class=\"" << css_class << "\" cx=\"" << centre_m.x() << "\" cy=\"" << -centre_m.y() << "\" r=\""
       << radius_m << "\"/>";
}

void SvgCanvas::rounded_box(const char* css_class, const PlanarVector& low_m, const PlanarVector& high_m,
                            double radius_m) {
  out_ << "<rect class=\"" << css_class << "\" x=\"" << low_m.x() << "\" y=\"" << -high_m.y() << "\" width=\""
       << high_m.x() - low_m.x() << "\" height=\"" << high_m.y() - low_m.y() << "\" rx=\"" << radius_m << "\"/>";
}

namespace {

constexpr double kSameMoment_s = 0.3;
constexpr double kTrail_s = 4;

/// What every frame shows: the hull, the tip's whole path and the scene within reach.
struct Stage {
  Eigen::AlignedBox2d box;
  double size_m = 1, ground_m = 0;
  double metres_per_N = 0;

  [[nodiscard]] double head_m() const { return 0.035 * size_m; }  ///< Of an arrow.

  Stage(const session::SessionResult& session, const std::vector<Moment>& moments) : size_m(reach_m(session.machine)) {
    ground_m = ground_level(session.scene, session.machine);
    box.extend(PlanarVector(-0.58 * size_m, ground_m - 0.06 * size_m));
    box.extend(PlanarVector(0.75 * size_m, 0.3 * size_m));
    double most_N = 1;
    for (const session::Sample& s : session.record.samples) {
      box.extend(s.truth.tip_m);
      most_N = std::max(most_N, s.truth.tip_force_N.norm());
    }
    for (const Moment& m : moments)
      for (const PlanarVector& p : outline(session.machine, session.record.samples[m.row].truth.joint_rad))
        box.extend(p);
    // Of what stands around, at least the near face is seen.
    for (const session::SceneLine& line : session.scene) {
      if (!line.closed) continue;
      double near_m = 1e9;
      for (const PlanarVector& p : line.points_m) near_m = std::min(near_m, p.x());
      box.extend(PlanarVector(std::min(near_m, size_m), 0));
    }
    box.min().array() -= 0.06 * size_m;
    box.max().array() += 0.06 * size_m;
    metres_per_N = 0.3 * size_m / most_N;
  }

 private:
  /// Ground or soil where the machine stands; else as high as its tracks usually are.
  [[nodiscard]] static double ground_level(const session::Scene& scene, const MachineDescription& machine) {
    for (const session::SceneLine& line : scene)
      if (line.kind == session::SceneLine::Kind::kGround && !line.points_m.empty()) return line.points_m.front().y();
    return ground_level_m(machine);
  }
};

const char* css_class(session::SceneLine::Kind kind) {
  static constexpr std::array kNames{"ground", "wall", "piece", "soil", "virtual"};
  static_assert(kNames.size() == static_cast<std::size_t>(session::SceneLine::Kind::kVirtualWall) + 1);
  return kNames[static_cast<std::size_t>(kind)];
}

void draw_scene(SvgCanvas& canvas, const session::Scene& scene, const Stage& stage, double t_s) {
  for (const session::SceneLine& line : scene) {
    if (t_s < line.from_s || t_s >= line.until_s || line.points_m.empty()) continue;
    auto points = line.points_m;
    if (line.kind == session::SceneLine::Kind::kVirtualWall) {
      canvas.polyline(css_class(line.kind), points);
      continue;
    }
    if (!line.closed) {  // material below an open line
      const double bottom_m = stage.box.min().y() - 1;
      points.emplace_back(points.back().x(), bottom_m);
      points.emplace_back(points.front().x(), bottom_m);
    }
    canvas.polygon(css_class(line.kind), points);
  }
}

bool is_drawn(const PlanarVector& force_N, const Stage& stage) {
  return stage.metres_per_N * force_N.norm() >= 1.5 * stage.head_m();
}

PlanarVector left_of(const PlanarVector& force_N) {
  const PlanarVector along = force_N.normalized();
  return {-along.y(), along.x()};
}

/// An arrow from where the force acts: a wall's push points out of the wall, where it can be seen.
void draw_force(SvgCanvas& canvas, const char* shaft, const char* head, const PlanarVector& from_m,
                const PlanarVector& force_N, const Stage& stage) {
  if (!is_drawn(force_N, stage)) return;
  const PlanarVector aside = 0.45 * stage.head_m() * left_of(force_N);
  const PlanarVector point = from_m + stage.metres_per_N * force_N;
  const PlanarVector neck = point - stage.head_m() * force_N.normalized();
  canvas.polyline(shaft, {from_m, neck});
  canvas.polygon(head, {point, neck + aside, neck - aside});
}

/// Where the estimated force's line of action comes into the bucket, drawn at this pose: there the world pushes. Of a
/// line that passes the bucket by, its point nearest to the tip; without a line the tip.
PlanarVector pushed_at(const MachineDescription& machine, const MachinePose& pose, const slave::SlaveState& state) {
  if (state.line_sigma_m == 0) return pose.tip_m;
  const PlanarVector left = left_of(state.tip_force_N);
  const PlanarVector at = pose.tip_m + state.line_offset_m * left;
  const auto corners = bucket_outline(machine);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const PlanarVector corner = pose.bucket * corners[i], next = pose.bucket * corners[(i + 1) % corners.size()];
    const double before = left.dot(corner - at), after = left.dot(next - at);
    // Counter-clockwise along the outline the line comes in where the corners change from its left to its right.
    if (before >= 0 && after < 0) return corner + before / (before - after) * (next - corner);
  }
  return at;
}

/// Along the line of action, as wide as 95 % of it.
void draw_line_of_action(SvgCanvas& canvas, const PlanarVector& at_m, const slave::SlaveState& state,
                         const Stage& stage) {
  if (state.line_sigma_m == 0 || !is_drawn(state.tip_force_N, stage)) return;
  const PlanarVector along = 0.15 * stage.size_m * state.tip_force_N.normalized();
  const PlanarVector aside = kTwoSided95 * state.line_sigma_m * left_of(state.tip_force_N);
  canvas.polygon("line", {at_m - along + aside, at_m - along - aside, at_m + along - aside, at_m + along + aside});
}

/// What the machine knew beyond the size of a force that is drawn; empty where it knew nothing.
std::string force_text(const slave::SlaveState& state, const Stage& stage) {
  if (state.tip_torque_sigma_Nm == 0 || !is_drawn(state.tip_force_N, stage)) return {};
  const std::string text = "estimated torque about the tip " + number_text(state.tip_torque_Nm) + " ± " +
                           shown(kTwoSided95 * state.tip_torque_sigma_Nm, "N m");
  const auto side = std::ranges::max_element(state.touched_share);
  if (state.line_sigma_m == 0) return text + "; line of action not known";
  if (*side == 0) return text + "; its line of action passes the bucket by";
  return text + "; most likely touched: " +
         estimation::kBucketSideNames[static_cast<std::size_t>(side - state.touched_share.begin())] + " (" +
         number_text(100 * *side, 2) + " %)";
}

std::vector<PlanarVector> trail(const session::SessionRecord& record, std::size_t row) {
  std::vector<PlanarVector> points;
  std::size_t i = row;
  while (i > 0 && record.samples[row].t_s - record.samples[i].t_s < kTrail_s) --i;
  for (; i <= row; ++i)
    if (points.empty() || (record.samples[i].truth.tip_m - points.back()).norm() > 0.01)
      points.push_back(record.samples[i].truth.tip_m);
  return points;
}

void draw_scale_bar(std::ostringstream& svg, const Stage& stage) {
  const double x = stage.box.min().x() + 0.04 * stage.size_m, y = -stage.box.min().y() - 0.04 * stage.size_m;
  svg << "<path class=\"scale\" d=\"M" << x << ' ' << y - 0.03 << "v.06M" << x << ' ' << y << "h1m0-.03v.06\"/>"
      << "<text class=\"scale\" font-size=\"" << 0.05 * stage.size_m << "\" x=\"" << x + 1.06 << "\" y=\""
      << y + 0.017 * stage.size_m << "\">1 m</text>";
}

std::string frame_svg(const session::SessionResult& session, const Stage& stage, std::size_t row) {
  const session::Sample& s = session.record.samples[row];
  std::ostringstream svg;
  svg.precision(4);
  const PlanarVector size = stage.box.sizes();
  svg << "<svg class=\"frame\" role=\"img\" viewBox=\"" << stage.box.min().x() << ' ' << -stage.box.max().y() << ' '
      << size.x() << ' ' << size.y() << "\">";
  SvgCanvas canvas(svg);
  draw_scene(canvas, session.scene, stage, s.t_s);
  canvas.polyline("trail", trail(session.record, row));
  draw_machine(canvas, session.machine, s.truth.joint_rad, stage.ground_m);
  const MachinePose pose = pose_of(session.machine, s.truth.joint_rad);
  const PlanarVector estimated_m = pushed_at(session.machine, pose, s.machine);
  draw_line_of_action(canvas, estimated_m, s.machine, stage);
  const bool acts = !s.truth.contact_m.isZero(0);
  draw_force(canvas, "truth", "truthhead", acts ? PlanarVector(pose.bucket * s.truth.contact_m) : s.truth.tip_m,
             s.truth.tip_force_N, stage);
  draw_force(canvas, "estimate", "estimatehead", estimated_m, s.machine.tip_force_N, stage);
  draw_scale_bar(svg, stage);
  svg << "</svg>";
  return svg.str();
}

/// Moments in time order, those at one time joined into one label.
void add_moment(std::vector<Moment>& moments, const session::SessionRecord& record, std::size_t row,
                const std::string& label) {
  for (Moment& m : moments) {
    if (std::abs(record.samples[m.row].t_s - record.samples[row].t_s) > kSameMoment_s) continue;
    if (m.label.find(label) == std::string::npos) m.label += ", " + label;
    return;
  }
  moments.push_back({row, label});
}

std::size_t row_at(const session::SessionRecord& record, double t_s) {
  const auto& rows = record.samples;
  const auto later =
      std::lower_bound(rows.begin(), rows.end(), t_s, [](const session::Sample& s, double t) { return s.t_s < t; });
  return std::min(static_cast<std::size_t>(later - rows.begin()), rows.size() - 1);
}

}  // namespace

std::vector<Moment> key_moments(const session::SessionRecord& record) {
  std::vector<Moment> moments;
  if (record.samples.empty()) return moments;
  add_moment(moments, record, record.samples.size() - 1, "end");
  const auto add = [&](std::size_t row, const std::string& label) {
    if (moments.size() < kMostMoments) add_moment(moments, record, row, label);
  };
  for (const session::FaultRecord& fault : record.faults)
    add(row_at(record, fault.at_s), plain_text(name(fault.reason.code)));
  std::set<std::string> shown;  // the first touch is worth a picture, its chatter is not
  for (const session::EventRecord& event : record.events)
    if (shown.insert(event.what).second) add(row_at(record, event.t_s), plain_text(event.what));
  for (std::size_t i = 1; i < record.samples.size(); ++i) {
    const auto phase = record.samples[i].phase;
    if (phase != record.samples[i - 1].phase && phase < record.phases.size()) add(i, plain_text(record.phases[phase]));
  }
  add(0, "start");
  std::sort(moments.begin(), moments.end(), [](const Moment& a, const Moment& b) { return a.row < b.row; });
  return moments;
}

std::vector<Frame> filmstrip(const session::SessionResult& session) {
  std::vector<Frame> frames;
  if (session.record.samples.empty()) return frames;
  const std::vector<Moment> moments = key_moments(session.record);
  const Stage stage(session, moments);
  for (const Moment& m : moments)
    frames.push_back({session.record.samples[m.row].t_s, m.label, frame_svg(session, stage, m.row),
                      force_text(session.record.samples[m.row].machine, stage)});
  return frames;
}

std::string filmstrip_css() {
  return R"(.frame{display:block;width:100%;stroke-linejoin:round;stroke-linecap:round}
.frame .ground{fill:var(--ground);stroke:none}.frame .soil{fill:var(--soil);stroke:none}
.frame .wall{fill:var(--wall);stroke:none}.frame .piece{fill:var(--piece);stroke:var(--paper);stroke-width:.015}
.frame .virtual{fill:none;stroke:var(--blue);stroke-width:.015;stroke-dasharray:.06 .05}
.frame .trail{fill:none;stroke:var(--blue);stroke-width:.014;stroke-opacity:.55}
.frame .hull{fill:var(--hull);stroke:none}.frame .track{fill:var(--track);stroke:none}
.frame .link{fill:var(--link);stroke:var(--edge);stroke-width:.014}
.frame .bucket{fill:var(--bucket);stroke:var(--edge);stroke-width:.014}
.frame .barrel{fill:none;stroke:var(--edge);stroke-linecap:butt}.frame .rod{fill:none;stroke:var(--rod);stroke-linecap:butt}
.frame .rocker{fill:none;stroke:var(--edge)}.frame .pin{fill:var(--paper);stroke:var(--edge);stroke-width:.01}
.frame .truth{fill:none;stroke:var(--vermilion);stroke-width:.045}.frame .truthhead{fill:var(--vermilion)}
.frame .line{fill:var(--blue);fill-opacity:.22;stroke:none}
.frame .estimate{fill:none;stroke:var(--blue);stroke-width:.018}.frame .estimatehead{fill:var(--blue)}
.frame path.scale{fill:none;stroke:var(--ink);stroke-width:.014}.frame text.scale{fill:var(--ink)}
)";
}

}  // namespace knuckle::report
