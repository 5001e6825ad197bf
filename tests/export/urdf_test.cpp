// The machine's URDF against Orocos KDL: gravity, mass matrix, motion and place are those that Knuckle computes with.
#include <gtest/gtest.h>

#include <cmath>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <random>
#include <sstream>

#include "app/export/export_command.h"
#include "estimation/regressor.h"
#include "machine/kinematics.h"
#include "tests/export/kdl_of_urdf.h"
#include "tests/export/machines.h"
#include "tests/support/refusal.h"
#include "tests/support/says.h"

namespace knuckle::exporting {
namespace {

using test::calibrated_machine;

std::string urdf_of(const MachineDescription& machine) {
  std::ostringstream text;
  write_urdf(machine, text);
  return text.str();
}

std::vector<MachineDescription> machines() {
  return {test::shipped("solar015"), test::shipped("compact080"), calibrated_machine()};
}

/// Angles in the working range, and what moves there.
struct Drawn {
  JointVector angle_rad, rate_radps, acceleration_radps2;
  double hull_pitch_rad = 0;
};

Drawn draw(const MachineDescription& machine, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  Drawn drawn;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    drawn.angle_rad[i] = (link.min_rad + link.max_rad) / 2 + unit(random) * (link.max_rad - link.min_rad) / 2;
    drawn.rate_radps[i] = link.max_rate_radps * unit(random);
    drawn.acceleration_radps2[i] = 3 * unit(random);
  }
  drawn.hull_pitch_rad = 0.3 * unit(random);
  return drawn;
}

KDL::JntArray to_kdl(const JointVector& v) {
  KDL::JntArray a(kJoints);
  a.data = v;
  return a;
}

/// In base's axes when the hull is turned by the pitch, counter-clockwise.
KDL::Vector gravity(double hull_pitch_rad) {
  const double g = estimation::kGravity_mps2;
  return {-g * std::sin(hull_pitch_rad), 0, -g * std::cos(hull_pitch_rad)};
}

constexpr int kPostures = 500;

TEST(Urdf, TorquesOfMotionByKdlAreTheEstimators) {
  std::mt19937 random(3);
  for (const MachineDescription& machine : machines()) {
    const MachineDescription seen = calibrated(machine);
    const estimation::BaseParameters parameters = estimation::known_parameters(seen);
    const estimation::RigidArm arm(seen);
    const KDL::Chain chain = test::kdl_chain(*test::parsed_urdf(urdf_of(machine)), "base", "bucket");
    for (int n = 0; n < kPostures; ++n) {
      const Drawn drawn = draw(seen, random);
      KDL::ChainIdSolver_RNE kdl(chain, gravity(drawn.hull_pitch_rad));
      KDL::JntArray torque(kJoints);
      ASSERT_EQ(kdl.CartToJnt(to_kdl(drawn.angle_rad), to_kdl(drawn.rate_radps), to_kdl(drawn.acceleration_radps2),
                              KDL::Wrenches(chain.getNrOfSegments(), KDL::Wrench::Zero()), torque),
                0);
      const JointVector ours = estimation::inverse_dynamics(arm, parameters, drawn.angle_rad, drawn.rate_radps,
                                                            drawn.acceleration_radps2, drawn.hull_pitch_rad);
      ASSERT_LE((torque.data - ours).norm(), 1e-9 * ours.norm()) << machine.name;
    }
  }
}

TEST(Urdf, TipByKdlIsWhereTheKinematicsHaveIt) {
  std::mt19937 random(4);
  for (const MachineDescription& machine : machines()) {
    const MachineDescription seen = calibrated(machine);
    const Kinematics kinematics(seen);
    const KDL::Chain chain = test::kdl_chain(*test::parsed_urdf(urdf_of(machine)), "base", "tip");
    KDL::ChainFkSolverPos_recursive kdl(chain);
    for (int n = 0; n < kPostures; ++n) {
      const JointVector angle_rad = draw(seen, random).angle_rad;
      KDL::Frame tip;
      ASSERT_GE(kdl.JntToCart(to_kdl(angle_rad), tip), 0);
      const PlanarVector ours = kinematics.tip(angle_rad);
      ASSERT_NEAR(tip.p.x(), ours.x(), 1e-12);
      ASSERT_NEAR(tip.p.y(), 0, 1e-12);
      ASSERT_NEAR(tip.p.z(), ours.y(), 1e-12);
    }
  }
}

TEST(Urdf, InertiasAreThoseOfSomeSteel) {
  for (const MachineDescription& machine : machines()) {
    const auto model = test::parsed_urdf(urdf_of(machine));
    for (const char* name : kJointNames) {
      const urdf::Inertial& i = *model->getLink(name)->inertial;
      EXPECT_GT(i.mass, 0);
      Eigen::Matrix3d tensor;
      tensor << i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz;
      const Eigen::Vector3d moments = tensor.selfadjointView<Eigen::Lower>().eigenvalues();  // increasing
      EXPECT_GT(moments[0], 0) << machine.name << " " << name;
      EXPECT_GT(moments[0] + moments[1], moments[2]) << machine.name << " " << name << ": triangle inequality";
    }
  }
}

TEST(Urdf, LimitsAreTheMachineFilesAndEffortIsWhatTheCylinderTurnsWithAtTheMainRelief) {
  for (const MachineDescription& machine : machines()) {
    const auto model = test::parsed_urdf(urdf_of(machine));
    const Kinematics kinematics(calibrated(machine));
    for (int i = 0; i < kJoints; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const LinkDescription& link = machine.links[k];
      const auto joint = model->getJoint(std::string(kJointNames[k]) + "_joint");
      ASSERT_TRUE(joint && joint->limits);
      EXPECT_EQ(joint->limits->lower, link.min_rad);
      EXPECT_EQ(joint->limits->upper, link.max_rad);
      EXPECT_EQ(joint->limits->velocity, link.max_rate_radps);
      if (machine.name != "solar015") continue;
      const double force_N = machine.cylinders[k].head_area_m2() * machine.hydraulics.main_relief_Pa;
      double most = 0;
      for (double angle = link.min_rad; angle <= link.max_rad; angle += 1e-3)
        most = std::max(most, std::abs(kinematics.cylinder_at(i, angle)->lever_m) * force_N);
      EXPECT_NEAR(joint->limits->effort, most, 1e-3 * most) << kJointNames[k];
    }
  }
}

TEST(Urdf, MassesOfIdentifiedParametersStayTheDrawingsWhereSteelOfThemExists) {
  MachineDescription machine = test::shipped("solar015");
  const JointVector drawn_kg = estimation::lumped_masses_kg(machine);
  machine.dynamics_calibration.emplace();
  machine.dynamics_calibration->parameters.head<kBaseCount>() = 1.02 * estimation::lumped_parameters(machine);
  const auto model = test::parsed_urdf(urdf_of(machine));
  double all_kg = machine.bucket_linkage.rocker_mass_kg + machine.bucket_linkage.coupler_mass_kg;
  for (int i = 0; i < kJoints; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_DOUBLE_EQ(model->getLink(kJointNames[k])->inertial->mass, drawn_kg[i]);
    EXPECT_GT(drawn_kg[i], machine.links[k].mass_kg) << "what hangs on it counts";
    all_kg += machine.links[k].mass_kg + machine.cylinders[k].body_mass_kg + machine.cylinders[k].rod_mass_kg;
  }
  const CylinderDescription& boom = machine.cylinders[kBoom];  // the hull carries a part of it
  EXPECT_LT(drawn_kg.sum(), all_kg);
  EXPECT_GT(drawn_kg.sum(), all_kg - boom.body_mass_kg - boom.rod_mass_kg);
}

/// A bucket whose inertia came out so small that no 67 kg have its moments.
MachineDescription with_bucket_inertia(double kgm2) {
  MachineDescription machine = test::shipped("solar015");
  machine.dynamics_calibration.emplace();
  auto& parameters = machine.dynamics_calibration->parameters;
  parameters.head<kBaseCount>() = estimation::lumped_parameters(machine);
  parameters[estimation::kInertia + kBucket] = kgm2;
  return machine;
}

TEST(Urdf, MassesMoveNoFurtherThanIdentifiedParametersAsk) {
  const MachineDescription machine = with_bucket_inertia(9);
  const auto& parameters = machine.dynamics_calibration->parameters;
  const double moment =
      std::hypot(parameters[estimation::kMomentX + kBucket], parameters[estimation::kMomentZ + kBucket]);
  const JointVector drawn_kg = estimation::lumped_masses_kg(machine);
  ASSERT_LT(parameters[estimation::kInertia + kBucket] * drawn_kg[kBucket], moment * moment) << "impossible as drawn";
  const auto model = test::parsed_urdf(urdf_of(machine));
  const double mass_kg = model->getLink("bucket")->inertial->mass, least_kg = moment * moment / 9;
  EXPECT_GT(mass_kg, least_kg);
  EXPECT_LT(mass_kg, 1.1 * least_kg);
  EXPECT_GT(model->getLink("bucket")->inertial->iyy, 0);
}

TEST(Urdf, OfWhatNoSteelHasIsRefusedWithOneLine) {
  const std::string line = test::refusal([&] { (void)urdf_of(with_bucket_inertia(3)); });
  EXPECT_TRUE(test::says(line, "solar015.toml: key 'calibration.dynamics': "));
  EXPECT_FALSE(test::says(line, "\n"));
}

TEST(Urdf, SaysWhoseItIsWhateverTheNameAndWhetherItIsTheDrawingOrWasIdentified) {
  MachineDescription drawn = test::shipped("solar015");
  drawn.name = "Ann's <\"big\" & small>";
  EXPECT_EQ(test::parsed_urdf(urdf_of(drawn))->getName(), drawn.name);
  EXPECT_TRUE(test::says(urdf_of(drawn), "not identified on the machine"));
  const std::string found = urdf_of(calibrated_machine());
  EXPECT_TRUE(test::says(found, "as identified on the machine; method full, 2026-11-21T05:00:00Z"));
  EXPECT_TRUE(test::says(found, "a- -b.csv")) << "two dashes would end the comment's validity";
  EXPECT_TRUE(test::says(found, "lengths as calibrated"));
}

}  // namespace
}  // namespace knuckle::exporting
