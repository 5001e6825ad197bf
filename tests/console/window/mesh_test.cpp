// Solids are closed with their surface outward, and the machine's are where the kinematics says.
#include "app/console/picture/mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <tuple>

#include "app/console/picture/machine_mesh.h"
#include "app/console/picture/world_mesh.h"
#include "app/session/scenario.h"
#include "app/session/scene.h"
#include "machine/kinematics.h"
#include "machine/load.h"
#include "tests/support/places.h"

namespace knuckle::console::window {
namespace {

constexpr unsigned kMeshSeed = 20;
const char* const kMachines[] = {"solar015", "compact080", "standard200"};

MachineDescription machine_named(const std::string& name) {
  return load_machine(test::source_dir() + "/config/machines/" + name + ".toml");
}

JointVector random_joints(const MachineDescription& machine, std::mt19937& random) {
  JointVector q;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    q[i] = std::uniform_real_distribution<double>(link.min_rad, link.max_rad)(random);
  }
  return q;
}

using Point = std::tuple<float, float, float>;
Point at(const picture::Mesh& mesh, std::uint32_t vertex) {
  const Eigen::Vector3f& p = mesh.vertices[vertex].position_m;
  return {p.x() + 0.0F, p.y() + 0.0F, p.z() + 0.0F};
}

/// Sides of triangles that no other triangle runs along the other way.
int open_sides(const picture::Mesh& mesh) {
  std::map<std::pair<Point, Point>, int> sides;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3)
    for (std::size_t k = 0; k < 3; ++k) {
      const Point a = at(mesh, mesh.triangles[i + k]), b = at(mesh, mesh.triangles[i + (k + 1) % 3]);
      ++sides[{a, b}];
      --sides[{b, a}];
    }
  return static_cast<int>(std::count_if(sides.begin(), sides.end(), [](const auto& side) { return side.second != 0; }));
}

/// What is wrong with normals: not of unit length, or not on the outer side of their triangle.
int wrong_normals(const picture::Mesh& mesh) {
  int wrong = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const picture::MeshVertex* v[3];
    for (std::size_t k = 0; k < 3; ++k) v[k] = &mesh.vertices[mesh.triangles[i + k]];
    const Eigen::Vector3f across = (v[1]->position_m - v[0]->position_m).cross(v[2]->position_m - v[0]->position_m);
    for (const picture::MeshVertex* vertex : v) {
      if (std::abs(vertex->normal.norm() - 1) > 1e-5F) ++wrong;
      if (across.norm() > 1e-9F && vertex->normal.dot(across.normalized()) < 0.5F) ++wrong;
    }
  }
  return wrong;
}

double volume_m3(const picture::Mesh& mesh) {
  double volume = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
    const auto p = [&](std::size_t k) { return mesh.vertices[mesh.triangles[i + k]].position_m.cast<double>().eval(); };
    volume += p(0).dot(p(1).cross(p(2))) / 6;
  }
  return volume;
}

void expect_solid(const picture::Mesh& mesh, const std::string& what) {
  SCOPED_TRACE(what);
  ASSERT_FALSE(mesh.triangles.empty());
  EXPECT_EQ(open_sides(mesh), 0);
  EXPECT_EQ(wrong_normals(mesh), 0);
  EXPECT_GT(volume_m3(mesh), 0);
}

/// All of its corners are in it.
Eigen::AlignedBox3d box_of(const picture::Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const picture::MeshVertex& v : mesh.vertices) box.extend(v.position_m.cast<double>());
  return box;
}

TEST(Outline, TrianglesCoverItOnce) {
  std::mt19937 random(kMeshSeed);
  std::uniform_real_distribution<double> radius(0.3, 1);
  for (int run = 0; run < 200; ++run) {
    picture::Outline star;  // any shape that is seen whole from its middle, in either sense
    const int corners = 3 + run % 20;
    for (int i = 0; i < corners; ++i) {
      const double angle = (run % 2 == 0 ? 1 : -1) * i * 2 * std::numbers::pi / corners;
      star.push_back(radius(random) * PlanarVector(std::cos(angle), std::sin(angle)));
    }
    const auto cut = picture::triangulated(star);
    ASSERT_EQ(cut.size(), 3 * (star.size() - 2));
    double area = 0;
    for (std::size_t i = 0; i < cut.size(); i += 3) {
      const double part = picture::signed_area_m2({star[cut[i]], star[cut[i + 1]], star[cut[i + 2]]});
      EXPECT_GE(part, 0) << "seed " << kMeshSeed << " run " << run;
      area += part;
    }
    EXPECT_NEAR(area, std::abs(picture::signed_area_m2(star)), 1e-12) << "seed " << kMeshSeed << " run " << run;
  }
}

TEST(Outline, AHullHoldsItsPointsAndTurnsLeftOnly) {
  const picture::Outline square =
      picture::hull_of({{{0, 0}, 0}, {{1, 0}, 0}, {{1, 1}, 0}, {{0, 1}, 0}, {{0.5, 0.5}, 0.2}});
  EXPECT_EQ(square.size(), 4U);
  EXPECT_NEAR(picture::signed_area_m2(square), 1, 1e-12);
  const double disc_m2 = std::numbers::pi * 0.25;
  EXPECT_NEAR(picture::signed_area_m2(picture::hull_of({{{1, 2}, 0.5}}, 24)), disc_m2, 0.03 * disc_m2);
}

TEST(Outline, IsCutOffAtTheFloor) {
  const picture::Outline square{{0, -1}, {1, -1}, {1, 1}, {0, 1}};
  EXPECT_NEAR(picture::signed_area_m2(picture::above(square, 0)), 1, 1e-12);
  EXPECT_NEAR(picture::signed_area_m2(picture::above(square, -2)), 2, 1e-12);
  EXPECT_TRUE(picture::above(square, 2).empty());
}

TEST(Mesh, SolidsHaveTheVolumeOfTheirShape) {
  picture::Mesh box, tube, cone;
  box.box({-1, -2, -3}, {1, 2, 3}, picture::Material::kPaint);
  EXPECT_NEAR(volume_m3(box), 48, 1e-5);
  tube.tube({1, 2, 3}, {1, 2, 5}, 0.5, picture::Material::kPaint, 12);
  EXPECT_NEAR(volume_m3(tube), 1.5, 1e-5);  // a regular dodecagon has the area 3 r^2
  cone.cone({0, 0, 0}, {3, 0, 0}, 1, 0, picture::Material::kPaint, 12);
  EXPECT_NEAR(volume_m3(cone), 3, 1e-5);
  for (const picture::Mesh* mesh : {&box, &tube, &cone}) expect_solid(*mesh, "simple solid");
}

TEST(MachineMesh, EveryBodyIsClosedWithItsSurfaceOutwardAndMeetsItsEnds) {
  const auto of = [](picture::Body body) { return static_cast<std::size_t>(body); };
  for (const char* name : kMachines) {
    SCOPED_TRACE(name);
    const MachineDescription m = machine_named(name);
    const auto bodies = picture::body_meshes(m);
    const picture::Mesh hull = picture::hull_mesh(m, -0.25 * reach_m(m));
    std::size_t triangles = hull.triangles.size() / 3;
    for (std::size_t i = 0; i < picture::kBodies; ++i) {
      expect_solid(bodies[i], "body " + std::to_string(i));
      triangles += bodies[i].triangles.size() / 3;
    }
    expect_solid(hull, "hull");
    EXPECT_LT(triangles, 5000U) << "can be drawn without a graphics card";
    for (std::size_t i = 0; i < kJoints; ++i) {
      const double rod_m = box_of(bodies[of(picture::Body::kBoomRod) + i]).min().x();
      const double barrel_m = box_of(bodies[of(picture::Body::kBoomBarrel) + i]).max().x();
      EXPECT_GT(rod_m + m.cylinders[i].min_length_m, 0) << "comes out at the base";
      EXPECT_LT(rod_m + m.cylinders[i].max_length_m, barrel_m) << "comes out at the front";
    }
    EXPECT_NEAR(box_of(bodies[of(picture::Body::kBucket)]).max().x(), m.links[kBucket].length_m, 1e-6)
        << "the teeth end at the tip";
  }
}

TEST(MachineMesh, WorldsOfAllScenariosAreClosed) {
  const MachineDescription m = machine_named("solar015");
  for (const char* name : {"wall_contact", "dismantle", "buried_pipe", "dig_cycle", "lift_weight"}) {
    const session::Scenario scenario =
        session::load_scenario(test::source_dir() + "/config/scenarios/" + name + ".toml", m);
    const picture::WorldMeshes world =
        picture::world_meshes(session::scene_of(scenario.world, {}, reach_m(m)), reach_m(m));
    for (const picture::Mesh* mesh : {&world.ground, &world.solids, &world.soil})
      if (!mesh->triangles.empty()) expect_solid(*mesh, std::string(name));
  }
}

TEST(MachinePose, CylindersAreAsLongAsTheKinematicsSays) {
  for (const char* name : kMachines) {
    const MachineDescription m = machine_named(name);
    const Kinematics kinematics(m);
    std::mt19937 random(kMeshSeed);
    for (int run = 0; run < 300; ++run) {
      const JointVector q = random_joints(m, random);
      const MachinePose pose = pose_of(m, q);
      for (int i = 0; i < kJoints; ++i)
        EXPECT_NEAR(pose.cylinders[static_cast<std::size_t>(i)].length_m(), kinematics.cylinder_at(i, q[i])->length_m,
                    1e-9)
            << name << ' ' << kJointNames[static_cast<std::size_t>(i)] << " seed " << kMeshSeed;
      EXPECT_NEAR((pose.tip_m - kinematics.tip(q)).norm(), 0, 1e-9);
      EXPECT_NEAR((pose.linkage_pin_m - pose.rocker_pin_m).norm(), m.bucket_linkage.rocker_length_m, 1e-9);
      EXPECT_NEAR((pose.linkage_pin_m - pose.bucket_pin_m).norm(), m.bucket_linkage.coupler_length_m, 1e-9);
    }
  }
}

TEST(MachineMesh, BodiesMeetAtTheirPins) {
  const MachineDescription m = machine_named("compact080");
  std::mt19937 random(kMeshSeed);
  for (int run = 0; run < 100; ++run) {
    const MachinePose pose = pose_of(m, random_joints(m, random));
    const auto frames = picture::body_frames(pose);
    const auto frame = [&](picture::Body body) { return frames[static_cast<std::size_t>(body)]; };
    const auto expect_same = [](const PlanarVector& a, const PlanarVector& b) { EXPECT_NEAR((a - b).norm(), 0, 1e-9); };
    expect_same(frame(picture::Body::kBoom) * m.boom_mount.child_pin_m, frame(picture::Body::kBoomRod).translation());
    expect_same(m.boom_mount.parent_pin_m, frame(picture::Body::kBoomBarrel).translation());
    expect_same(frame(picture::Body::kBoom) * m.arm_mount.parent_pin_m, frame(picture::Body::kArmBarrel).translation());
    expect_same(frame(picture::Body::kArm) * m.arm_mount.child_pin_m, frame(picture::Body::kArmRod).translation());
    expect_same(frame(picture::Body::kArm) * m.bucket_linkage.rocker_pin_m,
                frame(picture::Body::kRocker).translation());
    const PlanarVector h = frame(picture::Body::kRocker) * PlanarVector(m.bucket_linkage.rocker_length_m, 0);
    expect_same(h, frame(picture::Body::kBucketRod).translation());
    expect_same(h, frame(picture::Body::kCoupler).translation());
    expect_same(frame(picture::Body::kCoupler) * PlanarVector(m.bucket_linkage.coupler_length_m, 0),
                frame(picture::Body::kBucket) * m.bucket_linkage.bucket_pin_m);
    // A rod lies on its barrel's axis, length ahead of it.
    const PlanarVector in_barrel =
        frame(picture::Body::kArmBarrel).inverse() * PlanarVector(frame(picture::Body::kArmRod).translation());
    expect_same(in_barrel, {pose.cylinders[kArm].length_m(), 0});
  }
}

TEST(WorldMesh, ShowsAWallWhileItStandsOnTheGroundOrWholeWhereNoneIsKnownWithCracksWhereItBreaks) {
  const auto lowest = [](const session::Scene& scene) {
    return box_of(picture::world_meshes(scene, 3.2).solids).min().z();
  };
  session::Scene scene{{"wall", session::SceneLine::Kind::kWall, {{2, 1}, {2, -9}, {3, -9}, {3, 1}}, true, 0, 10}};
  EXPECT_EQ(picture::scene_at(scene, 9.9).size(), 1U);
  EXPECT_TRUE(picture::scene_at(scene, 10).empty());
  EXPECT_TRUE(picture::world_meshes({}, 3.2).solids.triangles.empty());
  EXPECT_NEAR(lowest(scene), -9, 1e-6);
  EXPECT_TRUE(picture::world_meshes(scene, 3.2).cracks.edges.empty());
  scene.front().breaks = true;
  EXPECT_FALSE(picture::world_meshes(scene, 3.2).cracks.edges.empty());
  scene.push_back({"ground", session::SceneLine::Kind::kGround, {{-3, -1.9}, {4, -1.9}}});
  EXPECT_NEAR(lowest(scene), -1.9, 1e-6);
}

TEST(WorldMesh, HasGroundWhereTheSceneHasItAndNoneWhereNothingIsKnown) {
  const picture::WorldMeshes unknown = picture::world_meshes({}, 3.2);
  EXPECT_TRUE(unknown.ground.triangles.empty() && unknown.grid.edges.empty());
  const session::Scene soil{{"soil", session::SceneLine::Kind::kSoil, {{1, -0.8}, {4, -0.9}}}};
  EXPECT_TRUE(picture::world_meshes(soil, 3.2).ground.triangles.empty()) << "soil alone is solid";
  EXPECT_FALSE(picture::world_meshes(soil, 3.2).soil.triangles.empty());
  const session::Scene low{{"ground", session::SceneLine::Kind::kGround, {{-3, -1.9}, {4, -1.9}}}};
  const picture::WorldMeshes known = picture::world_meshes(low, 3.2);
  ASSERT_FALSE(known.ground.triangles.empty());
  EXPECT_NEAR(box_of(known.ground).max().z(), -1.9, 1e-6) << "at its own height, however low";
}

TEST(BucketsLoad, FillsItsShareOfTheRoomFromBelowAndNoMore) {
  const MachineDescription m = machine_named("solar015");
  const picture::Outline room = picture::bucket_room(m);
  const double whole_m2 = std::abs(picture::signed_area_m2(room));
  EXPECT_TRUE(picture::filled(room, 0).empty());
  EXPECT_TRUE(picture::filled(room, -1).empty());
  EXPECT_EQ(picture::filled(room, 2), room);
  for (const double turn_rad : {0.0, 1.0, 2.5, -2.0}) {
    picture::Outline turned = room;
    for (PlanarVector& p : turned) p = Eigen::Rotation2Dd(turn_rad) * p;
    Eigen::AlignedBox2d whole, part;
    for (const PlanarVector& p : turned) whole.extend(p);
    const picture::Outline load = picture::filled(turned, 0.3);
    for (const PlanarVector& p : load) part.extend(p);
    EXPECT_NEAR(std::abs(picture::signed_area_m2(load)), 0.3 * whole_m2, 1e-3 * whole_m2) << turn_rad;
    EXPECT_NEAR(part.min().y(), whole.min().y(), 1e-9) << turn_rad;
    EXPECT_GT(std::count_if(load.begin(), load.end(), [&](const auto& p) { return p.y() > part.max().y() - 1e-9; }), 1)
        << "its surface is level";
  }
}

TEST(WorldMesh, VirtualWallsAreTheLimitsThatTheFileSets) {
  EXPECT_TRUE(picture::virtual_walls({}, 3.2).empty());
  LimitsDescription limits;
  limits.floor_m = -0.5;
  limits.reach_m = 2.9;
  const session::Scene walls = picture::virtual_walls(limits, 3.2);
  ASSERT_EQ(walls.size(), 2U);
  EXPECT_EQ(walls[0].points_m.front().y(), -0.5);
  EXPECT_EQ(walls[0].points_m.back().y(), -0.5);
  EXPECT_EQ(walls[1].points_m.front().x(), 2.9);
  const picture::WorldMeshes world = picture::world_meshes(walls, 3.2);
  EXPECT_TRUE(world.solids.triangles.empty()) << "nothing solid";
  EXPECT_LT(box_of(world.virtual_walls).min().z(), -0.51) << "ticks are on the forbidden side";
}

}  // namespace
}  // namespace knuckle::console::window
