#include "app/report/machine_drawing.h"

#include "machine/description.h"
#include "machine/pose.h"

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

}  // namespace knuckle::report
