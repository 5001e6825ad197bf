#include "app/console/picture/mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace knuckle::console::picture {
namespace {

using Eigen::Vector3d;

const double kSharp = std::cos(35 * std::numbers::pi / 180);  // corners beyond it are edges

Vector3d in_space(const PlanarVector& p, double y_m) {
  return {p.x(), y_m, p.y()};
}

/// Outward normal of the side from a to b of a counter-clockwise outline.
PlanarVector outward(const PlanarVector& a, const PlanarVector& b) {
  const PlanarVector side = (b - a).normalized();
  return {side.y(), -side.x()};
}

Outline counter_clockwise(Outline outline) {
  if (signed_area_m2(outline) < 0) std::reverse(outline.begin(), outline.end());
  return outline;
}

}  // namespace

std::uint32_t Mesh::add(const Vector3d& position_m, const Vector3d& normal, Material material) {
  vertices.push_back({position_m.cast<float>(), normal.cast<float>(), static_cast<float>(material)});
  return static_cast<std::uint32_t>(vertices.size() - 1);
}

void Mesh::quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  triangles.insert(triangles.end(), {a, b, c, a, c, d});
}

void Mesh::cap(const Outline& outline, double y_m, bool towards_left, Material material) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  const auto corners = static_cast<std::uint32_t>(outline.size());
  for (const PlanarVector& p : outline) add(in_space(p, y_m), Vector3d(0, towards_left ? 1 : -1, 0), material);
  const std::vector<std::uint32_t> cut = triangulated(outline);
  for (std::size_t i = 0; i < cut.size(); i += 3) {
    triangles.push_back(first + cut[i]);
    triangles.push_back(first + cut[towards_left ? i + 2 : i + 1]);
    triangles.push_back(first + cut[towards_left ? i + 1 : i + 2]);
  }
  for (std::uint32_t i = 0; i < corners; ++i) edges.insert(edges.end(), {first + i, first + (i + 1) % corners});
}

void Mesh::extrude(const Outline& wanted, double low_m, double high_m, Material material) {
  const Outline outline = counter_clockwise(wanted);
  const std::size_t n = outline.size();
  const auto corner = [&](std::size_t i) -> const PlanarVector& { return outline[i % n]; };
  cap(outline, low_m, false, material);
  cap(outline, high_m, true, material);
  for (std::size_t i = n; i < 2 * n; ++i) {
    const PlanarVector normal = outward(corner(i), corner(i + 1));
    const PlanarVector before = outward(corner(i - 1), corner(i)), after = outward(corner(i + 1), corner(i + 2));
    const auto shaded = [&](const PlanarVector& neighbour) {
      return in_space(normal.dot(neighbour) > kSharp ? PlanarVector((normal + neighbour).normalized()) : normal, 0);
    };
    const Vector3d from = shaded(before), to = shaded(after);
    const std::uint32_t a = add(in_space(corner(i), low_m), from, material);
    const std::uint32_t b = add(in_space(corner(i), high_m), from, material);
    const std::uint32_t c = add(in_space(corner(i + 1), high_m), to, material);
    const std::uint32_t d = add(in_space(corner(i + 1), low_m), to, material);
    quad(a, b, c, d);
    std::vector<std::uint32_t>& lines = normal.dot(before) > kSharp ? rounds : edges;
    lines.insert(lines.end(), {a, b});
  }
}

void Mesh::extrude_pair(const Outline& outline, double inner_m, double outer_m, Material material) {
  extrude(outline, inner_m, outer_m, material);
  extrude(outline, -outer_m, -inner_m, material);
}

void Mesh::box(const Vector3d& low, const Vector3d& high, Material material) {
  extrude({{low.x(), low.z()}, {high.x(), low.z()}, {high.x(), high.z()}, {low.x(), high.z()}}, low.y(), high.y(),
          material);
}

void Mesh::disc(const std::vector<Vector3d>& rim, const Vector3d& normal, Material material) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  const auto corners = static_cast<std::uint32_t>(rim.size());
  for (const Vector3d& p : rim) add(p, normal, material);
  for (std::uint32_t i = 1; i + 1 < corners; ++i) triangles.insert(triangles.end(), {first, first + i, first + i + 1});
  for (std::uint32_t i = 0; i < corners; ++i) rounds.insert(rounds.end(), {first + i, first + (i + 1) % corners});
}

void Mesh::cone(const Vector3d& from, const Vector3d& to, double from_radius, double to_radius, Material material,
                int sides) {
  const Vector3d along = (to - from).normalized();
  const Vector3d aside = along.unitOrthogonal(), third = along.cross(aside);
  const double slope = (from_radius - to_radius) / (to - from).norm();
  std::vector<Vector3d> directions, near, far;
  for (int i = 0; i < sides; ++i) {
    const double angle = i * 2 * std::numbers::pi / sides;
    directions.emplace_back(std::cos(angle) * aside + std::sin(angle) * third);
    near.emplace_back(from + from_radius * directions.back());
    far.emplace_back(to + to_radius * directions.back());
  }
  for (std::size_t i = 0; i < near.size(); ++i) {
    const std::size_t next = (i + 1) % near.size();
    const Vector3d normal = (directions[i] + slope * along).normalized();
    const Vector3d next_normal = (directions[next] + slope * along).normalized();
    const std::uint32_t a = add(near[i], normal, material), b = add(near[next], next_normal, material);
    const std::uint32_t c = add(far[next], next_normal, material), d = add(far[i], normal, material);
    if (i % 2 == 0) rounds.insert(rounds.end(), {a, d});
    if (to_radius > 0) {
      quad(a, b, c, d);
    } else {
      triangles.insert(triangles.end(), {a, b, c});
    }
  }
  if (to_radius > 0) disc(far, along, material);
  std::reverse(near.begin(), near.end());
  disc(near, -along, material);
}

void Mesh::pin(const PlanarVector& at_m, double radius_m, double half_length_m, Material material) {
  tube(in_space(at_m, -half_length_m), in_space(at_m, half_length_m), radius_m, material);
}

void Mesh::line(const Vector3d& from_m, const Vector3d& to_m, Material material) {
  const std::uint32_t from = add(from_m, Vector3d::UnitZ(), material), to = add(to_m, Vector3d::UnitZ(), material);
  edges.insert(edges.end(), {from, to});
}

// Outlines in the arm's plane: hulls, beams, clipping and cutting into triangles.

namespace {

PlanarVector at_angle(double angle_rad) {
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

/// Of a counter-clockwise triangle, its border included.
bool inside(const PlanarVector& p, const PlanarVector& a, const PlanarVector& b, const PlanarVector& c) {
  return cross(b - a, p - a) >= 0 && cross(c - b, p - b) >= 0 && cross(a - c, p - c) >= 0;
}

/// The corner before, at and after `i` of what is left of an outline is convex and holds no other corner.
bool is_ear(const Outline& outline, const std::vector<std::uint32_t>& left, std::size_t i) {
  const std::size_t n = left.size();
  const PlanarVector &a = outline[left[(i + n - 1) % n]], &b = outline[left[i]], &c = outline[left[(i + 1) % n]];
  if (cross(b - a, c - b) <= 0) return false;
  return std::none_of(left.begin(), left.end(), [&](std::uint32_t k) {
    const PlanarVector& p = outline[k];
    return p != a && p != b && p != c && inside(p, a, b, c);
  });
}

}  // namespace

double signed_area_m2(const Outline& outline) {
  double area = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) area += cross(outline[i], outline[(i + 1) % outline.size()]) / 2;
  return area;
}

std::vector<std::uint32_t> triangulated(const Outline& outline) {
  std::vector<std::uint32_t> left(outline.size());
  std::iota(left.begin(), left.end(), 0U);
  if (signed_area_m2(outline) < 0) std::reverse(left.begin(), left.end());
  std::vector<std::uint32_t> triangles;
  while (left.size() > 2) {
    const std::size_t n = left.size();
    std::size_t ear = 0;
    while (ear < n && !is_ear(outline, left, ear)) ++ear;
    ear %= n;  // none: three corners in a line, whose triangle is as good as any
    for (const std::size_t k : {ear + n - 1, ear, ear + 1}) triangles.push_back(left[k % n]);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  return triangles;
}

Outline hull_of(const std::vector<Disc>& discs, int corners) {
  Outline points;
  for (const Disc& disc : discs)
    for (int i = 0; i < (disc.radius_m > 0 ? corners : 1); ++i)
      points.push_back(disc.centre_m + disc.radius_m * at_angle(i * 2 * std::numbers::pi / corners));
  std::sort(points.begin(), points.end(), [](const PlanarVector& a, const PlanarVector& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  // Andrew's monotone chain: the lower side from left to right, then the upper one back.
  Outline hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = hull.size();
    for (const PlanarVector& p : points) {
      while (hull.size() >= first + 2 && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 1e-12)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();  // the first of the other side
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

Outline swept(const std::vector<Disc>& spine) {
  constexpr int kEndCorners = 6;
  const auto direction = [&](std::size_t i) {
    const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, spine.size() - 1);
    return PlanarVector((spine[after].centre_m - spine[before].centre_m).normalized());
  };
  Outline outline;
  for (std::size_t i = 0; i < spine.size(); ++i) {
    const PlanarVector d = direction(i);
    outline.push_back(spine[i].centre_m + spine[i].radius_m * PlanarVector(d.y(), -d.x()));
  }
  const auto round_end = [&](const Disc& end, const PlanarVector& outward) {
    const double start = std::atan2(outward.y(), outward.x()) - std::numbers::pi / 2;
    for (int i = 1; i < kEndCorners; ++i)
      outline.push_back(end.centre_m + end.radius_m * at_angle(start + i * std::numbers::pi / kEndCorners));
  };
  round_end(spine.back(), direction(spine.size() - 1));
  for (std::size_t i = spine.size(); i-- > 0;) {
    const PlanarVector d = direction(i);
    outline.push_back(spine[i].centre_m + spine[i].radius_m * PlanarVector(-d.y(), d.x()));
  }
  round_end(spine.front(), -direction(0));
  return outline;
}

Outline above(const Outline& outline, double floor_m) {
  Outline kept;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const PlanarVector &a = outline[i], &b = outline[(i + 1) % outline.size()];
    if (a.y() >= floor_m) kept.push_back(a);
    if ((a.y() >= floor_m) != (b.y() >= floor_m)) {
      const double share = (floor_m - a.y()) / (b.y() - a.y());
      kept.emplace_back(a.x() + share * (b.x() - a.x()), floor_m);
    }
  }
  return kept.size() < 3 ? Outline{} : kept;
}

Outline filled(const Outline& outline, double share) {
  const auto upside_down = [](Outline points) {
    for (PlanarVector& p : points) p.y() = -p.y();
    return points;
  };
  if (!(share > 0) || outline.size() < 3) return {};
  if (share >= 1) return outline;
  const Outline turned = upside_down(outline);
  const auto [highest, lowest] =
      std::minmax_element(turned.begin(), turned.end(), [](const auto& a, const auto& b) { return a.y() < b.y(); });
  const double wanted_m2 = share * std::abs(signed_area_m2(outline));
  double low = highest->y(), high = lowest->y();
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings; ++i) {
    const double level = (low + high) / 2;
    (std::abs(signed_area_m2(above(turned, level))) > wanted_m2 ? low : high) = level;
  }
  return upside_down(above(turned, high));
}

}  // namespace knuckle::console::picture
