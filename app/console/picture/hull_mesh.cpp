// Tracks, house and cab: what an excavator of this reach usually stands on.
#include <algorithm>
#include <cmath>

#include "app/console/picture/machine_mesh.h"
#include "machine/description.h"

namespace knuckle::console::picture {
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
