// The simulator's own cylinder and linkage geometry: where pins are, how lines between them turn and stretch. Written
// apart from machine/ on purpose, so that levers are never tested against themselves.
#pragma once

#include <cmath>

#include "core/joints.h"
#include "machine/arm_description.h"

namespace knuckle::sim {

/// Turned by +90 degrees.
[[nodiscard]] inline PlanarVector perp(const PlanarVector& a) noexcept {
  return {-a.y(), a.x()};
}

/// cos and sin of an angle; turns vectors by it.
struct Turn {
  double c = 1, s = 0;
  Turn() = default;
  explicit Turn(double angle_rad) noexcept : c(std::cos(angle_rad)), s(std::sin(angle_rad)) {}
  Turn(double cosine, double sine) noexcept : c(cosine), s(sine) {}
  [[nodiscard]] PlanarVector operator*(const PlanarVector& v) const noexcept {
    return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
  }
  [[nodiscard]] PlanarVector back(const PlanarVector& v) const noexcept {
    return {c * v.x() + s * v.y(), -s * v.x() + c * v.y()};
  }
  [[nodiscard]] Turn operator*(const Turn& o) const noexcept { return {c * o.c - s * o.s, s * o.c + c * o.s}; }
};

/// A point and its first and second derivative by one angle.
struct MovingPoint {
  PlanarVector p, d1, d2;
};

/// A pin of a link that turns about `centre`, seen from the link before it.
[[nodiscard]] inline MovingPoint turning_pin(const PlanarVector& centre, const Turn& turn,
                                             const PlanarVector& pin) noexcept {
  const PlanarVector r = turn * pin;
  return {centre + r, perp(r), -r};
}

/// The line from a fixed pin to a moving one: length, its derivative (the cylinder's lever), direction and turn rates.
struct PinLine {
  double length_m, lever_m;
  PlanarVector along;   ///< Unit vector, fixed pin to moving pin.
  double turn1, turn2;  ///< First and second derivative of the line's direction by the angle.
};

[[nodiscard]] inline PinLine pin_line(const PlanarVector& fixed, const MovingPoint& moving) noexcept {
  const PlanarVector d = moving.p - fixed;
  PinLine line;
  line.length_m = std::sqrt(d.squaredNorm());
  const double inverse = 1 / line.length_m;
  line.along = d * inverse;
  const PlanarVector across = perp(line.along);
  line.lever_m = line.along.dot(moving.d1);
  line.turn1 = across.dot(moving.d1) * inverse;
  line.turn2 = (across.dot(moving.d2) - 2 * line.lever_m * line.turn1) * inverse;
  return line;
}

/// The bucket's four-bar in arm axes: pin H between rocker and coupler over the bucket angle.
struct FourBar {
  MovingPoint h;
  double turn1, turn2;  ///< First and second derivative of the rocker's direction by the bucket angle.
};

/// Beyond its toggle the linkage stays stretched (the joint's stops end the motion there).
[[nodiscard]] inline FourBar four_bar(const BucketLinkage& linkage, const MovingPoint& k) noexcept {
  const PlanarVector d = k.p - linkage.rocker_pin_m;
  const double d2 = d.squaredNorm(), inverse = 1 / d2;
  const double a2 = linkage.rocker_length_m * linkage.rocker_length_m;
  const double b2 = linkage.coupler_length_m * linkage.coupler_length_m;
  const double x = 0.5 * (d2 + a2 - b2) * inverse;  // of the way from J to K
  constexpr double kToggle = 1e-6;
  const double y = linkage.branch * std::sqrt(std::max(kToggle, a2 * inverse - x * x));
  const PlanarVector rocker = x * d + y * perp(d);
  const PlanarVector coupler = d - rocker;
  // |K - H| is constant: (K - H) . (K' - H') = 0 and its derivative, with H' = rate perp(rocker).
  const double reach = 1 / coupler.dot(perp(rocker));
  const double rate = coupler.dot(k.d1) * reach;
  const PlanarVector h1 = rate * perp(rocker);
  const double rate2 = ((k.d1 - h1).squaredNorm() + coupler.dot(k.d2 + rate * rate * rocker)) * reach;
  return {{linkage.rocker_pin_m + rocker, h1, rate2 * perp(rocker) - rate * rate * rocker}, rate, rate2};
}

}  // namespace knuckle::sim
