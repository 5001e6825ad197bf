// MuJoCo as the witness of the arm's rigid body: equations of motion, and what forces on the bucket's
// outline do to the joints.
#include <gtest/gtest.h>

#include <random>

#include "sim/plant_model.h"
#include "sim/rigid_body.h"
#include "tests/sim/mujoco_arm.h"
#include "tests/sim/test_plant.h"

namespace knuckle::sim {
namespace {

using mujoco::hull_xml;
using mujoco::kPitch_rad;
using mujoco::machine;
using mujoco::MujocoArm;

struct Drawn {
  JointVector angle, rate;
};
Drawn draw(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  Drawn drawn;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine().links[static_cast<std::size_t>(i)];
    drawn.angle[i] = link.min_rad + (link.max_rad - link.min_rad) * unit(random);
    drawn.rate[i] = 4 * unit(random) - 2;
  }
  return drawn;
}

Eigen::Matrix3d full(const MassMatrix& m) {
  Eigen::Matrix3d mass;
  mass << m.m00, m.m01, m.m02, m.m01, m.m11, m.m12, m.m02, m.m12, m.m22;
  return mass;
}

TEST(MujocoWitness, EquationsOfMotionAreTheSame) {
  MujocoArm witness;
  const RigidBody body(machine(), kPitch_rad);
  std::mt19937_64 random(1);
  for (int n = 0; n < 200; ++n) {
    const Drawn drawn = draw(random);
    witness.set(drawn.angle, drawn.rate);
    const PoseGeometry pose = body.pose(drawn.angle);
    EXPECT_LT((full(body.mass(pose, {})) - witness.mass()).norm(), 1e-9 * witness.mass().norm());
    EXPECT_LT((body.bias(pose, drawn.rate, {}) - witness.bias()).norm(), 1e-9 * (1 + witness.bias().norm()));
  }
}

TEST(MujocoWitness, ForcesOnTheBucketDoTheSameToTheJoints) {
  MujocoArm witness;
  const RigidBody body(machine(), kPitch_rad);
  const BucketOutline outline(machine());
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 100; ++n) {
    const Drawn drawn = draw(random);
    witness.set(drawn.angle, drawn.rate);
    const PoseGeometry pose = body.pose(drawn.angle);
    for (std::size_t i = 0; i < kCorners; ++i) {
      const PlanarVector force(5000 * unit(random), 5000 * unit(random));
      const PlanarVector from_pin = pose.bucket * outline.corner(i);
      const PlanarVector at = body.hull() * PlanarVector(pose.boom_m + pose.arm_m + from_pin);
      const PlanarVector in_m = body.hull().back(force);
      EXPECT_LT((RigidBody::bucket_torque(pose, in_m, cross(from_pin, in_m)) - witness.torque_of(force, at)).norm(),
                1e-6);
    }
  }
}

TEST(MujocoWitness, ArmAndCompliantHullMoveEachOtherTheSameWay) {
  MachineTruth truth = nominal_truth(machine());
  truth.hull_pitch_rad = kPitch_rad;
  truth.hull = {.stiffness_N_per_m = 5e5,
                .damping_Ns_per_m = 3e3,
                .track_m = 1.2,
                .mass_kg = 1250,
                .inertia_kgm2 = 300,
                .com_m = {-0.1, 0.58},
                .centre_m = {-0.7, -0.8}};
  PlantModel plant(truth);
  const mujoco::Model model = mujoco::load(hull_xml(truth.hull));
  const mujoco::Data data(mj_makeData(model.get()), &mj_deleteData);
  ASSERT_EQ(model->nv, 5);
  const WorldModel empty({}, truth.machine);
  StateVector x = plant.equilibrium({0.3, -1.5, -1.2}, {});
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int n = 0; n < 100; ++n) {
    const Drawn drawn = draw(random);
    x.segment<3>(kAngle) = drawn.angle;
    x.segment<3>(kRate) = drawn.rate;
    x[kHull] = 0.01 * unit(random);
    x[kHull + 1] = 0.05 * unit(random);
    x[kHull + 2] = 0.1 * unit(random);
    x[kHull + 3] = 0.5 * unit(random);
    PlantDetail detail;
    const StateVector dx = plant.derivative(x, {}, empty, detail);
    // MuJoCo's slide is vertical in W; it has the heave, then the pitch, then the joints.
    for (int i = 0; i < 2; ++i) {
      data->qpos[i] = x[kHull + i];
      data->qvel[i] = x[kHull + 2 + i];
    }
    data->qfrc_applied[0] = detail.ground.heave_N;
    data->qfrc_applied[1] = detail.ground.pitch_Nm;
    for (int i = 0; i < kJoints; ++i) {
      data->qpos[2 + i] = drawn.angle[i];
      data->qvel[2 + i] = drawn.rate[i];
      data->qfrc_applied[2 + i] =
          detail.pose.lever_m[i] * (detail.pressure_force[i] - detail.friction[i] + detail.stop_force[i]) +
          detail.joint_stop_torque[i];
    }
    mj_forward(model.get(), data.get());
    Eigen::Matrix<double, 5, 1> mine;
    mine << dx.segment<2>(kHull + 2), dx.segment<3>(kRate);
    const Eigen::Map<const Eigen::Matrix<double, 5, 1>> theirs(data->qacc);
    EXPECT_LT((mine - theirs).norm(), 1e-8 * (1 + theirs.norm())) << n;
  }
}

}  // namespace
}  // namespace knuckle::sim
