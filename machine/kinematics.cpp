// Triangle law for boom and arm, circle intersections for the bucket's four-bar; both directions in closed form.
#include "machine/kinematics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "machine/description.h"
#include "machine/load_calibration.h"
#include "machine/toml_reader.h"

namespace knuckle {
namespace {

/// A linkage must work this far beyond the working range: real machines are not built to the last millimetre.
constexpr double kMargin_rad = 0.03;
/// joint_at answers as far as the cylinder itself can be found, pin tolerances and encoder offset included. Near a
/// toggle an angle would be no margin: 0.03 rad are then less than a millimetre of stroke, which a stopping cylinder
/// overruns.
constexpr double kStrokeMargin_m = 0.010;
constexpr double kScanStep_rad = 0.002;
/// Calibrated pins may need this much more stroke than drawn: the drawing's ends are no more exact than its pins.
constexpr double kStrokeTolerance_m = 0.005;

double wrapped(double angle_rad) noexcept {
  return std::remainder(angle_rad, 2 * std::numbers::pi);
}
/// d/dtheta of a vector that turns with theta.
PlanarVector turned_left(const PlanarVector& v) noexcept {
  return {-v.y(), v.x()};
}

PlanarVector rotated(const PlanarVector& v, double angle_rad) noexcept {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

/// Where circles about `a` and `b` meet; side +1: left of the ray from a to b. nullopt where they do not.
std::optional<PlanarVector> circles_meet(const PlanarVector& a, double radius_a, const PlanarVector& b, double radius_b,
                                         double side) noexcept {
  const PlanarVector ray = b - a;
  const double distance2 = ray.squaredNorm();
  const double along = (distance2 + radius_a * radius_a - radius_b * radius_b) / (2 * distance2);
  const double across2 = radius_a * radius_a / distance2 - along * along;
  if (!(across2 > 0)) return std::nullopt;
  return PlanarVector(a + along * ray + side * std::sqrt(across2) * turned_left(ray));
}

/// Every length the working range needs must be within the cylinder's own.
void check_stroke(const MachineDescription& machine, int joint, double lowest_m, double highest_m) {
  const auto index = static_cast<std::size_t>(joint);
  const CylinderDescription& cylinder = machine.cylinders[index];
  const double tolerance = machine.geometry_calibration ? kStrokeTolerance_m : 0;
  const std::string why = std::string(", the length at an end of the ") + kJointNames[index] + "'s working range";
  std::vector<GeometryError> errors;
  if (cylinder.min_length_m > lowest_m + tolerance) {
    errors.push_back(
        {joint, "cylinders", "min_length_m", cylinder.min_length_m, "must be at most " + number_text(lowest_m) + why});
  }
  if (cylinder.max_length_m < highest_m - tolerance) {
    errors.push_back({joint, "cylinders", "max_length_m", cylinder.max_length_m,
                      "must be at least " + number_text(highest_m) + why});
  }
  if (!errors.empty()) throw GeometryErrors(machine.source, std::move(errors));
}

Frame2 joint_frame(const Frame2& parent, const PlanarVector& origin_m, double angle_rad) {
  return parent * Eigen::Translation2d(origin_m) * Eigen::Rotation2Dd(angle_rad);
}

/// H of the bucket linkage: |HJ| and |HK| from J and K, on the given side of the ray from J to K.
PlanarVector linkage_joint(const BucketLinkage& linkage, const PlanarVector& j, const PlanarVector& k) {
  const PlanarVector ray = k - j;
  const double d = ray.norm();
  const double along = (linkage.rocker_length_m * linkage.rocker_length_m -
                        linkage.coupler_length_m * linkage.coupler_length_m + d * d) /
                       (2 * d);
  const double aside = std::sqrt(std::max(0.0, linkage.rocker_length_m * linkage.rocker_length_m - along * along));
  return j + (along * ray + linkage.branch * aside * turned_left(ray)) / d;
}

}  // namespace

std::string key_of(const GeometryError& error) {
  return std::string(error.table) + "." + kJointNames[static_cast<std::size_t>(error.joint)] + "." + error.key;
}

GeometryErrors::GeometryErrors(const std::string& source, std::vector<GeometryError> errors)
    : InputError(source + ": key '" + key_of(errors.front()) + "' = " + number_text(errors.front().value) + ": " +
                 errors.front().bound),
      errors_(std::move(errors)) {}

Kinematics::Kinematics(const MachineDescription& machine)
    : lengths_m_(machine.links[kBoom].length_m, machine.links[kArm].length_m, machine.links[kBucket].length_m) {
  const auto triangle = [](const PlanarVector& parent, const PlanarVector& child) {
    return Triangle{parent.squaredNorm() + child.squaredNorm(), parent.norm() * child.norm(),
                    std::atan2(child.y(), child.x()) - std::atan2(parent.y(), parent.x()), 1};
  };
  const PlanarVector arm_joint(lengths_m_[kBoom], 0);
  triangles_[kBoom] = triangle(machine.boom_mount.parent_pin_m, machine.boom_mount.child_pin_m);
  triangles_[kArm] = triangle(machine.arm_mount.parent_pin_m - arm_joint, machine.arm_mount.child_pin_m);
  const BucketLinkage& linkage = machine.bucket_linkage;
  four_bar_ = {.cylinder_pin = linkage.cylinder_pin_m,
               .rocker_pin = linkage.rocker_pin_m,
               .bucket_joint = PlanarVector(lengths_m_[kArm], 0),
               .bucket_pin = linkage.bucket_pin_m,
               .bucket_pin_radius = linkage.bucket_pin_m.norm(),
               .rocker = linkage.rocker_length_m,
               .coupler = linkage.coupler_length_m,
               .branch = linkage.branch > 0 ? 1.0 : -1.0,
               .rocker_side = 1,
               .coupler_side = 1};
  std::vector<GeometryError> errors;
  for (int joint = 0; joint < kJoints; ++joint) {
    try {
      scan(machine, joint);
    } catch (const GeometryErrors& of_joint) {
      errors.insert(errors.end(), of_joint.errors().begin(), of_joint.errors().end());
    }
  }
  if (!errors.empty()) throw GeometryErrors(machine.source, std::move(errors));
  // With a lever that never vanishes, H stays on one side of G-J and K on one side of H-joint: any angle tells both.
  const double middle = 0.5 * (machine.links[kBucket].min_rad + machine.links[kBucket].max_rad);
  const PlanarVector pin = four_bar_.bucket_joint + rotated(four_bar_.bucket_pin, middle);
  const PlanarVector crank =
      circles_meet(four_bar_.rocker_pin, four_bar_.rocker, pin, four_bar_.coupler, four_bar_.branch).value();
  const auto side = [](double area) { return area > 0 ? 1.0 : -1.0; };
  four_bar_.rocker_side = side(cross(four_bar_.rocker_pin - four_bar_.cylinder_pin, crank - four_bar_.cylinder_pin));
  four_bar_.coupler_side = side(cross(four_bar_.bucket_joint - crank, pin - crank));
}

void Kinematics::scan(const MachineDescription& machine, int joint) {
  const auto index = static_cast<std::size_t>(joint);
  const LinkDescription& link = machine.links[index];
  Span& span = spans_[index];
  span.min_rad = link.min_rad - kMargin_rad;
  span.max_rad = link.max_rad + kMargin_rad;
  const auto refuse_at = [&](double angle, const std::string& why) {
    const bool lower_half = angle < 0.5 * (link.min_rad + link.max_rad);
    throw GeometryErrors(machine.source,
                         {{joint, "links", lower_half ? "min_rad" : "max_rad", lower_half ? link.min_rad : link.max_rad,
                           why + " at " + number_text(angle) + " rad"}});
  };
  const int steps = std::max(1, 1 + static_cast<int>((span.max_rad - span.min_rad) / kScanStep_rad));
  double sign = 0;
  for (int i = 0; i <= steps; ++i) {
    const double angle = span.min_rad + (span.max_rad - span.min_rad) * i / steps;
    const auto state = cylinder_at(joint, angle);
    if (!state) refuse_at(angle, "with these pins the linkage cannot close");
    sign = i == 0 ? std::copysign(1.0, state->lever_m) : sign;
    if (!(sign * state->lever_m >= kLeastLever_m)) {
      refuse_at(angle, "the cylinder's lever must be at least " + number_text(1e3 * kLeastLever_m) +
                           " mm over the joint's whole range, but these pins give " +
                           number_text(1e3 * sign * state->lever_m) + " mm");
    }
  }
  const auto length_at = [&](double angle) { return cylinder_at(joint, angle)->length_m; };
  std::tie(span.min_length, span.max_length) =
      std::minmax({length_at(outermost(machine, joint, span.min_rad, -kScanStep_rad, kStrokeMargin_m)),
                   length_at(outermost(machine, joint, span.max_rad, kScanStep_rad, kStrokeMargin_m))});
  const auto [lowest, highest] = std::minmax({length_at(link.min_rad), length_at(link.max_rad)});
  check_stroke(machine, joint, lowest, highest);
  if (joint != kBucket) triangles_[index].side = sign;
}

double Kinematics::outermost(const MachineDescription& machine, int joint, double from_rad, double step_rad,
                             double margin_m) const noexcept {
  const CylinderDescription& cylinder = machine.cylinders[static_cast<std::size_t>(joint)];
  const double sign = std::copysign(1.0, cylinder_at(joint, from_rad)->lever_m);
  const auto can_be = [&](double angle) {
    const auto state = cylinder_at(joint, angle);
    return state && sign * state->lever_m >= kLeastLever_m && state->length_m >= cylinder.min_length_m - margin_m &&
           state->length_m <= cylinder.max_length_m + margin_m;
  };
  double reached = from_rad;
  while (can_be(reached + step_rad)) reached += step_rad;
  return reached;
}

CylinderState Kinematics::triangle_at(const Triangle& triangle, double joint_rad) const noexcept {
  const double corner = joint_rad + triangle.offset_rad;
  const double length = std::sqrt(triangle.sum_squares - 2 * triangle.product * std::cos(corner));
  return {length, triangle.product * std::sin(corner) / length};
}

/// The rocker turns at w per bucket rate, such that H keeps its distance from K: (H - K) . (w x (H - J) - K') = 0.
std::optional<CylinderState> Kinematics::four_bar_at(double bucket_rad) const noexcept {
  const PlanarVector arm_of_pin = rotated(four_bar_.bucket_pin, bucket_rad);
  const PlanarVector pin = four_bar_.bucket_joint + arm_of_pin;
  const auto crank = circles_meet(four_bar_.rocker_pin, four_bar_.rocker, pin, four_bar_.coupler, four_bar_.branch);
  if (!crank) return std::nullopt;
  const PlanarVector coupler = *crank - pin;
  const PlanarVector crank_per_rocker = turned_left(*crank - four_bar_.rocker_pin);
  const double rocker_rate = coupler.dot(turned_left(arm_of_pin)) / coupler.dot(crank_per_rocker);
  const PlanarVector cylinder = *crank - four_bar_.cylinder_pin;
  const double length = cylinder.norm();
  return CylinderState{length, cylinder.dot(crank_per_rocker) * rocker_rate / length};
}

std::optional<double> Kinematics::four_bar_inverse(double length_m) const noexcept {
  const auto crank =
      circles_meet(four_bar_.cylinder_pin, length_m, four_bar_.rocker_pin, four_bar_.rocker, four_bar_.rocker_side);
  if (!crank) return std::nullopt;
  const auto pin = circles_meet(*crank, four_bar_.coupler, four_bar_.bucket_joint, four_bar_.bucket_pin_radius,
                                four_bar_.coupler_side);
  if (!pin) return std::nullopt;
  const PlanarVector arm_of_pin = *pin - four_bar_.bucket_joint;
  return std::atan2(cross(four_bar_.bucket_pin, arm_of_pin), four_bar_.bucket_pin.dot(arm_of_pin));
}

std::optional<CylinderState> Kinematics::cylinder_at(int joint, double joint_rad) const noexcept {
  if (joint == kBucket) return four_bar_at(joint_rad);
  return triangle_at(triangles_[static_cast<std::size_t>(joint)], joint_rad);
}

std::optional<double> Kinematics::joint_at(int joint, double length_m) const noexcept {
  const Span& span = spans_[static_cast<std::size_t>(joint)];
  if (!(length_m >= span.min_length && length_m <= span.max_length)) return std::nullopt;
  std::optional<double> angle;
  if (joint == kBucket) {
    angle = four_bar_inverse(length_m);
  } else {
    const Triangle& triangle = triangles_[static_cast<std::size_t>(joint)];
    const double cosine = (triangle.sum_squares - length_m * length_m) / (2 * triangle.product);
    angle = triangle.side * std::acos(std::clamp(cosine, -1.0, 1.0)) - triangle.offset_rad;
  }
  if (!angle) return std::nullopt;
  // The turn that lies in the working range.
  const double middle = 0.5 * (span.min_rad + span.max_rad);
  return middle + wrapped(*angle - middle);
}

PlanarVector Kinematics::tip(const JointVector& joints_rad) const noexcept {
  PlanarVector at = PlanarVector::Zero();
  double angle = 0;
  for (int i = 0; i < kJoints; ++i) {
    angle += joints_rad[i];
    at += lengths_m_[i] * PlanarVector(std::cos(angle), std::sin(angle));
  }
  return at;
}

/// Column i is what lies beyond joint i, turned left.
PlanarJacobian Kinematics::tip_jacobian(const JointVector& joints_rad) const noexcept {
  PlanarJacobian jacobian;
  const std::array<double, 3> angles{joints_rad[0], joints_rad[0] + joints_rad[1], joints_rad.sum()};
  PlanarVector beyond = PlanarVector::Zero();
  for (int i = kJoints - 1; i >= 0; --i) {
    const double angle = angles[static_cast<std::size_t>(i)];
    beyond += lengths_m_[i] * PlanarVector(std::cos(angle), std::sin(angle));
    jacobian.col(i) = turned_left(beyond);
  }
  return jacobian;
}

std::optional<JointVector> Kinematics::inverse(const PlanarVector& tip_m, double bucket_absolute_rad) const noexcept {
  const double boom = lengths_m_[kBoom];
  const double arm = lengths_m_[kArm];
  const PlanarVector pin =
      tip_m - lengths_m_[kBucket] * PlanarVector(std::cos(bucket_absolute_rad), std::sin(bucket_absolute_rad));
  const double cosine = (pin.squaredNorm() - boom * boom - arm * arm) / (2 * boom * arm);
  if (!(std::abs(cosine) <= 1)) return std::nullopt;
  const double sine = -std::sqrt(1 - cosine * cosine);  // elbow up: the arm hangs to the right of the boom
  const double boom_rad = wrapped(std::atan2(pin.y(), pin.x()) - std::atan2(arm * sine, boom + arm * cosine));
  const double arm_rad = std::atan2(sine, cosine);
  return JointVector(boom_rad, arm_rad, wrapped(bucket_absolute_rad - boom_rad - arm_rad));
}

MachinePose pose_of(const MachineDescription& m, const JointVector& q) {
  MachinePose pose;
  pose.boom = joint_frame(Frame2::Identity(), PlanarVector::Zero(), q[kBoom]);
  pose.arm = joint_frame(pose.boom, {m.links[kBoom].length_m, 0}, q[kArm]);
  pose.bucket = joint_frame(pose.arm, {m.links[kArm].length_m, 0}, q[kBucket]);
  pose.rocker_pin_m = pose.arm * m.bucket_linkage.rocker_pin_m;
  pose.bucket_pin_m = pose.bucket * m.bucket_linkage.bucket_pin_m;
  pose.linkage_pin_m = linkage_joint(m.bucket_linkage, pose.rocker_pin_m, pose.bucket_pin_m);
  pose.cylinders[kBoom] = {m.boom_mount.parent_pin_m, pose.boom * m.boom_mount.child_pin_m};
  pose.cylinders[kArm] = {pose.boom * m.arm_mount.parent_pin_m, pose.arm * m.arm_mount.child_pin_m};
  pose.cylinders[kBucket] = {pose.arm * m.bucket_linkage.cylinder_pin_m, pose.linkage_pin_m};
  pose.tip_m = pose.bucket * PlanarVector(m.links[kBucket].length_m, 0);
  return pose;
}

double barrel_length_m(const CylinderDescription& cylinder, double length_m) {
  return std::min(cylinder.min_length_m * 0.86, length_m * 0.95);
}

std::array<PlanarVector, 6> bucket_outline(const MachineDescription& machine) {
  const BucketProfile& profile = machine.bucket_profile;
  return {PlanarVector(machine.links[kBucket].length_m, 0),
          profile.edge_m,
          profile.heel_m,
          profile.back_m,
          PlanarVector(PlanarVector::Zero()),
          profile.cheek_m};
}

JointVector middle_of_range(const MachineDescription& machine) noexcept {
  JointVector middle;
  for (int i = 0; i < kJoints; ++i) {
    const LinkDescription& link = machine.links[static_cast<std::size_t>(i)];
    middle[i] = 0.5 * (link.min_rad + link.max_rad);
  }
  return middle;
}

}  // namespace knuckle
