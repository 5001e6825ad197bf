// Inverse dynamics against Orocos KDL; acceleration-free and filtered forms against inverse dynamics.
#include "estimation/regressor.h"

#include <gtest/gtest.h>

#include <kdl/chain.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <random>

#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

KDL::Chain kdl_chain(const MachineDescription& machine) {
  KDL::Chain chain;
  for (const LinkDescription& link : machine.links) {
    const KDL::RotationalInertia inertia(0, 0, link.inertia_kgm2);
    chain.addSegment(KDL::Segment(
        KDL::Joint(KDL::Joint::RotZ), KDL::Frame(KDL::Vector(link.length_m, 0, 0)),
        KDL::RigidBodyInertia(link.mass_kg, KDL::Vector(link.com_m.x() - link.length_m, link.com_m.y(), 0), inertia)));
  }
  return chain;
}

KDL::JntArray to_kdl(const JointVector& v) {
  KDL::JntArray a(kJoints);
  for (unsigned i = 0; i < kJoints; ++i) a(i) = v[i];
  return a;
}

TEST(Regressor, InverseDynamicsEqualsKdlOnRandomStates) {
  const MachineDescription machine = test_machine();
  const RigidArm arm(machine);
  const BaseParameters parameters = base_parameters(machine);
  const KDL::Chain chain = kdl_chain(machine);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-3, 3);
  const auto draw = [&] { return JointVector(uniform(random), uniform(random), uniform(random)); };
  for (int n = 0; n < 500; ++n) {
    const JointVector q = draw(), qd = draw(), qdd = draw();
    const double pitch = 0.1 * uniform(random);
    // KDL has no hull: the pitch turns gravity instead.
    const KDL::Vector gravity(-kGravity_mps2 * std::sin(pitch), -kGravity_mps2 * std::cos(pitch), 0);
    KDL::ChainIdSolver_RNE solver(chain, gravity);
    KDL::JntArray torque(kJoints);
    ASSERT_EQ(solver.CartToJnt(to_kdl(q), to_kdl(qd), to_kdl(qdd), KDL::Wrenches(kJoints), torque), 0);
    const JointVector ours = inverse_dynamics(arm, parameters, q, qd, qdd, pitch);
    for (unsigned i = 0; i < kJoints; ++i)
      EXPECT_NEAR(ours[i], torque(i), 1e-8 * std::max(1.0, std::abs(torque(i)))) << "state " << n << " joint " << i;
  }
}

TEST(Regressor, LumpedParametersOfMasslessCylindersAreTheLinksOwn) {
  MachineDescription machine = test_machine();
  EXPECT_TRUE(lumped_parameters(machine).isApprox(base_parameters(machine), 1e-14));
  machine.cylinders[kArm].body_mass_kg = 10;
  const BaseParameters added = lumped_parameters(machine) - base_parameters(machine);
  EXPECT_GT(added[kMomentX + kBoom], 10 * 0.5);  // at least the near pin's share, on the boom
  EXPECT_DOUBLE_EQ(added[kMomentX + kBucket], 0);
}

TEST(Regressor, AccelerationFreeFormEqualsInverseDynamics) {
  const RigidArm arm(test_machine());
  const SineMotion motion;
  const double h = 1e-5;
  for (double t = 0; t < 10; t += 0.37) {
    const auto momentum = [&](double at) {
      const SineMotion::Point p = motion.at(at);
      return arm.momentum(Pose(p.angle, 0.02), absolute(p.rate));
    };
    const SineMotion::Point p = motion.at(t);
    const Pose pose(p.angle, 0.02);
    const Regressor split = (momentum(t + h) - momentum(t - h)) / (2 * h) + RigidArm::gravity(pose) +
                            arm.velocity_products(pose, absolute(p.rate));
    const Regressor whole = arm.inverse_dynamics(pose, absolute(p.rate), absolute(p.acceleration));
    EXPECT_LT((split - whole).cwiseAbs().maxCoeff(), 1e-8) << "t " << t;
  }
}

TEST(Regressor, FilteredMomentumFormEqualsFilteredInverseDynamics) {
  // a (p - F p) + F (velocity products + gravity) = F tau, without any acceleration on the left.
  const MachineDescription machine = test_machine();
  const RigidArm arm(machine);
  const BaseParameters parameters = base_parameters(machine);
  const SineMotion motion;
  constexpr double kShort_s = 0.001, kCutoff_Hz = 2;
  MomentumObserver observer(kCutoff_Hz, kShort_s);
  FohFilter<JointVector> filter(kCutoff_Hz, kShort_s);
  double worst = 0, largest = 0;
  for (int n = 0; n <= 8000; ++n) {
    const SineMotion::Point p = motion.at(n * kShort_s);
    const Pose pose(p.angle, 0);
    const JointVector rate = absolute(p.rate);
    const JointVector momentum = joint_torque(arm.momentum(pose, rate) * parameters);
    const JointVector rest = joint_torque((RigidArm::gravity(pose) + arm.velocity_products(pose, rate)) * parameters);
    const JointVector torque = inverse_dynamics(arm, parameters, p.angle, p.rate, p.acceleration, 0);
    if (n == 0) {
      observer.reset(momentum, rest);
      filter.reset(torque);
    }
    const JointVector left = observer.step(momentum, rest), right = filter.step(torque);
    if (n * kShort_s > 2) worst = std::max(worst, (left - right).cwiseAbs().maxCoeff());
    largest = std::max(largest, right.cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst, 1e-6 * largest);
}

}  // namespace
}  // namespace knuckle::estimation
