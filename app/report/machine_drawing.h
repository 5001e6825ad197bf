// Draws the machine at given joint angles: links, cylinders, bucket linkage and bucket, from its description.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "app/session/session_result.h"
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

// The session in pictures: machine, wall, loose piece and soil drawn to scale at the key moments.

/// A moment to be drawn.
struct Moment {
  std::size_t row = 0;
  std::string label;
};

/// At most kMostMoments, in time order: the end, faults, the first world event of each kind, then beginnings of phases.
inline constexpr std::size_t kMostMoments = 9;
[[nodiscard]] std::vector<Moment> key_moments(const session::SessionRecord& record);

struct Frame {
  double t_s = 0;
  std::string label;
  std::string svg;    ///< For use inside HTML; classes are styled by filmstrip_css().
  std::string force;  ///< In words, what was known of an estimated force beyond its arrow; empty where nothing.
};
/// All frames show the same part of the world at the same scale, with a bar of one metre.
[[nodiscard]] std::vector<Frame> filmstrip(const session::SessionResult& session);

/// Uses the page's custom properties --ink, --paper, --blue, --vermilion.
[[nodiscard]] std::string filmstrip_css();

}  // namespace knuckle::report
