// A kinematic tree of Orocos KDL from a URDF, read by urdfdom: both know nothing of the project. (kdl_parser, which
// does the same, comes with the whole of ROS.)
#pragma once

#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <kdl/tree.hpp>
#include <stdexcept>
#include <string>

namespace knuckle::test {

inline KDL::Frame kdl_frame(const urdf::Pose& pose) {
  const urdf::Rotation& r = pose.rotation;
  return {KDL::Rotation::Quaternion(r.x, r.y, r.z, r.w), {pose.position.x, pose.position.y, pose.position.z}};
}

/// Both know inertia about the centre of mass, KDL in the link's axes, URDF in those of the inertial's origin.
inline KDL::RigidBodyInertia kdl_inertia(const urdf::Link& link) {
  if (!link.inertial) return KDL::RigidBodyInertia::Zero();
  const urdf::Inertial& i = *link.inertial;
  const KDL::Frame origin = kdl_frame(i.origin);
  const KDL::RigidBodyInertia in_its_axes(1, KDL::Vector::Zero(),
                                          KDL::RotationalInertia(i.ixx, i.iyy, i.izz, i.ixy, i.ixz, i.iyz));
  return KDL::RigidBodyInertia(i.mass, origin.p, (KDL::Frame(origin.M) * in_its_axes).getRotationalInertia());
}

inline KDL::Joint kdl_joint(const urdf::Joint& joint) {
  const KDL::Frame origin = kdl_frame(joint.parent_to_joint_origin_transform);
  if (joint.type == urdf::Joint::FIXED) return KDL::Joint(joint.name, KDL::Joint::Fixed);
  if (joint.type != urdf::Joint::REVOLUTE) throw std::runtime_error(joint.name + ": neither fixed nor revolute");
  const KDL::Vector axis(joint.axis.x, joint.axis.y, joint.axis.z);
  return {joint.name, origin.p, origin.M * axis, KDL::Joint::RotAxis};
}

inline void add_children(KDL::Tree& tree, const urdf::Link& parent) {
  for (const auto& link : parent.child_links) {
    const urdf::Joint& joint = *link->parent_joint;
    const KDL::Segment segment(link->name, kdl_joint(joint), kdl_frame(joint.parent_to_joint_origin_transform),
                               kdl_inertia(*link));
    if (!tree.addSegment(segment, parent.name)) throw std::runtime_error(link->name + ": cannot be added");
    add_children(tree, *link);
  }
}

/// @throws std::runtime_error where the text is no URDF.
inline urdf::ModelInterfaceSharedPtr parsed_urdf(const std::string& text) {
  const auto model = urdf::parseURDF(text);
  if (!model) throw std::runtime_error("no URDF");
  return model;
}

inline KDL::Chain kdl_chain(const urdf::ModelInterface& model, const std::string& first, const std::string& last) {
  KDL::Tree tree(model.getRoot()->name);
  add_children(tree, *model.getRoot());
  KDL::Chain chain;
  if (!tree.getChain(first, last, chain)) throw std::runtime_error("no chain from " + first + " to " + last);
  return chain;
}

}  // namespace knuckle::test
