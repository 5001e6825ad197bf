#include "app/console/picture/machine_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "machine/description.h"

namespace knuckle::console::picture {
namespace {

using Eigen::Vector3d;

/// Widths that the machine file does not know, by the machine's reach.
struct Proportions {
  double reach, beam;                    // beam: half the height of a link at its ends
  double boom_half, arm_half, eye_half;  // eye: of a cylinder, between lugs
  double bucket_half;
  explicit Proportions(const MachineDescription& machine)
      : reach(reach_m(machine)),
        beam(0.022 * reach),
        boom_half(0.026 * reach),
        arm_half(0.019 * reach),
        eye_half(0.010 * reach),
        bucket_half(0.075 * reach) {}
};

Mesh boom_mesh(const MachineDescription& m, const Proportions& size) {
  Mesh mesh;
  const double w = size.beam;
  const PlanarVector head(m.links[kBoom].length_m, 0);
  const PlanarVector d = m.boom_mount.child_pin_m, e = m.arm_mount.parent_pin_m;
  // The boom is bent where its cylinder holds it: a parabola from foot to head that passes between the cylinder pins.
  const PlanarVector crest = 0.55 * d + 0.45 * e - PlanarVector(0, 0.02 * size.reach);
  const PlanarVector control = 2 * crest - 0.5 * head;
  std::vector<Disc> spine;
  constexpr int kSteps = 10;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps;
    const double swell = std::sin(std::numbers::pi * t);
    spine.push_back({2 * t * (1 - t) * control + t * t * head, w * (0.8 + 0.75 * swell * swell)});
  }
  mesh.extrude(swept(spine), -size.boom_half, size.boom_half, Material::kPaint);
  const PlanarVector along(head.normalized());
  for (const auto& [pin, radius] : {std::pair{d, 0.62 * w}, std::pair{e, 0.62 * w}})
    mesh.extrude_pair(hull_of({{pin, radius}, {crest - 2.2 * w * along, 0.5 * w}, {crest + 2.2 * w * along, 0.5 * w}}),
                      size.eye_half + 0.15 * w, size.boom_half - 0.25 * w, Material::kPaint);
  mesh.pin(PlanarVector::Zero(), 0.45 * w, size.boom_half + 0.55 * w, Material::kSteel);
  for (const PlanarVector& pin : {d, e, head}) mesh.pin(pin, 0.38 * w, size.boom_half + 0.12 * w, Material::kSteel);
  return mesh;
}

Mesh arm_mesh(const MachineDescription& m, const Proportions& size) {
  Mesh mesh;
  const double w = size.beam, length = m.links[kArm].length_m;
  const PlanarVector f = m.arm_mount.child_pin_m, g = m.bucket_linkage.cylinder_pin_m;
  const PlanarVector j = m.bucket_linkage.rocker_pin_m;
  mesh.extrude(hull_of({{{0, 0}, 1.15 * w}, {{0.22 * length, 0.5 * w}, 1.35 * w}, {{length, 0}, 0.72 * w}}),
               -size.arm_half, size.arm_half, Material::kPaint);
  mesh.extrude_pair(hull_of({{f, 0.6 * w}, {g, 0.6 * w}, {{0, 0}, 0.9 * w}, {{0.24 * length, 0.6 * w}, 1.1 * w}}),
                    size.eye_half + 0.1 * w, size.arm_half - 0.2 * w, Material::kPaint);
  for (const PlanarVector& pin : {f, g}) mesh.pin(pin, 0.36 * w, size.arm_half + 0.12 * w, Material::kSteel);
  mesh.pin(j, 0.34 * w, size.arm_half + 0.5 * w, Material::kSteel);
  mesh.pin({length, 0}, 0.4 * w, size.arm_half + 0.75 * w, Material::kSteel);
  return mesh;
}

/// The back of the bucket from above K round to the cutting edge; its mouth is open from the hinge to the tip.
std::vector<PlanarVector> bucket_back(const BucketProfile& profile) {
  return {profile.back_m, profile.heel_m, profile.edge_m};
}

Mesh bucket_mesh(const MachineDescription& m, const Proportions& size) {
  Mesh mesh;
  const double w = size.beam, tip = m.links[kBucket].length_m, half = size.bucket_half;
  const PlanarVector k = m.bucket_linkage.bucket_pin_m;
  const std::vector<PlanarVector> back = bucket_back(m.bucket_profile);
  std::vector<Disc> shell{{{0.04 * tip, 0.04 * tip}, 0.02 * tip}};
  for (const PlanarVector& p : back) shell.push_back({p, 0.02 * tip});
  mesh.extrude(swept(shell), -half + 0.03 * tip, half - 0.03 * tip, Material::kBucket);
  Outline side{{0.02 * tip, -0.02 * tip}};
  side.insert(side.end(), back.begin(), back.end());
  side.insert(side.end(),
              {{0.93 * tip, 0.10 * tip}, {0.74 * tip, 0.13 * tip}, {0.34 * tip, 0.12 * tip}, {0.16 * tip, 0.02 * tip}});
  mesh.extrude_pair(side, half - 0.03 * tip, half, Material::kBucket);
  // Ears that hold the bucket's pin and K.
  mesh.extrude_pair(
      hull_of(
          {{{0, 0}, 0.85 * w}, {k, 0.7 * w}, {m.bucket_profile.back_m, 0.2 * w}, {{0.08 * tip, 0.06 * tip}, 0.3 * w}}),
      size.arm_half + 0.12 * w, size.arm_half + 0.5 * w, Material::kBucket);
  mesh.pin(k, 0.34 * w, size.arm_half + 0.62 * w, Material::kSteel);
  constexpr int kTeeth = 4;
  const double width = 0.10 * tip;
  for (int i = 0; i < kTeeth; ++i) {
    const double y = (half - 0.5 * width) * (2.0 * i / (kTeeth - 1) - 1);
    mesh.extrude({{0.88 * tip, 0.14 * tip}, {0.94 * tip, 0.16 * tip}, {tip, 0}}, y - 0.5 * width, y + 0.5 * width,
                 Material::kSteel);
  }
  return mesh;
}

/// A bar between two pins, as a pair of plates or as one between them.
Mesh rocker_mesh(double length_m, const Proportions& size) {
  Mesh mesh;
  const double w = size.beam;
  mesh.extrude_pair(hull_of({{{0, 0}, 0.55 * w}, {{length_m, 0}, 0.5 * w}}), size.arm_half + 0.08 * w,
                    size.arm_half + 0.38 * w, Material::kTrim);
  mesh.pin({length_m, 0}, 0.34 * w, size.arm_half + 0.5 * w, Material::kSteel);
  return mesh;
}

Mesh coupler_mesh(double length_m, const Proportions& size) {
  Mesh mesh;
  const double w = size.beam;
  mesh.extrude_pair(hull_of({{{0, 0}, 0.5 * w}, {{length_m, 0}, 0.5 * w}}), size.eye_half + 0.1 * w,
                    size.arm_half - 0.2 * w, Material::kTrim);
  return mesh;
}

Mesh barrel_mesh(const CylinderDescription& cylinder, const Proportions& size) {
  Mesh mesh;
  const double end = barrel_length_m(cylinder, cylinder.max_length_m), radius = 0.6 * cylinder.bore_m;
  mesh.pin({0, 0}, 0.8 * cylinder.rod_m, size.eye_half, Material::kTrim);
  mesh.tube({0.5 * cylinder.rod_m, 0, 0}, {end, 0, 0}, radius, Material::kTrim);
  mesh.tube({end - 0.6 * cylinder.bore_m, 0, 0}, {end + 0.15 * cylinder.bore_m, 0, 0}, 1.12 * radius, Material::kTrim);
  return mesh;
}

/// Long enough for the whole stroke, short enough to end inside the barrel.
Mesh rod_mesh(const CylinderDescription& cylinder, const Proportions& size) {
  Mesh mesh;
  const double barrel = barrel_length_m(cylinder, cylinder.max_length_m);
  const double length = std::min(cylinder.max_length_m - barrel + cylinder.bore_m, 0.95 * cylinder.min_length_m);
  mesh.tube({-length, 0, 0}, {-0.3 * cylinder.rod_m, 0, 0}, 0.5 * cylinder.rod_m, Material::kRod);
  mesh.pin({0, 0}, 0.8 * cylinder.rod_m, size.eye_half, Material::kTrim);
  return mesh;
}

Frame2 along(const PlanarVector& from, const PlanarVector& to, const PlanarVector& origin) {
  const PlanarVector ray = to - from;
  return Eigen::Translation2d(origin) * Eigen::Rotation2Dd(std::atan2(ray.y(), ray.x()));
}

}  // namespace

std::array<Mesh, kBodies> body_meshes(const MachineDescription& m) {
  const Proportions size(m);
  return {boom_mesh(m, size),
          arm_mesh(m, size),
          bucket_mesh(m, size),
          rocker_mesh(m.bucket_linkage.rocker_length_m, size),
          coupler_mesh(m.bucket_linkage.coupler_length_m, size),
          barrel_mesh(m.cylinders[kBoom], size),
          barrel_mesh(m.cylinders[kArm], size),
          barrel_mesh(m.cylinders[kBucket], size),
          rod_mesh(m.cylinders[kBoom], size),
          rod_mesh(m.cylinders[kArm], size),
          rod_mesh(m.cylinders[kBucket], size)};
}

Outline bucket_room(const MachineDescription& machine) {
  const double tip = machine.links[kBucket].length_m;
  Outline room{{0.04 * tip, 0.04 * tip}};
  const std::vector<PlanarVector> back = bucket_back(machine.bucket_profile);
  room.insert(room.end(), back.begin(), back.end());
  return room;
}

TargetBalls target_balls(const MachineDescription& m) {
  const Proportions size(m);
  const double radius = 0.011 * size.reach, y = size.bucket_half + 0.9 * radius;
  const BucketProfile& profile = m.bucket_profile;
  const PlanarVector pin = 0.5 * profile.back_m, teeth = 0.42 * (profile.heel_m + profile.edge_m);
  return {{Eigen::Vector3d(pin.x(), y, pin.y()), Eigen::Vector3d(teeth.x(), y, teeth.y())}, radius};
}

std::array<Frame2, kBodies> body_frames(const MachinePose& pose) {
  std::array<Frame2, kBodies> frames{pose.boom, pose.arm, pose.bucket,
                                     along(pose.rocker_pin_m, pose.linkage_pin_m, pose.rocker_pin_m),
                                     along(pose.linkage_pin_m, pose.bucket_pin_m, pose.linkage_pin_m)};
  for (std::size_t i = 0; i < kJoints; ++i) {
    const auto& [base, rod_end] = pose.cylinders[i];
    frames[static_cast<std::size_t>(Body::kBoomBarrel) + i] = along(base, rod_end, base);
    frames[static_cast<std::size_t>(Body::kBoomRod) + i] = along(base, rod_end, rod_end);
  }
  return frames;
}

// Tracks, house and cab: what an excavator of this reach usually stands on.

namespace {

using Eigen::Vector3d;

/// In parts of the machine's reach; the boom pin is the origin.
constexpr double kTrackRear = -0.52, kTrackFront = 0.10, kTrackInner = 0.095, kTrackOuter = 0.172;
constexpr double kHouseHalf = 0.165;

void add_wheel(Mesh& mesh, double s, const PlanarVector& at_m, double radius_m) {
  for (const double side : {-1.0, 1.0})
    mesh.tube({at_m.x(), side * (kTrackOuter - 0.01) * s, at_m.y()},
              {at_m.x(), side * (kTrackOuter + 0.01) * s, at_m.y()}, radius_m, Material::kSteel, 20);
}

void add_tracks(Mesh& mesh, double s, double ground_m, double top_m) {
  const double radius = (top_m - ground_m) / 2, middle = (top_m + ground_m) / 2;
  const PlanarVector rear(kTrackRear * s + radius, middle), front(kTrackFront * s - radius, middle);
  mesh.extrude_pair(hull_of({{rear, radius}, {front, radius}}, 24), kTrackInner * s, kTrackOuter * s,
                    Material::kRubber);
  // What is seen of the track frame and its wheels from outside.
  mesh.extrude_pair(hull_of({{rear, 0.62 * radius}, {front, 0.62 * radius}}, 24), (kTrackOuter - 0.01) * s,
                    (kTrackOuter + 0.004) * s, Material::kTrim);
  for (const PlanarVector& wheel : {rear, front}) add_wheel(mesh, s, wheel, 0.5 * radius);
  constexpr int kRollers = 3;
  for (int i = 1; i <= kRollers; ++i)
    add_wheel(mesh, s, rear + i / (kRollers + 1.0) * (front - rear) - PlanarVector(0, 0.32 * radius), 0.2 * radius);
  mesh.box({-0.395 * s, -kTrackInner * s, ground_m + 0.035 * s}, {0.0, kTrackInner * s, top_m - 0.012 * s},
           Material::kTrim);
  mesh.tube({-0.21 * s, 0, top_m - 0.02 * s}, {-0.21 * s, 0, top_m + 0.015 * s}, 0.10 * s, Material::kSteel);
}

void add_house(Mesh& mesh, double s, double floor_m) {
  const double waist = 0.035 * s;
  mesh.extrude({{-0.44 * s, floor_m},
                {-0.05 * s, floor_m},
                {-0.05 * s, waist - 0.02 * s},
                {-0.07 * s, waist},
                {-0.44 * s, waist}},
               -kHouseHalf * s, kHouseHalf * s, Material::kPaint);
  // Counterweight and engine hood, round at the back.
  mesh.extrude(hull_of({{{-0.43 * s, 0.06 * s}, 0.05 * s},
                        {{-0.44 * s, floor_m + 0.05 * s}, 0.05 * s},
                        {{-0.37 * s, floor_m}, 0},
                        {{-0.37 * s, 0.11 * s}, 0}},
                       24),
               -(kHouseHalf + 0.004) * s, (kHouseHalf + 0.004) * s, Material::kPaint);
  // Tank and hood to the right of the cab.
  mesh.extrude({{-0.37 * s, waist}, {-0.09 * s, waist}, {-0.12 * s, 0.09 * s}, {-0.37 * s, 0.105 * s}}, -kHouseHalf * s,
               -0.035 * s, Material::kTrim);
}

void add_cab(Mesh& mesh, double s) {
  const double low = 0.030 * s, high = 0.158 * s, glass = 0.003 * s;
  const Outline cab{{-0.36 * s, 0.035 * s},
                    {-0.085 * s, 0.035 * s},
                    {-0.070 * s, 0.19 * s},
                    {-0.125 * s, 0.395 * s},
                    {-0.345 * s, 0.395 * s}};
  mesh.extrude(cab, low, high, Material::kTrim);
  mesh.extrude({{-0.355 * s, 0.395 * s}, {-0.105 * s, 0.395 * s}, {-0.115 * s, 0.413 * s}, {-0.345 * s, 0.413 * s}},
               low - 0.006 * s, high + 0.006 * s, Material::kPaint);
  const Outline door{{-0.225 * s, 0.075 * s},
                     {-0.105 * s, 0.075 * s},
                     {-0.093 * s, 0.19 * s},
                     {-0.137 * s, 0.372 * s},
                     {-0.225 * s, 0.372 * s}};
  const Outline rear{{-0.335 * s, 0.18 * s}, {-0.245 * s, 0.18 * s}, {-0.245 * s, 0.372 * s}, {-0.325 * s, 0.372 * s}};
  for (const Outline& pane : {door, rear}) {
    mesh.extrude(pane, low - glass, low, Material::kGlass);
    mesh.extrude(pane, high, high + glass, Material::kGlass);
  }
  // Windscreen: a thin plate on the slope of the front.
  const PlanarVector foot(-0.072 * s, 0.20 * s), head(-0.119 * s, 0.382 * s);
  const PlanarVector slope = (head - foot).normalized(), out(slope.y(), -slope.x());
  mesh.extrude({foot, head, head + glass * out, foot + glass * out}, low + 0.012 * s, high - 0.012 * s,
               Material::kGlass);
}

}  // namespace

Mesh hull_mesh(const MachineDescription& machine, double ground_m) {
  Mesh mesh;
  const double s = reach_m(machine);
  const double top_m = std::min(ground_m + 0.13 * s, -0.1 * s), floor_m = top_m + 0.012 * s;
  add_tracks(mesh, s, ground_m, top_m);
  add_house(mesh, s, floor_m);
  add_cab(mesh, s);
  // Bracket of the boom and of its cylinder.
  const PlanarVector& pin = machine.boom_mount.parent_pin_m;
  mesh.extrude_pair(
      hull_of({{{0, 0}, 0.022 * s}, {pin, 0.018 * s}, {{-0.08 * s, floor_m}, 0}, {{-0.08 * s, 0.03 * s}, 0}}),
      0.029 * s, 0.037 * s, Material::kTrim);
  mesh.pin(pin, 0.009 * s, 0.040 * s, Material::kSteel);
  return mesh;
}

}  // namespace knuckle::console::picture
