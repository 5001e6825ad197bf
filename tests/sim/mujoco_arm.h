// The arm as MuJoCo has it: rigid links on hinges, the bucket's corners as points that touch. Cylinder and linkage
// masses are zero, as MuJoCo's model has none.
#pragma once

#include <fmt/format.h>
#include <mujoco/mujoco.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "machine/load.h"
#include "sim/contact.h"
#include "sim/truth.h"
#include "tests/support/places.h"

namespace knuckle::sim::mujoco {

inline constexpr double kStep_s = 0.25e-3;
inline constexpr double kPitch_rad = 0.1;

inline const MachineDescription& machine() {
  static const MachineDescription made = [] {
    MachineDescription machine = load_machine(test::source_dir() + "/config/machines/solar015.toml");
    for (CylinderDescription& cylinder : machine.cylinders) cylinder.body_mass_kg = cylinder.rod_mass_kg = 0;
    machine.bucket_linkage.rocker_mass_kg = machine.bucket_linkage.coupler_mass_kg = 0;
    return machine;
  }();
  return made;
}

/// Bodies of the arm, each in the one before, in MuJoCo's x-z plane. MuJoCo turns about +y from z to x, the arm the
/// other way round. The bucket's corners are spheres of no size to speak of.
inline std::string arm_xml() {
  std::string bodies, tail;
  double at = 0;
  for (std::size_t i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine().links[i];
    bodies += fmt::format(R"(<body pos="{} 0 0"><joint type="hinge" axis="0 -1 0" limited="false"/>)"
                          R"(<inertial pos="{} 0 {}" mass="{}" diaginertia="{} {} {}"/>)",
                          at, link.com_m.x(), link.com_m.y(), link.mass_kg, link.inertia_kgm2, link.inertia_kgm2,
                          link.inertia_kgm2);
    at = link.length_m;
    tail += "</body>";
  }
  const BucketOutline outline(machine());
  for (std::size_t i = 0; i < kCorners; ++i) {
    bodies += fmt::format(
        R"(<geom type="sphere" size="1e-6" pos="{} 0 {}" contype="1" conaffinity="2" friction="0 0 0" condim="1"/>)",
        outline.corner(i).x(), outline.corner(i).y());
  }
  return bodies + tail;
}

inline std::string model_xml(const std::string& world) {
  return fmt::format(
      R"(<mujoco><compiler angle="radian"/><option timestep="{}" integrator="RK4" gravity="0 0 -9.80665"/>)"
      R"(<worldbody>{}</worldbody></mujoco>)",
      kStep_s, world);
}

/// On a rigid hull, turned, over a plane.
inline std::string rigid_xml(double floor_m) {
  return model_xml(fmt::format(
      R"(<geom type="plane" size="9 9 1" pos="0 0 {}" contype="2" conaffinity="1" friction="0 0 0" condim="1"/>)"
      R"(<body euler="0 {} 0">{}</body>)",
      floor_m, -kPitch_rad, arm_xml()));
}

/// On a hull that heaves, then pitches about its tracks' middle; W's origin is the boom pin at the start.
inline std::string hull_xml(const HullTruth& hull) {
  const PlanarVector centre = Turn(kPitch_rad) * hull.centre_m;
  return model_xml(fmt::format(
      R"(<body pos="{} 0 {}" euler="0 {} 0"><joint type="slide" axis="{} 0 {}"/><joint type="hinge" axis="0 -1 0"/>)"
      R"(<inertial pos="{} 0 {}" mass="{}" diaginertia="{} {} {}"/><body pos="{} 0 {}">{}</body></body>)",
      centre.x(), centre.y(), -kPitch_rad, std::sin(kPitch_rad), std::cos(kPitch_rad), hull.com_m.x(), hull.com_m.y(),
      hull.mass_kg, hull.inertia_kgm2, hull.inertia_kgm2, hull.inertia_kgm2, -hull.centre_m.x(), -hull.centre_m.y(),
      arm_xml()));
}

using Model = std::unique_ptr<mjModel, decltype(&mj_deleteModel)>;
using Data = std::unique_ptr<mjData, decltype(&mj_deleteData)>;

inline Model load(const std::string& xml) {
  const auto file = std::filesystem::temp_directory_path() / ("knuckle_" + std::to_string(getpid()) + ".xml");
  std::ofstream(file) << xml;
  std::array<char, 1000> error{};
  Model model(mj_loadXML(file.c_str(), nullptr, error.data(), static_cast<int>(error.size())), &mj_deleteModel);
  std::filesystem::remove(file);
  if (!model) throw std::runtime_error(error.data());
  return model;
}

class MujocoArm {
 public:
  explicit MujocoArm(double floor_m = -100)
      : model_(load(rigid_xml(floor_m))), data_(mj_makeData(model_.get()), &mj_deleteData) {}
  void set(const JointVector& angle, const JointVector& rate, const JointVector& torque = JointVector::Zero()) {
    for (int i = 0; i < kJoints; ++i) {
      data_->qpos[i] = angle[i];
      data_->qvel[i] = rate[i];
      data_->qfrc_applied[i] = torque[i];
    }
    mj_forward(model_.get(), data_.get());
  }
  void step() { mj_step(model_.get(), data_.get()); }
  [[nodiscard]] JointVector angle() const { return Eigen::Map<const JointVector>(data_->qpos); }
  [[nodiscard]] Eigen::Matrix3d mass() const {
    Eigen::Matrix<double, 3, 3, Eigen::RowMajor> full;
    mj_fullM(model_.get(), full.data(), data_->qM);
    return full;
  }
  [[nodiscard]] JointVector bias() const { return Eigen::Map<const JointVector>(data_->qfrc_bias); }
  /// Joint torques of a force at a point of the bucket, both frame W.
  [[nodiscard]] JointVector torque_of(const PlanarVector& force, const PlanarVector& at) {
    const std::array<double, 3> f{force.x(), 0, force.y()}, none{}, point{at.x(), 0, at.y()};
    std::array<double, 3> torque{};
    mj_applyFT(model_.get(), data_.get(), f.data(), none.data(), point.data(), model_->nbody - 1, torque.data());
    return Eigen::Map<const JointVector>(torque.data());
  }

 private:
  Model model_;
  Data data_;
};

}  // namespace knuckle::sim::mujoco
