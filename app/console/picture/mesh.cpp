#include "app/console/picture/mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

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

}  // namespace knuckle::console::picture
