// The regressor against the simulator's equations of motion, which are other code by another formulation.
#include <gtest/gtest.h>

#include <random>

#include "estimation/regressor.h"
#include "sim/rigid_body.h"
#include "tests/estimation/test_machine.h"

namespace knuckle::estimation {
namespace {

TEST(Regressor, InverseDynamicsEqualsTheSimulatorsOnRandomStates) {
  const MachineDescription machine = test_machine();  // cylinders and linkage without mass
  const double pitch = 0.03;
  const sim::RigidBody body(machine, pitch);
  const RigidArm arm(machine);
  const BaseParameters parameters = base_parameters(machine);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int n = 0; n < 500; ++n) {
    JointVector q, qd, qdd;
    for (int i = 0; i < kJoints; ++i) {
      const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
      q[i] = 0.5 * (link.min_rad + link.max_rad) + 0.5 * uniform(random) * (link.max_rad - link.min_rad);
      qd[i] = 2 * uniform(random);
      qdd[i] = 5 * uniform(random);
    }
    const sim::PoseGeometry pose = body.pose(q);
    const sim::MassMatrix m = body.mass(pose, {});
    Eigen::Matrix3d mass;
    mass << m.m00, m.m01, m.m02, m.m01, m.m11, m.m12, m.m02, m.m12, m.m22;
    const JointVector theirs = mass * qdd + body.bias(pose, qd, {});
    // The simulator has standard gravity, the estimator a rounded one.
    const JointVector weight = joint_torque(RigidArm::gravity(Pose(q, pitch)) * parameters);
    const JointVector ours =
        inverse_dynamics(arm, parameters, q, qd, qdd, pitch) + (9.80665 / kGravity_mps2 - 1) * weight;
    EXPECT_LT((ours - theirs).norm(), 1e-8 * std::max(1.0, theirs.norm())) << "state " << n;
  }
}

}  // namespace
}  // namespace knuckle::estimation
