// Contact anywhere on the bucket: each place of it against faces, ends, corners, pipes and ground; where forces act,
// what they do to the joints, and that no energy is made.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "sim/world_model.h"
#include "test_plant.h"

namespace knuckle::sim {
namespace {

using namespace std::chrono_literals;

const BucketOutline& outline() {
  static const BucketOutline made(test::solar());
  return made;
}

/// At rest, bucket pin at the origin of W, turned.
BucketMotion standing(double angle_rad) {
  BucketMotion bucket;
  bucket.turn = Turn(angle_rad);
  bucket.angle_rad = angle_rad;
  bucket.linkage_m = bucket.turn * PlanarVector(0.2, 0.1);  // in the outline, out of the way
  return bucket;
}

/// The direction that a corner points in, bucket axes.
PlanarVector outwards(std::size_t corner) {
  return (outline().outward(corner) + outline().outward((corner + kCorners - 1) % kCorners)).normalized();
}

ContactForces forces(const WorldDescription& world, const BucketMotion& bucket) {
  return WorldModel(world, test::solar()).forces(bucket);
}

constexpr double kDepth_m = 1e-3;
constexpr double kStiffness = 1e6;

class EachCorner : public testing::TestWithParam<std::size_t> {};

TEST_P(EachCorner, IsPushedOutOfAWallWhereItIs) {
  for (const double angle : {-2.5, -1.0, 0.4}) {
    const BucketMotion bucket = standing(angle);
    const PlanarVector at = bucket.at(outline().corner(GetParam()));
    const PlanarVector normal = -(bucket.turn * outwards(GetParam()));
    WorldDescription world;
    world.walls.push_back({.point_m = at + kDepth_m * normal, .normal = normal, .stiffness_N_per_m = kStiffness});
    const ContactForces felt = forces(world, bucket);
    EXPECT_LT((felt.wall - kStiffness * kDepth_m * normal).norm(), 1e-6);
    EXPECT_NEAR(felt.bucket_Nm, cross(at, felt.wall), 1e-6);
    EXPECT_LT((bucket.turn.back(felt.weighted_Nm / felt.weight_N) - outline().corner(GetParam())).norm(), 1e-9);
    EXPECT_EQ(felt.linkage_N.norm(), 0);
  }
}

TEST_P(EachCorner, IsPushedOutOfAPipe) {
  const BucketMotion bucket = standing(-1.2);
  const PlanarVector out = bucket.turn * outwards(GetParam());
  WorldDescription world;
  world.pipes.push_back(
      {.centre_m = bucket.at(outline().corner(GetParam())) + (0.05 - kDepth_m) * out, .radius_m = 0.05});
  const ContactForces felt = forces(world, bucket);
  EXPECT_LT((felt.pipe + world.pipes[0].stiffness_N_per_m * kDepth_m * out).norm(), 1);
}

TEST_P(EachCorner, SideBehindItIsPushedOffTheCornerOfAWall) {
  const BucketMotion bucket = standing(0.7);
  const std::size_t side = GetParam();
  const PlanarVector middle = 0.5 * (outline().corner(side) + outline().corner((side + 1) % kCorners));
  const PlanarVector out = bucket.turn * outline().outward(side);
  // A wall whose end stands square to its face: its corner is kDepth_m inside the bucket, its body away from it.
  WorldDescription world;
  const PlanarVector normal = Turn(-std::numbers::pi / 4) * PlanarVector(-out);
  world.walls.push_back({.point_m = bucket.at(middle) - kDepth_m * out,
                         .normal = normal,
                         .stiffness_N_per_m = kStiffness,
                         .friction = 0,
                         .to_m = 0});
  const ContactForces felt = forces(world, bucket);
  EXPECT_LT((felt.wall + kStiffness * kDepth_m * out).norm(), 1e-6) << felt.wall.transpose();
  EXPECT_LT((bucket.turn.back(felt.weighted_Nm / felt.weight_N) - middle).norm(), 2 * kDepth_m);
}

INSTANTIATE_TEST_SUITE_P(Contact, EachCorner, testing::Range<std::size_t>(0, kCorners),
                         [](const auto& corner) { return std::string(name(static_cast<BucketPlace>(corner.param))); });

TEST(Contact, LoosePieceIsPushedAlongWithItsFrictionAtAnySpeedAndStep) {
  constexpr double kMass_kg = 40;
  std::vector<double> pushes_N;
  for (const double speed_mps : {0.05, 0.3}) {
    for (const double step_s : {5e-4, 1e-4}) {
      BucketMotion bucket = standing(-std::numbers::pi / 2);
      double foremost_m = 0;
      for (std::size_t i = 0; i < kCorners; ++i) foremost_m = std::max(foremost_m, bucket.at(outline().corner(i)).x());
      const PlanarVector mouth = bucket.at(0.5 * (outline().corner(0) + outline().corner(5)));
      WorldDescription world;
      world.pieces.push_back(
          {.mass_kg = kMass_kg, .position_m = {foremost_m + piece_radius_m(kMass_kg) + 0.01, mouth.y()}});
      WorldModel model(world, test::solar());
      bucket.pin_mps = {speed_mps, 0};
      const int steps = static_cast<int>(0.2 / (speed_mps * step_s));
      for (int i = 0; i < steps; ++i) {
        bucket.pin_m.x() += speed_mps * step_s;
        bucket.linkage_m.x() += speed_mps * step_s;
        (void)model.advance(step_s * i, step_s, bucket);
        if (i < steps / 2) continue;  // it has come to slide
        const PlanarVector on_bucket_N = model.forces(bucket).piece;
        ASSERT_LT(on_bucket_N.x(), 0) << "it stays in contact";
        ASSERT_NEAR(-on_bucket_N.x(), 0.6 * (kMass_kg * kGravity_mps2 + on_bucket_N.y()), 0.1) << speed_mps;
        if (i == steps - 1) pushes_N.push_back(-on_bucket_N.x());
      }
    }
  }
  for (const double push_N : pushes_N) EXPECT_NEAR(push_N, pushes_N.front(), 0.01 * pushes_N.front());
}

TEST(Contact, PinOfTheLinkageIsPushedOutOfAWallByItself) {
  BucketMotion bucket = standing(-1);
  bucket.linkage_m = bucket.turn * PlanarVector(-0.05, 0.4);
  const PlanarVector normal = -bucket.linkage_m.normalized();
  WorldDescription world;
  world.walls.push_back(
      {.point_m = bucket.linkage_m + kDepth_m * normal, .normal = normal, .stiffness_N_per_m = kStiffness});
  const ContactForces felt = forces(world, bucket);
  EXPECT_LT((felt.linkage_N - kStiffness * kDepth_m * normal).norm(), 1e-6);
  EXPECT_EQ(felt.bucket_N.norm(), 0);
}

TEST(Contact, SeveralPlacesAtOnceAddUp) {
  const BucketMotion bucket = standing(0);
  const PlanarVector tip = outline().corner(0), heel = outline().corner(2);
  WorldDescription world;
  world.walls.push_back(
      {.point_m = tip - PlanarVector(kDepth_m, 0), .normal = {-1, 0}, .stiffness_N_per_m = kStiffness});
  world.walls.push_back(
      {.point_m = heel - PlanarVector(0, kDepth_m), .normal = {0, -1}, .stiffness_N_per_m = kStiffness});
  const ContactForces felt = forces(world, bucket);
  EXPECT_LT((felt.bucket_N - kStiffness * kDepth_m * PlanarVector(-1, -1)).norm(), 1e-6);
  EXPECT_NEAR(felt.bucket_Nm, kStiffness * kDepth_m * (cross(tip, {-1, 0}) + cross(heel, {0, -1})), 1e-6);
}

// Whatever of the bucket is foremost is pressed by 2 mm into a surface of a wall, near its corner. Without
// friction and damping.
struct PressedNearACorner {
  static constexpr double kPressed_m = 2e-3, kTravel_m = 1e-4, kStored_J = 0.5 * kStiffness * kPressed_m * kPressed_m;
  BucketMotion bucket;
  std::string what;  // for messages
  WorldModel model{WorldDescription{}, test::solar()};
  double work_J = 0;  // done on the bucket
  int step = 0;

  PlanarVector corner_m, surface = PlanarVector(-1, 0), other;  // outward normals

  /// The surface that is pressed looks to the left; the other one, beyond the corner, up (way 1) or down (-1).
  /// @param width_m of the face, from this corner to the wall's other one.
  PressedNearACorner(double angle_rad, double way, bool into_face, double width_m = 2, double from_corner_m = 5e-3)
      : bucket(standing(angle_rad)), other(0, way) {
    std::size_t foremost = 0;
    for (std::size_t i = 1; i < kCorners; ++i) {
      if (bucket.at(outline().corner(i)).x() > bucket.at(outline().corner(foremost)).x()) foremost = i;
    }
    what = fmt::format("{} at {:.1f} into the {}, way {}", name(static_cast<BucketPlace>(foremost)), angle_rad,
                       into_face ? "face" : "end", way);
    corner_m = bucket.at(outline().corner(foremost)) + PlanarVector(-kPressed_m, way * from_corner_m);
    WorldDescription world;
    world.walls.push_back({.point_m = corner_m,
                           .normal = into_face ? surface : other,
                           .stiffness_N_per_m = kStiffness,
                           .friction = 0,
                           .from_m = into_face == (way > 0) ? 0.0 : -width_m,
                           .to_m = into_face == (way > 0) ? width_m : 0.0});
    model = WorldModel(world, test::solar());
    slide(0);
  }
  void slide(double by_m) {
    bucket.pin_m.y() += by_m;
    bucket.linkage_m.y() += by_m;
    (void)model.advance(1e-3 * step++, 1e-3, bucket);
    work_J += on_bucket_N().y() * by_m;
  }
  [[nodiscard]] PlanarVector on_bucket_N() { return model.forces(bucket).wall; }
  /// Whether the bucket is this far from the wall: along one of the wall's surfaces, or a side of the bucket.
  [[nodiscard]] bool apart(double by_m) const {
    for (const PlanarVector& normal : {surface, other}) {
      double least_m = 1;
      for (std::size_t i = 0; i < kCorners; ++i) {
        least_m = std::min(least_m, (bucket.at(outline().corner(i)) - corner_m).dot(normal));
      }
      if (least_m > by_m) return true;
    }
    for (std::size_t i = 0; i < kCorners; ++i) {
      const PlanarVector out = bucket.turn * outline().outward(i);
      const bool faces = out.dot(surface) <= 0 && out.dot(other) <= 0;
      if (faces && outline().outside(i, bucket.turn.back(corner_m - bucket.pin_m)) > by_m) return true;
    }
    return false;
  }
};

/// Which way it slides, and whether it is pressed into the face (or an end): at every attitude.
class OverACorner : public testing::TestWithParam<std::tuple<double, bool>> {
 protected:
  static void at_every_attitude(const std::function<void(PressedNearACorner&, double way)>& check) {
    const auto [way, into_face] = GetParam();
    for (int i = -31; i <= 31; ++i) {
      PressedNearACorner pressed(0.1 * i, way, into_face);
      SCOPED_TRACE(pressed.what);
      check(pressed, way);
    }
  }
};

TEST_P(OverACorner, NothingIsHeldThatSlidesOff) {
  at_every_attitude([](PressedNearACorner& pressed, double way) {
    for (int i = 0; i < 150; ++i) pressed.slide(way * pressed.kTravel_m);
    // No more is asked of who moves it than a side that leans by 0.1 takes, and no more given than was stored.
    EXPECT_GE(pressed.work_J, -0.1 * kStiffness * pressed.kPressed_m * 150 * pressed.kTravel_m);
    EXPECT_LE(pressed.work_J, pressed.kStored_J + 0.2);
  });
}

// However far it goes, on walls and on ledges as wide as the bucket and narrower.
TEST_P(OverACorner, NothingIsFeltOfAWallThatIsNotTouchedNorMoreThanWasPressed) {
  const auto [way, into_face] = GetParam();
  for (const auto& [width_m, from_corner_m] :
       {std::pair{2.0, 0.3}, {2.0, 5e-3}, {0.4, 0.3}, {0.4, 0.1}, {0.15, 0.1}, {0.15, 5e-3}}) {
    for (int angle = -31; angle <= 31; ++angle) {
      PressedNearACorner pressed(0.1 * angle, way, into_face, width_m, from_corner_m);
      SCOPED_TRACE(fmt::format("{}, {} m from a corner of {} m", pressed.what, from_corner_m, width_m));
      double apart_N = 0, most_N = 0;
      for (int i = 0; i < 1500; ++i) {
        pressed.slide(way * 4e-4);
        const double now_N = pressed.on_bucket_N().norm();
        if (pressed.apart(3 * pressed.kPressed_m)) apart_N = std::max(apart_N, now_N);
        most_N = std::max(most_N, now_N);
      }
      EXPECT_EQ(apart_N, 0);
      EXPECT_LE(most_N, 3.5 * kStiffness * pressed.kPressed_m);  // of a side that lies on both its ends and the corner
    }
  }
}

// As long as it stays in touch. What has come free may meet the other surface on its way back.
TEST_P(OverACorner, WhatSlidesBackIsPressedAsBefore) {
  int stayed = 0;
  for (const int past : {3, 10, 50}) {  // steps beyond the corner, which is 50 steps away
    at_every_attitude([past, &stayed](PressedNearACorner& pressed, double way) {
      const double before_N = pressed.on_bucket_N().norm();
      double least_N = before_N, most_N = before_N;
      for (const double there : {1.0, -1.0}) {
        for (int i = 0; i < 50 + past; ++i) {
          pressed.slide(there * way * pressed.kTravel_m);
          if (there > 0) least_N = std::min(least_N, pressed.on_bucket_N().norm());
          most_N = std::max(most_N, pressed.on_bucket_N().norm());
        }
      }
      EXPECT_LE(pressed.work_J, 0.2 + (least_N > 0 ? 0 : pressed.kStored_J)) << past;
      if (least_N == 0) return;
      ++stayed;
      EXPECT_NEAR(pressed.on_bucket_N().norm(), before_N, 1) << past;
      EXPECT_LE(most_N, 2.1 * before_N) << past;  // where a side comes to lie on both its ends
    });
  }
  EXPECT_GT(stayed, 20);
}

INSTANTIATE_TEST_SUITE_P(Contact, OverACorner, testing::Combine(testing::Values(1.0, -1.0), testing::Bool()));

TEST(Contact, JointTorquesOfAForceAreItsVirtualWork) {
  const RigidBody body(test::solar(), 0);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 200; ++n) {
    JointVector angle;
    for (int j = 0; j < kJoints; ++j) {
      const LinkDescription& link = test::solar().links[static_cast<std::size_t>(j)];
      angle[j] = link.min_rad + 0.5 * (1 + unit(random)) * (link.max_rad - link.min_rad);
    }
    const PlanarVector force(1000 * unit(random), 1000 * unit(random)),
        of_bucket(0.4 * unit(random), 0.4 * unit(random));
    const PoseGeometry pose = body.pose(angle);
    const JointVector on_bucket = RigidBody::bucket_torque(pose, force, cross(pose.bucket * of_bucket, force));
    const JointVector on_linkage = RigidBody::linkage_torque(pose, force);
    for (int j = 0; j < kJoints; ++j) {
      constexpr double kStep_rad = 1e-5;
      const PoseGeometry high = body.pose(angle + kStep_rad * JointVector::Unit(j));
      const PoseGeometry low = body.pose(angle - kStep_rad * JointVector::Unit(j));
      const auto bucket_point = [&](const PoseGeometry& p) {
        return PlanarVector(p.boom_m + p.arm_m + p.bucket * of_bucket);
      };
      const auto linkage_point = [](const PoseGeometry& p) { return PlanarVector(p.boom_m + p.linkage_m); };
      EXPECT_NEAR(on_bucket[j], force.dot(bucket_point(high) - bucket_point(low)) / (2 * kStep_rad), 1e-3);
      EXPECT_NEAR(on_linkage[j], force.dot(linkage_point(high) - linkage_point(low)) / (2 * kStep_rad), 1e-3);
    }
  }
}

/// The default machine with its bucket curled in, so that it stands on its heel.
struct HeelDown {
  JointVector pose = JointVector(0.1, -1.2, -1.6);
  WorldDescription world;
  double heel_x = 0, heel_z = 0;
  explicit HeelDown(double gap_m) {
    const Plant probe = make_plant({}, pose);
    lowest(probe);
    world.ground = GroundDescription{.height_m = heel_z - gap_m};
  }
  void lowest(const Plant& plant) {
    const RigidBody body(plant.truth().machine, 0);
    const PoseGeometry p = body.pose(plant.state().joint_rad);
    heel_z = 1e9;
    for (std::size_t i = 0; i < kCorners; ++i) {
      const PlanarVector corner = p.boom_m + p.arm_m + p.bucket * outline().corner(i);
      if (corner.y() < heel_z) {
        heel_x = corner.x();
        heel_z = corner.y();
      }
    }
  }
};

TEST(Contact, GroundHoldsTheBucketUpWhateverOfItComesFirst) {
  for (const double bucket_rad : {-2.3, -1.6, -0.8, 0.0, 0.6}) {
    HeelDown rig(0.02);
    rig.pose[kBucket] = bucket_rad;
    rig.lowest(make_plant({}, rig.pose));
    rig.world.ground->height_m = rig.heel_z - 0.02;
    Plant plant = make_plant(rig.world, rig.pose);
    plant.set_valve_demand(kBoom, -0.3);
    run(plant, 2);
    rig.lowest(plant);
    const PlantState& s = plant.state();
    EXPECT_GT(s.contact_N.y(), 500) << bucket_rad;
    EXPECT_GT(rig.heel_z, rig.world.ground->height_m - 0.01) << bucket_rad;
    EXPECT_LT(s.joint_radps.norm(), 0.02) << bucket_rad;
  }
}

TEST(Contact, HeelPressIsBalancedByTheChambersWhereItActs) {
  const HeelDown rig(0.005);
  Plant plant = make_plant(rig.world, rig.pose);
  plant.set_valve_demand(kBoom, -0.25);
  while (plant.state().contact_N.y() < 3000 && plant.state().t_s < 5) plant.step(1ms);
  plant.set_valve_demand(kBoom, 0);
  run(plant, 4);
  const PlantState& s = plant.state();
  ASSERT_GT(s.contact_N.norm(), 1000);
  ASSERT_LT(s.joint_radps.norm(), 1e-3);
  EXPECT_LT((s.contact_m - outline().corner(2)).norm(), 1e-6);  // the heel
  // Torques of chambers less friction, with the contact's, hold what the machine in the air needs in this pose.
  const JointVector held = s.lever_m.cwiseProduct(s.cylinder_N - s.friction_N);
  const RigidBody body(plant.truth().machine, 0);
  const PoseGeometry pose = body.pose(s.joint_rad);
  const JointVector contact =
      RigidBody::bucket_torque(pose, s.contact_N, cross(pose.bucket * s.contact_m, s.contact_N));
  const JointVector gravity = body.bias(pose, JointVector::Zero(), {});
  EXPECT_LT((held + contact - gravity).norm(), 2e-3 * gravity.norm());
}

TEST(Contact, NoEnergyIsMadeWhileTheBucketRollsSlidesAndKnocksOnTheGround) {
  const HeelDown rig(0.03);
  WorldDescription world = rig.world;
  world.pipes.push_back({.centre_m = {rig.heel_x + 0.45, rig.heel_z - 0.03}});  // half buried
  Plant plant = make_plant(world, rig.pose);
  const EnergyLedger start = plant.state().energy;
  double through = 0, most = 0;
  for (int i = 0; i < 6000; ++i) {
    const double t = i * 1e-3;
    demand(plant, {-0.05 + 0.3 * std::sin(3 * t), 0.4 * std::sin(1.7 * t + 1), 0.5 * std::sin(2.3 * t)});
    plant.step(1ms);
    through += through_J(plant.state());
    most = std::max(most, plant.state().contact_N.norm());
  }
  ASSERT_GT(most, 1000);
  const EnergyLedger& e = plant.state().energy;
  EXPECT_LT(missing_J(e.links, start.links), 1e-3 * through);
  EXPECT_GT(e.contact.in - start.contact.in, 0);  // the world takes work; it gives none
}

TEST(Contact, PullOfATestRigActsWhereItsChainHangs) {
  Plant at_tip = make_plant(), at_heel = make_plant();
  const PlanarVector pull(0, -2000);
  at_tip.set_pull(pull, outline().tip());
  at_heel.set_pull(pull, outline().corner(2));
  run(at_tip, 6);
  run(at_heel, 6);
  EXPECT_EQ(at_tip.state().contact_N, pull);
  EXPECT_LT((at_tip.state().contact_m - outline().tip()).norm(), 1e-9);
  EXPECT_LT((at_heel.state().contact_m - outline().corner(2)).norm(), 1e-9);
  EXPECT_LT(std::abs(at_heel.state().cylinder_N[kBucket]), std::abs(at_tip.state().cylinder_N[kBucket]));
}

}  // namespace
}  // namespace knuckle::sim
