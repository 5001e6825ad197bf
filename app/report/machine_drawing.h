// Draws the machine at given joint angles: links, cylinders, bucket linkage and bucket, from its description.
#pragma once

#include <ostream>
#include <vector>

#include "core/joints.h"
#include "machine/description_fwd.h"

namespace knuckle::report {

/// Writes SVG shapes in metres, y down; the caller sets the frame. Classes: hull, track, link, bucket, rod, barrel,
/// pin.
class SvgCanvas {
 public:
  explicit SvgCanvas(std::ostream& out) : out_(out) {}
  void polygon(const char* css_class, const std::vector<PlanarVector>& points_m);
  void polyline(const char* css_class, const std::vector<PlanarVector>& points_m);
  void circle(const char* css_class, const PlanarVector& centre_m, double radius_m);
  void rounded_box(const char* css_class, const PlanarVector& low_m, const PlanarVector& high_m, double radius_m);
  /// Stroke width in metres for the next polyline or polygon; 0 leaves it to the style sheet.
  SvgCanvas& wide(double width_m) {
    width_m_ = width_m;
    return *this;
  }

 private:
  void shape(const char* element, const char* css_class, const std::vector<PlanarVector>& points_m);
  std::ostream& out_;
  double width_m_ = 0;
};

/// @param joints_rad boom, arm, bucket. @param ground_m height of the ground under the hull, frame M.
void draw_machine(SvgCanvas& canvas, const MachineDescription& machine, const JointVector& joints_rad, double ground_m);

/// The outermost points of the arm at these angles, frame M: what a picture of it must hold.
[[nodiscard]] std::vector<PlanarVector> outline(const MachineDescription& machine, const JointVector& joints_rad);

}  // namespace knuckle::report
