// Outlines in the arm's plane: hulls, beams, clipping and cutting into triangles.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "app/console/picture/mesh.h"

namespace knuckle::console::picture {
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
