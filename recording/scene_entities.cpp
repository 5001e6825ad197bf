#include "recording/scene_entities.h"

#include <cmath>

#include "recording/fields.h"

namespace knuckle::recording {
namespace {

constexpr double kLabelHeight_px = 16;

void put_count(CdrWriter& out, std::size_t count) noexcept {
  out.put(static_cast<std::uint32_t>(count));
}
template <typename Element>
void put_each(CdrWriter& out, std::span<const Element> elements) noexcept {
  put_count(out, elements.size());
  for (const Element& element : elements) put(out, element);
}

void put_line(CdrWriter& out, const Line& line) noexcept {
  put(out, line.kind);
  put(out, Pose3{});
  out.put(line.thickness_m);
  put(out, false);  // thickness in pixels
  put_each(out, line.points_m);
  put(out, line.colour);
  put_count(out, 0);  // colours of points
  put_count(out, 0);  // indices
}

void put_label(CdrWriter& out, const Label& label) noexcept {
  put(out, Pose3{.position_m = label.position_m});
  put(out, true);  // faces the camera
  out.put(kLabelHeight_px);
  put(out, true);  // height in pixels
  put(out, label.colour);
  out.put_text(label.text);
}

}  // namespace

/// About y, which points away from that viewer, a right-handed turn is clockwise: hence about -y.
Pose3 pose_in_plane(const PlanarVector& at_m, double angle_rad) noexcept {
  return {{at_m.x(), 0, at_m.y()}, {0, -std::sin(angle_rad / 2), 0, std::cos(angle_rad / 2)}};
}

void put_deletion(CdrWriter& out, std::int64_t unix_ns, std::string_view id) noexcept {
  constexpr std::uint8_t kMatchingId = 0;
  out.put_time(unix_ns);
  out.put(kMatchingId);
  out.put_text(id);
}

void put_entity(CdrWriter& out, std::int64_t unix_ns, const Entity& entity) noexcept {
  out.put_time(unix_ns);
  out.put_text(entity.frame);
  out.put_text(entity.id);
  out.put_time(0);  // lifetime: until it is replaced or deleted
  put(out, true);   // moves with its frame
  put_count(out, entity.note.key.empty() ? 0 : 1);
  if (!entity.note.key.empty()) {
    out.put_text(entity.note.key);
    out.put_text(entity.note.value);
  }
  put_each(out, entity.arrows);
  put_each(out, entity.boxes);
  put_each(out, entity.ellipsoids);
  put_count(out, 0);  // cylinders
  put_count(out, entity.lines.size());
  for (const Line& line : entity.lines) put_line(out, line);
  put_count(out, 0);  // triangles
  put_count(out, entity.labels.size());
  for (const Label& label : entity.labels) put_label(out, label);
  put_count(out, 0);  // models
}

}  // namespace knuckle::recording
