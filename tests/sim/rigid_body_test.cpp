// The simulator's equations of motion against an independent library and against their own energy.
#include "sim/rigid_body.h"

#include <gtest/gtest.h>

#include <kdl/chain.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <random>

#include "machine/kinematics.h"
#include "sim/truth.h"
#include "test_plant.h"

namespace knuckle::sim {
namespace {

struct Motion {
  JointVector angle, rate, acceleration;
};

Motion random_motion(const MachineDescription& machine, std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  Motion motion;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    motion.angle[i] = link.min_rad + (link.max_rad - link.min_rad) * unit(random);
    motion.rate[i] = 4 * unit(random) - 2;
    motion.acceleration[i] = 10 * unit(random) - 5;
  }
  return motion;
}

MachineDescription without_cylinder_masses() {
  MachineDescription machine = test::solar();
  for (CylinderDescription& cylinder : machine.cylinders) cylinder.body_mass_kg = cylinder.rod_mass_kg = 0;
  machine.bucket_linkage.rocker_mass_kg = machine.bucket_linkage.coupler_mass_kg = 0;
  return machine;
}

JointVector inverse_dynamics(const RigidBody& body, const Motion& motion, const BucketLoad& load) {
  const PoseGeometry pose = body.pose(motion.angle);
  const MassMatrix m = body.mass(pose, load);
  Eigen::Matrix3d mass;
  mass << m.m00, m.m01, m.m02, m.m01, m.m11, m.m12, m.m02, m.m12, m.m22;
  return mass * motion.acceleration + body.bias(pose, motion.rate, load);
}

/// The arm in KDL's x-y plane, hull pitch as a turned gravity, load as a second body on the bucket.
KDL::Chain kdl_chain(const MachineDescription& machine, double load_kg, const PlanarVector& load_at) {
  KDL::Chain chain;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[i];
    const KDL::RotationalInertia about_com(0, 0, link.inertia_kgm2);
    KDL::RigidBodyInertia inertia(link.mass_kg, KDL::Vector(link.com_m.x() - link.length_m, link.com_m.y(), 0),
                                  about_com);
    if (i == kBucket)
      inertia = inertia + KDL::RigidBodyInertia(load_kg, KDL::Vector(load_at.x() - link.length_m, load_at.y(), 0));
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ), KDL::Frame(KDL::Vector(link.length_m, 0, 0)), inertia));
  }
  return chain;
}

TEST(RigidBody, InverseDynamicsEqualsKdlWithoutCylinderMasses) {
  const MachineDescription machine = without_cylinder_masses();
  const double pitch = 0.1;
  const RigidBody body(machine, pitch);
  const PlanarVector load_at(0.3, 0.1);
  BucketLoad load;
  load.add(55, load_at);
  const KDL::Chain chain = kdl_chain(machine, 55, load_at);
  KDL::ChainIdSolver_RNE solver(chain, KDL::Vector(-9.80665 * std::sin(pitch), -9.80665 * std::cos(pitch), 0));
  std::mt19937_64 random(1);
  for (int n = 0; n < 200; ++n) {
    const Motion motion = random_motion(machine, random);
    KDL::JntArray q(3), qd(3), qdd(3), torque(3);
    q.data = motion.angle;
    qd.data = motion.rate;
    qdd.data = motion.acceleration;
    KDL::Wrenches external(3, KDL::Wrench::Zero());
    ASSERT_EQ(solver.CartToJnt(q, qd, qdd, external, torque), 0);
    EXPECT_LT((inverse_dynamics(body, motion, load) - torque.data).norm(), 1e-8);
  }
}

TEST(RigidBody, EachEquationIsLagrangesWithCylinderMasses) {
  // d/dt dT/dq' - dT/dq + dV/dq by differences.
  const RigidBody body(test::solar(), 0.05);
  BucketLoad load;
  load.add(40, {0.28, 0.12});
  std::mt19937_64 random(3);
  const auto momentum = [&](const JointVector& angle, const JointVector& rate, int i) {
    const MassMatrix m = body.mass(body.pose(angle), load);
    const Eigen::Matrix3d mass{{m.m00, m.m01, m.m02}, {m.m01, m.m11, m.m12}, {m.m02, m.m12, m.m22}};
    return mass.row(i).dot(rate);
  };
  for (int n = 0; n < 100; ++n) {
    const Motion m = random_motion(test::solar(), random);
    const JointVector torque = inverse_dynamics(body, m, load);
    const double d = 1e-5;
    for (int i = 0; i < kJoints; ++i) {
      const auto lagrangian = [&](double shift) {
        const PoseGeometry pose = body.pose(m.angle + shift * JointVector::Unit(i));
        return body.mass(pose, load).kinetic_energy(m.rate) - body.potential_energy(pose, load, body.lift_mps2());
      };
      const double momentum_rate = (momentum(m.angle + d * m.rate, m.rate + d * m.acceleration, i) -
                                    momentum(m.angle - d * m.rate, m.rate - d * m.acceleration, i)) /
                                   (2 * d);
      const double expected = momentum_rate - (lagrangian(d) - lagrangian(-d)) / (2 * d);
      EXPECT_NEAR(torque[i], expected, 1e-5 * (1000 + std::abs(expected)));
    }
  }
}

TEST(RigidBody, LeversAndLengthsEqualTheMachinesKinematics) {
  const Kinematics kinematics(test::solar());
  const RigidBody body(test::solar(), 0);
  std::mt19937_64 random(4);
  for (int n = 0; n < 500; ++n) {
    const Motion motion = random_motion(test::solar(), random);
    const PoseGeometry pose = body.pose(motion.angle);
    for (int i = 0; i < kJoints; ++i) {
      const auto cylinder = kinematics.cylinder_at(i, motion.angle[i]);
      ASSERT_TRUE(cylinder);
      EXPECT_NEAR(pose.length_m[i], cylinder->length_m, 1e-9);
      EXPECT_NEAR(pose.lever_m[i], cylinder->lever_m, 1e-9);
    }
    EXPECT_LT((RigidBody::tip(pose) - kinematics.tip(motion.angle)).norm(), 1e-9);
    const PlanarVector force(700, -300);
    const JointVector torque = RigidBody::bucket_torque(pose, force, cross(pose.bucket_m, force));
    EXPECT_LT((torque - kinematics.tip_jacobian(motion.angle).transpose() * force).norm(), 1e-9 * 700);
  }
}

TEST(Truth, DrawnMachinesKeepTheirLinkagesClosedAndTheirLeversSigned) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const MachineTruth truth = sample_truth(test::solar(), seed);
    const RigidBody body(truth.machine, truth.hull_pitch_rad);
    for (double part = 0; part <= 1; part += 0.125) {
      JointVector angle;
      for (int i = 0; i < kJoints; ++i) {
        const LinkDescription& link = truth.machine.links[static_cast<std::size_t>(i)];
        angle[i] = link.min_rad + part * (link.max_rad - link.min_rad);
      }
      const PoseGeometry pose = body.pose(angle);
      EXPECT_GT(pose.lever_m[kBoom], 0.1) << seed;
      EXPECT_LT(pose.lever_m[kArm], -0.1) << seed;
      EXPECT_LT(pose.lever_m[kBucket], -0.005) << seed;
    }
  }
}

TEST(Truth, AnotherDayIsTheSameMachineWithOtherOil) {
  const MachineTruth first = sample_truth(test::solar(), 7), later = another_day(first, Family::kSmooth, 1);
  EXPECT_NE(later.viscosity_factor, first.viscosity_factor);
  EXPECT_EQ(another_day(first, Family::kSmooth, 1).viscosity_factor, later.viscosity_factor);
  EXPECT_EQ(later.machine.links[1].mass_kg, first.machine.links[1].mass_kg);
  EXPECT_EQ(later.pressure[5].offset_Pa, first.pressure[5].offset_Pa);
  double thinnest = 1, thickest = 1;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const double viscosity = another_day(first, Family::kSmooth, seed).viscosity_factor;
    thinnest = std::min(thinnest, viscosity);
    thickest = std::max(thickest, viscosity);
  }
  EXPECT_GE(thinnest, 0.8);
  EXPECT_LT(thinnest, 0.82);
  EXPECT_LE(thickest, 1.25);
  EXPECT_GT(thickest, 1.22);
}

TEST(Truth, SameSeedSameMachineAndDrawsStayInTheirBounds) {
  const MachineDescription& nominal = test::solar();
  const MachineTruth a = sample_truth(nominal, 7), b = sample_truth(nominal, 7), c = sample_truth(nominal, 8);
  EXPECT_EQ(a.machine.links[0].mass_kg, b.machine.links[0].mass_kg);
  EXPECT_EQ(a.pressure[5].offset_Pa, b.pressure[5].offset_Pa);
  EXPECT_NE(a.pressure[5].offset_Pa, c.pressure[5].offset_Pa);
  double widest_mass = 0, widest_friction = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const MachineTruth truth = sample_truth(nominal, seed);
    for (std::size_t i = 0; i < kJoints; ++i) {
      widest_mass = std::max(widest_mass, std::abs(truth.machine.links[i].mass_kg / nominal.links[i].mass_kg - 1));
      widest_friction = std::max(
          widest_friction, std::abs(truth.friction[i].coulomb_extend_N / nominal.cylinders[i].friction.coulomb_N - 1));
      EXPECT_LE(
          std::abs(truth.machine.cylinders[i].valve.dead_band_extend - nominal.cylinders[i].valve.dead_band_extend),
          0.01);
    }
    for (const PressureSensorError& sensor : truth.pressure) EXPECT_LE(std::abs(sensor.offset_Pa), 1e5);
    EXPECT_LE(std::abs(truth.hull_pitch_rad), 0.5 * std::numbers::pi / 180);
    EXPECT_GE(truth.pressure[0].lag_s, 2e-3);
    EXPECT_LE(truth.pressure[0].lag_s, 8e-3);
    EXPECT_LE(truth.encoder_noise_m, 0.2 * nominal.sensors.encoder_step_m);
  }
  EXPECT_LE(widest_mass, 0.05);
  EXPECT_GT(widest_mass, 0.045);
  EXPECT_LE(widest_friction, 0.3);
  EXPECT_GT(widest_friction, 0.27);
}

}  // namespace
}  // namespace knuckle::sim
